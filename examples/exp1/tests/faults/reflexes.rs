//! Reflexes without sensors, and the robot without reflexes.

use super::trouble::{SILENT_ORIENTATION, SILENT_POSITION};
use super::{agent, finish, number, tree, verdict, wheels};

/// When the first turn of a reflex begins that takes longer than a second, seconds.
fn first_long_turn(seed: u64) -> Option<f64> {
    let mut agent = agent(&[&format!("agent.seed={seed}")]);
    let mut since = None;
    while verdict(agent.board()) == "RUNNING" {
        agent.step();
        let now = agent.now() as f64 * 1e-9;
        let start = if tree(&agent) == "AvoidObstacle > TurnAngle" { since.or(Some(now)) } else { None };
        since = start;
        if start.is_some_and(|start| now - start > 1.0) {
            return start;
        }
    }
    None
}

#[test]
fn a_reflex_turns_while_position_or_orientation_is_silent() {
    let turns: Vec<_> = (0..20).filter_map(|seed| Some((seed, first_long_turn(seed)?))).take(3).collect();
    assert_eq!(turns.len(), 3, "{turns:?}");
    for (kind, (seed, start)) in [SILENT_POSITION, SILENT_ORIENTATION]
        .into_iter()
        .flat_map(|kind| turns.iter().map(move |turn| (kind, *turn)))
    {
        let mut agent = agent(&[
            &format!("modules.trouble.params.kind={kind}"),
            &format!("modules.trouble.params.from={:.2}", start - 0.1),
            &format!("modules.trouble.params.until={:.2}", start + 3.0),
            &format!("agent.seed={seed}"),
        ]);
        // The pose is unknown 0.2 s after the last measurement, and the last one counts for 0.1 s more.
        while agent.now() < ((start + 0.3) * 1e9) as u64 {
            agent.step();
        }
        let [left, right] = wheels(agent.board());
        let runs = tree(&agent);
        let says = format!("kind {kind}, seed {seed}: {runs}, {left} and {right} rad/s");
        assert!(runs == "AvoidObstacle > TurnAngle" && left == -right && left != 0.0, "{says}");
        while tree(&agent) == "AvoidObstacle > TurnAngle" {
            agent.step();
        }
        assert_eq!(tree(&agent), "AvoidObstacle > SetWheelSpeed", "{says}");
        finish(&mut agent);
    }
}

#[test]
fn without_reflexes_the_robot_drives_into_the_box() {
    let mut hits = 0;
    for seed in 0..10 {
        let sets = ["robots.r2.modules.avoid_obstacle.enabled=false", &*format!("agent.seed={seed}")];
        let mut agent = agent(&sets);
        while verdict(agent.board()) == "RUNNING" && agent.now() < 20_000_000_000 {
            agent.step();
        }
        assert_eq!(number(agent.board(), "r2/execute/status/reflexes"), 0.0);
        hits += u64::from(number(agent.board(), "referee/metrics/collisions_caused") > 0.0);
    }
    assert!(hits >= 5, "{hits} of 10 met the box beside the straight way");
}
