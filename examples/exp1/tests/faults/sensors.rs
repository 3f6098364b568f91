//! Sensors that lie, stop or crash: the wheels stand still, and the robot comes back.

use super::trouble::{NAN_ORIENTATION, NAN_POSITION, NAN_SONAR, PANICKING, SILENT, SILENT_SONAR};
use super::{agent, finish, tree, verdict, wheels};

/// The robot stands from half a second after the beginning of what goes wrong to its end, and then reaches its goal. By sonars that
/// are right it may still avoid what is near.
fn stands_and_comes_back(kind: u64) {
    for seed in 0..5 {
        let mut agent =
            agent(&[&format!("modules.trouble.params.kind={kind}"), &format!("agent.seed={seed}")]);
        let mut moved = false;
        while agent.now() < 3_980_000_000 {
            agent.step();
            let (now, wheels) = (agent.now(), wheels(agent.board()));
            assert!(wheels.iter().all(|speed| speed.is_finite()), "{wheels:?} at {now}");
            moved |= wheels != [0.0; 2];
            if now > 2_500_000_000 {
                let avoids = matches!(kind, NAN_POSITION | NAN_ORIENTATION)
                    && tree(&agent).starts_with("AvoidObstacle");
                assert!(avoids || wheels == [0.0; 2], "{wheels:?}, kind {kind}, seed {seed}, at {now} ns");
            }
        }
        assert!(moved, "it drove before");
        finish(&mut agent);
    }
}

#[test]
fn without_trouble_the_detour_changes_nothing() {
    finish(&mut agent(&[]));
}

#[test]
fn a_position_that_is_not_a_number_stops_the_wheels() {
    stands_and_comes_back(NAN_POSITION);
}

#[test]
fn an_orientation_that_is_not_a_number_stops_the_wheels() {
    stands_and_comes_back(NAN_ORIENTATION);
}

#[test]
fn sensors_that_stop_stop_the_wheels() {
    stands_and_comes_back(SILENT);
}

#[test]
fn sonars_that_stop_stop_the_wheels() {
    stands_and_comes_back(SILENT_SONAR);
}

#[test]
fn sensors_that_crash_stop_the_wheels() {
    stands_and_comes_back(PANICKING);
}

#[test]
fn sonars_that_lie_send_no_command_that_is_not_a_number() {
    for kind in [NAN_SONAR, SILENT_SONAR] {
        for seed in 0..5 {
            let sets = [&*format!("modules.trouble.params.kind={kind}"), &*format!("agent.seed={seed}")];
            let mut agent = agent(&sets);
            while verdict(agent.board()) == "RUNNING" {
                agent.step();
                assert!(wheels(agent.board()).iter().all(|speed| speed.is_finite()));
            }
            assert_eq!(verdict(agent.board()), "SUCCEEDED", "kind {kind}, seed {seed}");
        }
    }
}

#[test]
fn trouble_at_any_time_is_survived() {
    for kind in [NAN_POSITION, NAN_ORIENTATION, SILENT, PANICKING] {
        for step in 0..12 {
            let from = f64::from(step) * 0.73;
            let sets = [
                format!("modules.trouble.params.kind={kind}"),
                format!("modules.trouble.params.from={from:.2}"),
                format!("modules.trouble.params.until={:.2}", from + 0.7),
                "agent.seed=1".into(),
            ];
            let mut agent = agent(&sets.each_ref().map(String::as_str));
            while verdict(agent.board()) == "RUNNING" {
                agent.step();
                assert!(wheels(agent.board()).iter().all(|speed| speed.is_finite()));
            }
            assert_eq!(verdict(agent.board()), "SUCCEEDED", "kind {kind} from {from:.2} s");
        }
    }
}
