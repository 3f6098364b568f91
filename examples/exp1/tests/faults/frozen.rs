//! Sensors of the simulator that stop or freeze.

use super::{agent, number, tree, verdict, wheels};

/// A fault of R2 that lasts from 2.5 s on.
fn fault(sensor: &str, kind: &str) -> String {
    format!("world.faults.f={{ robot = \"r2\", sensor = {sensor:?}, kind = {kind:?}, from = 2.5 }}")
}

#[test]
fn encoders_that_stop_stop_the_wheels_of_every_controller() {
    for variant in ["controller=slate", "controller=rocs-fixed", "planner=local"] {
        let mut agent = agent(&[&fault("odometry", "silent"), variant, "agent.seed=1"]);
        let mut moved = false;
        while agent.now() < 8_000_000_000 {
            agent.step();
            let (now, wheels) = (agent.now(), wheels(agent.board()));
            moved |= wheels != [0.0; 2];
            // A reflex of the authors' law still turns away from what is near.
            let avoids = tree(&agent).starts_with("AvoidObstacle") && variant == "controller=rocs-fixed";
            assert!(
                now < 3_500_000_000 || avoids || wheels == [0.0; 2],
                "{wheels:?}, {variant}, at {now} ns"
            );
        }
        assert!(moved, "it drove before");
    }
}

/// With these settings, R2 stands after 12 s and has touched nothing.
fn stands(sets: &[&str]) {
    let mut agent = agent(sets);
    while agent.now() < 12_000_000_000 {
        agent.step();
    }
    assert_eq!(verdict(agent.board()), "RUNNING", "{sets:?}");
    assert_eq!(wheels(agent.board()), [0.0; 2], "{sets:?}");
    assert_eq!(number(agent.board(), "referee/metrics/collisions_caused"), 0.0, "{sets:?}");
}

#[test]
fn frozen_sonars_stop_the_wheels() {
    for seed in 0..8 {
        stands(&[&fault("sonar", "frozen"), &format!("agent.seed={seed}")]);
    }
}

#[test]
fn a_frozen_position_compass_or_odometry_stops_the_wheels() {
    for sensor in ["position", "orientation", "odometry"] {
        stands(&[&fault(sensor, "frozen"), "agent.seed=1"]);
    }
}

#[test]
fn sonars_and_odometry_that_freeze_together_stop_the_wheels() {
    let odometry = fault("odometry", "frozen").replace("faults.f", "faults.g");
    for seed in 0..3 {
        stands(&[&fault("sonar", "frozen"), &odometry, &format!("agent.seed={seed}")]);
    }
}
