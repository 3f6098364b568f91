//! Robots of EXP1 and of `mapping`, whose devices are nodes of ROS (Figure 10 of the paper).
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use std::process::{Child, Command};
use std::time::Duration;

use serde_json::{Value as Json, json};
use slate_blackboard::interface::Value;
use slate_runtime::Options;
use slate_runtime::configuration::{Database, Options as Sources};

use crate::ros2::rclpy::agent::{Running, alone, eventually};
use crate::ros2::rclpy::peer::{Peer, python};

const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../examples");

/// The robot's devices, until this is dropped.
struct Base(Child);

impl Base {
    fn start(domain: u16) -> Self {
        let mut command = Command::new(python());
        command.arg(format!("{EXAMPLES}/exp1/base.py")).env("ROS_DOMAIN_ID", domain.to_string());
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

/// EXP1's robot with further settings, armed.
pub fn robot(domain: u16, sets: &[&str]) -> Running {
    example("exp1/ros.toml", domain, sets)
}

fn example(file: &str, domain: u16, sets: &[&str]) -> Running {
    let sources = Sources {
        extra_tables: [slate_ros2::TABLE, "report"].map(Into::into).to_vec(),
        sets: [format!("ros2.domain={domain}")]
            .into_iter()
            .chain(sets.iter().map(|set| (*set).into()))
            .collect(),
        ..Sources::default()
    };
    let database = Database::open(format!("{EXAMPLES}/{file}"), sources).unwrap();
    Running::load_database(
        &database,
        &[slate_wheeled::plugin(), slate_mapping::plugin()],
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

/// What an observer has seen of a robot.
struct Drive {
    /// The fastest command.
    speed: f64,
    /// Positions of the base.
    path: Vec<[f64; 2]>,
}

/// Watches a robot until its mission has ended, well.
fn drive(agent: &Running, domain: u16) -> Drive {
    let mut peer = Peer::start("observer", domain);
    peer.subscribe("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
    peer.subscribe("/position", "geometry_msgs/msg/Point", json!({ "depth": 100 }));
    let mut seen = Drive { speed: 0.0, path: Vec::new() };
    let at = |point: &Json| ["x", "y"].map(|axis| point[axis].as_f64().unwrap());
    eventually("the goal", || {
        seen.speed = peer.take("/cmd_vel").iter().map(speed).fold(seen.speed, f64::max);
        seen.path.extend(peer.take("/position").iter().map(at));
        state(agent).is_some_and(|state| state != "RUNNING")
    });
    assert_eq!(state(agent).as_deref(), Some("SUCCEEDED"));
    eventually("a position", || {
        let new = peer.take("/position");
        seen.path.extend(new.iter().map(at));
        !new.is_empty()
    });
    seen
}

fn distance([x, y]: [f64; 2], to: [f64; 2]) -> f64 {
    (x - to[0]).hypot(y - to[1])
}

#[test]
fn a_robot_whose_devices_are_nodes_reaches_its_goal() {
    alone("ros2::rclpy::robot::a_robot_whose_devices_are_nodes_reaches_its_goal", |domain| {
        let _base = Base::start(domain);
        let seen = drive(&robot(domain, &[]), domain);
        assert!(seen.speed > 0.05, "{}", seen.speed);
        // The node is where the robot believes it is.
        let last = *seen.path.last().unwrap();
        assert!(distance(last, [0.0, 0.0]) < 0.2, "{last:?}");
    });
}

/// Center and radius of what base.py puts between its start and the goal.
const PILLAR: ([f64; 2], f64) = ([-0.6, 0.5], 0.2);

/// Occupancy in percent at a place of the robot's map, or -1; the greatest of the cells around.
fn occupancy(agent: &Running, [x, y]: [f64; 2]) -> i128 {
    let map = agent.composer.board().read("r2/occupancy_mapper/change").unwrap().unwrap().0;
    let number = |key: &str| map.get(key).and_then(Value::as_f64).unwrap();
    let origin =
        |axis| map.get("origin").and_then(|origin| origin.get(axis)).and_then(Value::as_f64).unwrap();
    let Some(Value::List(cells)) = map.get("data") else { panic!("{map:?}") };
    let column = ((x - origin("x")) / number("resolution")) as usize;
    let row = ((y - origin("y")) / number("resolution")) as usize;
    let around = [column - 1, column, column + 1].map(|column| row * number("width") as usize + column);
    around.iter().filter_map(|cell| cells[*cell].as_integer()).max().unwrap()
}

#[test]
fn a_robot_of_nodes_maps_its_room_and_drives_by_the_map() {
    alone("ros2::rclpy::robot::a_robot_of_nodes_maps_its_room_and_drives_by_the_map", |domain| {
        let _base = Base::start(domain);
        let agent = example("mapping/ros.toml", domain, &[]);
        let seen = drive(&agent, domain);
        let last = *seen.path.last().unwrap();
        assert!(distance(last, [-1.6, 0.2]) < 0.2, "{last:?}");
        // The straight line leads through the pillar; the robot's narrow side is 0.19 m from its axle.
        let clearance = seen.path.iter().map(|at| distance(*at, PILLAR.0)).fold(f64::INFINITY, f64::min);
        assert!(clearance > PILLAR.1 + 0.2 && clearance < 1.0, "{clearance}");
        // In front of the pillar it is free, and the walls are where the odometry puts them.
        for (at, is_wall) in
            [([-0.25, 0.5], false), ([-0.4, 0.5], true), ([2.52, 0.8], true), ([2.3, 0.8], false)]
        {
            let cell = occupancy(&agent, at);
            assert!(if is_wall { cell > 65 } else { (0..35).contains(&cell) }, "{at:?}: {cell}");
        }
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
        // The plan continues, and nothing of it comes through.
        assert!(heard.iter().all(|twist| speed(twist) == 0.0), "{heard:?}");
        let wanted =
            agent.number("r2/execute/wheels/left").abs() + agent.number("r2/execute/wheels/right").abs();
        assert!(wanted > 0.0, "{wanted}");
    });
}
