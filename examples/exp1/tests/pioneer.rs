//! From the simulator to the robot: EXP1's blocks drive a Pioneer at a serial line, with another configuration alone.
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and a robot on a line lives by the wall clock"
)]

use std::time::{Duration, Instant};

use slate::module::math;
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Control, Cycle, Options};
use slate_arcos_controller::Controller;

fn configuration(text: &str, sets: &[String]) -> Configuration {
    let options = configuration::Options {
        sets: sets.to_vec(),
        extra_tables: ["world", "report"].map(Into::into).to_vec(),
        ..configuration::Options::default()
    };
    Configuration::from_text("pioneer.toml", text, &options).unwrap()
}

/// How long the run may take on a busy machine.
const TIMEOUT: Duration = Duration::from_secs(90);

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
        let read = board.read("arrival/verdict/state").ok().flatten();
        read.and_then(|(value, _)| value.as_str().map(str::to_owned))
    };
    let (seen, begun) = (state.clone(), Instant::now());
    let until = move |_: &Cycle<'_>| match seen().as_deref() {
        None | Some("RUNNING") if begun.elapsed() < TIMEOUT => Control::Continue,
        _ => Control::Stop,
    };
    agent.run(Box::new(until)).unwrap();
    let pose = controller.pose();
    assert_eq!(state().as_deref(), Some("SUCCEEDED"), "it is at {pose:?}");
    // The goal as the robot knows it, and what the odometry may be off after a meter.
    assert!(math::hypot(pose[0], pose[1]) < 0.2, "{pose:?}");
}

/// The lines of a configuration's robot, without comments.
fn robot_part(text: &str) -> Vec<&str> {
    let from = text.find("[robots.r2.modules]").unwrap();
    let part = text[from..].split("\n[report]").next().unwrap_or_default();
    part.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).collect()
}

#[test]
fn devices_alone_differ_from_the_simulated_robot() {
    let (simulated, real) = (robot_part(slate_exp1::CONFIGURATION), robot_part(slate_exp1::PIONEER));
    let only = |own: &[&str], other: &[&str]| -> Vec<String> {
        let lines = own.iter().filter(|line| !other.contains(line));
        lines.map(|line| line.split(" = ").next().unwrap_or_default().to_owned()).collect()
    };
    let devices = ["sonar", "position", "orientation", "odometry", "motors"];
    let simulator = ["sonar", "position", "orientation", "odometry", "accuracy", "motors"];
    assert_eq!(only(&simulated, &real), simulator);
    // The driver has the line.
    assert_eq!(only(&real, &simulated), [&["pioneer"], &devices[..]].concat());
}

#[test]
fn the_robot_model_has_the_sensors_of_the_real_robot() {
    let device = "robots.r2.modules.pioneer.params.device=\"/dev/null\"".to_owned();
    let plugins = [slate_arcos::plugin(), slate_wheeled::plugin()];
    let agent =
        Agent::load(&configuration(slate_exp1::PIONEER, &[device]), &plugins, Options::default()).unwrap();
    let profile = agent.board().read("r2/knowledge/params/profile").unwrap().unwrap().0;
    assert_eq!(profile.as_str(), Some("real"));
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
