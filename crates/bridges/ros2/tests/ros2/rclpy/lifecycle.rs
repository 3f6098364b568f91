//! The agent as a lifecycle node.

use serde_json::{Value as Json, json};

use crate::ros2::rclpy::agent::{Running, alone, eventually};
use crate::ros2::rclpy::peer::Peer;
use crate::ros2::rclpy::robot::robot;

const ACTIVATE: u64 = 3;
const DEACTIVATE: u64 = 4;

fn call(peer: &mut Peer, name: &str, kind: &str, request: Json) -> Json {
    let (service, of) = (format!("/ros_robot/{name}"), format!("lifecycle_msgs/srv/{kind}"));
    peer.request(json!({ "do": "call", "service": service, "type": of, "request": request }))
}

fn state(peer: &mut Peer) -> Json {
    call(peer, "get_state", "GetState", json!({}))["current_state"].clone()
}

fn change(peer: &mut Peer, transition: Json) -> Json {
    call(peer, "change_state", "ChangeState", json!({ "transition": transition }))["success"].clone()
}

#[test]
fn a_lifecycle_node_is_active_while_its_actuators_are_armed() {
    alone("ros2::rclpy::lifecycle::a_lifecycle_node_is_active_while_its_actuators_are_armed", |domain| {
        let agent = robot(domain, &["ros2.lifecycle=\"set\""]);
        let mut peer = Peer::start("manager", domain);
        peer.subscribe("/ros_robot/transition_event", "lifecycle_msgs/msg/TransitionEvent", json!({}));
        let (inactive, active) =
            (json!({ "id": 2, "label": "inactive" }), json!({ "id": 3, "label": "active" }));
        eventually("the first cycles", || state(&mut peer) == active);
        let kinds = peer.request(json!({ "do": "services", "name": "ros_robot" }));
        assert_eq!(kinds["/ros_robot/get_state"], json!(["lifecycle_msgs/srv/GetState"]));
        let graph = call(&mut peer, "get_transition_graph", "GetAvailableTransitions", json!({}));
        assert_eq!(graph["available_transitions"].as_array().map(Vec::len), Some(2));
        let states = call(&mut peer, "get_available_states", "GetAvailableStates", json!({}));
        assert_eq!(states["available_states"], json!([inactive, active]));

        assert_eq!(change(&mut peer, json!({ "id": ACTIVATE })), false);
        assert_eq!(change(&mut peer, json!({ "id": DEACTIVATE })), true);
        assert!(agent.composer.actuators().iter().all(|(_, stopped)| stopped.is_some()));
        eventually("the stop", || state(&mut peer) == inactive);
        let possible = call(&mut peer, "get_available_transitions", "GetAvailableTransitions", json!({}));
        assert_eq!(possible["available_transitions"][0]["transition"]["label"], "activate");
        assert_eq!(change(&mut peer, json!({ "label": "activate" })), true);
        eventually("the end of the stop", || state(&mut peer) == active);
        let mut events = Vec::new();
        eventually("both events", || {
            events.extend(peer.take("/ros_robot/transition_event"));
            events.len() >= 2
        });
        let goals: Vec<_> = events.iter().rev().take(2).map(|event| event["goal_state"].clone()).collect();
        assert_eq!(goals, [active, inactive.clone()]);

        // A stop by another caller is not reset.
        agent.stop_actuators("by a person");
        eventually("the stop", || state(&mut peer) == inactive);
        assert_eq!(change(&mut peer, json!({ "id": ACTIVATE })), false);
        assert!(
            agent.composer.actuators().iter().all(|(_, stopped)| stopped.as_deref() == Some("by a person"))
        );
    });
}

#[test]
fn nodes_only_read_a_state_that_they_may_not_change() {
    alone("ros2::rclpy::lifecycle::nodes_only_read_a_state_that_they_may_not_change", |domain| {
        let agent = robot(domain, &["ros2.lifecycle=\"read\""]);
        let mut peer = Peer::start("manager", domain);
        eventually("the first cycles", || state(&mut peer)["label"] == "active");
        assert_eq!(change(&mut peer, json!({ "id": DEACTIVATE })), false);
        assert!(agent.composer.actuators().iter().all(|(_, stopped)| stopped.is_none()));
        let none = call(&mut peer, "get_available_transitions", "GetAvailableTransitions", json!({}));
        assert_eq!(none["available_transitions"], json!([]));
        // By default a node has no lifecycle.
        let plain =
            Running::start("plain", &format!("domain = {domain}\nwrite.\"/odom\" = \"sensor/odometry\""));
        eventually("the node", || {
            peer.request(json!({ "do": "nodes" })).as_array().unwrap().contains(&"/plain".into())
        });
        eventually("its services", || {
            let kinds = peer.request(json!({ "do": "services", "name": "plain" }));
            let kinds = kinds.as_object().unwrap();
            assert!(!kinds.contains_key("/plain/get_state"));
            kinds.contains_key("/plain/get_parameters")
        });
        drop(plain);
    });
}
