//! From the simulator to the robot: EXP1's blocks drive a Pioneer at a serial line, with another configuration alone.
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and a robot on a line lives by the wall clock"
)]

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use slate::module::math;
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Control, Cycle, Options};
use slate_arcos_controller::Controller;

fn configuration(text: &str, sets: &[String]) -> Configuration {
    let options = configuration::Options {
        sets: sets.to_vec(),
        extra_tables: ["world", "report", "controller", "pace"].map(Into::into).to_vec(),
        ..configuration::Options::default()
    };
    Configuration::from_text("pioneer.toml", text, &options).unwrap()
}

/// How long the run may take on a busy machine.
const PATIENCE: Duration = Duration::from_secs(90);

#[test]
fn the_same_blocks_drive_a_robot_at_a_line_to_the_goal() {
    let link = std::env::temp_dir().join(format!("slate-exp1-pioneer-{}", std::process::id()));
    let options =
        slate_arcos_controller::ControllerOptions { link: Some(link.clone()), ..Default::default() };
    let controller = Controller::start(options).unwrap();
    let device = format!("robots.r2.modules.pioneer.params.device=\"{}\"", link.display());
    let plugins = [slate_arcos::plugin(), slate_wheeled::plugin()];
    let armed = Options { armed: true, ..Options::default() };
    let mut agent = Agent::load(&configuration(slate_exp1::PIONEER, &[device]), &plugins, armed).unwrap();
    let board = std::sync::Arc::clone(agent.board());
    let state = move || {
        let read = board.read("r2/arrival/verdict/state").ok().flatten();
        read.and_then(|(value, _)| value.as_str().map(str::to_owned))
    };
    let (seen, begun) = (state.clone(), Instant::now());
    let until = move |_: &Cycle<'_>| match seen().as_deref() {
        None | Some("RUNNING") if begun.elapsed() < PATIENCE => Control::Continue,
        _ => Control::Stop,
    };
    agent.run(Box::new(until)).unwrap();
    let pose = controller.pose();
    assert_eq!(state().as_deref(), Some("SUCCEEDED"), "it is at {pose:?}");
    // The goal as the robot knows it, and what the odometry may be off after a metre.
    assert!(math::hypot(pose[0], pose[1]) < 0.2, "{pose:?}");
}

#[test]
fn what_differs_from_the_simulated_robot_is_what_embodies_it() {
    let modules = |text: &str| -> BTreeSet<String> {
        configuration(text, &[]).modules().iter().map(|module| module.name.value.clone()).collect()
    };
    let (simulated, real) = (modules(slate_exp1::CONFIGURATION), modules(slate_exp1::PIONEER));
    let only =
        |own: &BTreeSet<String>, other: &BTreeSet<String>| own.difference(other).cloned().collect::<Vec<_>>();
    assert_eq!(only(&simulated, &real), ["r2/avoid_wall", "referee", "simulator"]);
    assert_eq!(only(&real, &simulated), ["r2/arrival", "r2/localize", "r2/odometry_monitor", "r2/pioneer"]);
}

#[test]
fn the_driver_tells_of_the_same_body_as_the_simulator() {
    let simulated = slate::sim::robot::RobotDescription::named("pioneer_p3dx").unwrap().unwrap().chassis();
    for model in &slate_arcos::model::MODELS {
        let real = model.chassis();
        // How fast it may go is what the controller allows here, and what the drive can do there.
        let same = slate::interfaces::Chassis { maximum_wheel_speed: simulated.maximum_wheel_speed, ..real };
        assert_eq!(same, simulated, "{}", model.name);
    }
}
