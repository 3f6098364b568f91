//! EXP1's robot, whose devices are nodes of ROS (Figure 10 of the paper).
#![allow(clippy::disallowed_methods, reason = "ROS goes by the machine's clock")]

use std::process::{Child, Command};
use std::time::Duration;

use serde_json::{Value as Json, json};
use slate_runtime::Options;
use slate_runtime::configuration::{Database, Options as Sources};

use crate::ros2::rclpy::agent::{Running, alone, eventually};
use crate::ros2::rclpy::peer::{Peer, python};

const ROBOT: &str = include_str!("../../../../../../examples/exp1/ros.toml");

/// The robot's devices, until this is dropped.
struct Base(Child);

impl Base {
    fn start(domain: u16) -> Self {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../examples/exp1/base.py");
        let mut command = Command::new(python());
        command.arg(script).env("ROS_DOMAIN_ID", domain.to_string());
        command.env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
        command.env("ROS_LOG_DIR", concat!(env!("CARGO_TARGET_TMPDIR"), "/ros2-logs"));
        Self(command.spawn().unwrap())
    }
}

impl Drop for Base {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The robot with further settings, armed.
pub fn robot(domain: u16, sets: &[&str]) -> Running {
    let sources = Sources {
        extra_tables: [slate_ros2::TABLE, "report"].map(Into::into).to_vec(),
        sets: [format!("ros2.domain={domain}")]
            .into_iter()
            .chain(sets.iter().map(|set| (*set).into()))
            .collect(),
        ..Sources::default()
    };
    let database = Database::from_text("ros.toml", ROBOT, sources).unwrap();
    Running::load_database(
        &database,
        &[slate_wheeled::plugin()],
        Options { armed: true, ..Options::default() },
    )
    .connected()
}

fn state(agent: &Running) -> Option<String> {
    let read = agent.composer.board().read("arrival/verdict/state").unwrap();
    read.and_then(|(value, _)| value.as_str().map(ToOwned::to_owned))
}

fn speed(twist: &Json) -> f64 {
    twist["linear"]["x"].as_f64().unwrap().abs() + twist["angular"]["z"].as_f64().unwrap().abs()
}

#[test]
fn a_robot_whose_devices_are_nodes_reaches_its_goal() {
    alone("ros2::rclpy::robot::a_robot_whose_devices_are_nodes_reaches_its_goal", |domain| {
        let _base = Base::start(domain);
        let agent = robot(domain, &[]);
        let mut peer = Peer::start("observer", domain);
        peer.subscribe("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
        peer.subscribe("/position", "geometry_msgs/msg/Point", json!({}));
        let mut fastest: f64 = 0.0;
        eventually("the goal", || {
            fastest = peer.take("/cmd_vel").iter().map(speed).fold(fastest, f64::max);
            state(&agent).is_some_and(|state| state != "RUNNING")
        });
        assert_eq!(state(&agent).as_deref(), Some("SUCCEEDED"));
        assert!(fastest > 0.05, "{fastest}");
        // The node is where the robot believes it is.
        peer.take("/position");
        let mut last = None;
        eventually("a position", || {
            last = peer.take("/position").pop().or(last.take());
            last.is_some()
        });
        let at = last.unwrap();
        let distance = at["x"].as_f64().unwrap().hypot(at["y"].as_f64().unwrap());
        assert!(distance < 0.2, "{at}");
    });
}

#[test]
fn the_gate_stands_before_the_topic_of_commands() {
    alone("ros2::rclpy::robot::the_gate_stands_before_the_topic_of_commands", |domain| {
        let _base = Base::start(domain);
        let agent = robot(domain, &[]);
        let mut peer = Peer::start("observer", domain);
        peer.subscribe("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
        eventually("motion", || peer.take("/cmd_vel").iter().any(|twist| speed(twist) > 0.02));
        agent.stop_actuators("a person has pressed the button");
        std::thread::sleep(Duration::from_millis(500));
        peer.take("/cmd_vel");
        let mut heard = Vec::new();
        eventually("commands", || {
            heard.extend(peer.take("/cmd_vel"));
            heard.len() > 5
        });
        // The plan goes on, and nothing of it comes through.
        assert!(heard.iter().all(|twist| speed(twist) == 0.0), "{heard:?}");
        let wanted =
            agent.number("r2/execute/wheels/left").abs() + agent.number("r2/execute/wheels/right").abs();
        assert!(wanted > 0.0, "{wanted}");
    });
}
