//! Parameters of modules, with the client that rclpy has for them.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use serde_json::{Value as Json, json};

use crate::ros2::rclpy::agent::{Running, alone, eventually};
use crate::ros2::rclpy::peer::Peer;

fn text(ros2: &str) -> String {
    format!(
        "agent.name = \"house\"\n[modules.lamp]\n[modules.\"hall/asker\"]\nkind = \"asker\"\n[ros2]\n{ros2}\n"
    )
}

fn parameters(peer: &mut Peer, what: &str, arguments: &Json) -> Json {
    peer.request(json!({ "do": "parameters", "node": "/house", "what": what, "arguments": arguments }))
}

#[test]
fn a_node_lists_reads_and_sets_parameters_of_modules() {
    alone("ros2::rclpy::parameters::a_node_lists_reads_and_sets_parameters_of_modules", |domain| {
        let agent = Running::of(&text(&format!("domain = {domain}\nparameters = \"set\"")));
        let mut peer = Peer::start("operator", domain);
        let all = parameters(&mut peer, "list", &json!([]));
        assert_eq!(all, json!(["hall.asker.tells", "lamp.brightness", "lamp.locked"]));
        assert_eq!(
            parameters(&mut peer, "list", &json!(["lamp"])),
            json!(["lamp.brightness", "lamp.locked"])
        );
        let names = json!(["lamp.brightness", "lamp.locked", "lamp.color"]);
        assert_eq!(parameters(&mut peer, "get", &names), json!([0.5, false, null]));
        let shown = parameters(&mut peer, "describe", &json!(["lamp.brightness"]));
        assert_eq!(shown[0]["description"], "Brightness.");
        assert_eq!(shown[0]["type"], 3);
        assert_eq!(shown[0]["read_only"], json!(false));
        assert_eq!(shown[0]["floating_point_range"][0]["to_value"], 1.0);
        assert_eq!(parameters(&mut peer, "types", &json!(["lamp.locked", "lamp.color"])), json!([1, 0]));
        peer.subscribe("/parameter_events", "rcl_interfaces/msg/ParameterEvent", json!({}));
        std::thread::sleep(std::time::Duration::from_millis(500));
        let done = parameters(&mut peer, "set", &json!({ "lamp.brightness": 0.25, "lamp.locked": true }));
        assert_eq!(done, json!([[true, ""], [true, ""]]));
        eventually("the parameter", || agent.number("lamp/params/brightness") == 0.25);
        assert_eq!(parameters(&mut peer, "get", &names), json!([0.25, true, null]));
        // Others hear of it.
        let mut events = Vec::new();
        eventually("two events", || {
            events.extend(peer.take("/parameter_events"));
            events.retain(|event| event["node"] == "/house");
            let changed = events.iter().filter_map(|event| event["changed_parameters"].as_array()).flatten();
            changed.count() == 2
        });
        assert_eq!(events[0]["changed_parameters"][0]["name"], "lamp.brightness");
        assert_eq!(events[0]["changed_parameters"][0]["value"]["double_value"], 0.25);
        // The checks are those of tools, and the reason is theirs.
        let refused = parameters(&mut peer, "set", &json!({ "lamp.brightness": 7.0 }));
        assert_eq!(refused[0][0], json!(false));
        let reason = refused[0][1].as_str().unwrap();
        assert!(reason.contains("brightness") && reason.contains('1'), "{reason}");
        let refused = parameters(&mut peer, "set", &json!({ "lamp.color": 7.0 }));
        assert_eq!(refused, json!([[false, "no module has a parameter `lamp.color`"]]));
        // All or none.
        let both = json!({ "lamp.brightness": 0.75, "lamp.locked": 3 });
        let refused = parameters(&mut peer, "set_atomically", &both);
        assert_eq!(refused[0], json!(false), "{refused}");
        assert_eq!(agent.number("lamp/params/brightness"), 0.25);
        let both = json!({ "lamp.brightness": 0.75, "hall.asker.tells": false });
        assert_eq!(parameters(&mut peer, "set_atomically", &both), json!([true, ""]));
        eventually("both", || agent.number("lamp/params/brightness") == 0.75);
        let changed = agent.composer.board().read("hall/asker/params/tells").unwrap().unwrap().0;
        assert_eq!(changed.as_bool(), Some(false));
    });
}

#[test]
fn parameters_are_set_by_nodes_only_where_the_file_says_so() {
    alone("ros2::rclpy::parameters::parameters_are_set_by_nodes_only_where_the_file_says_so", |domain| {
        let agent = Running::of(&text(&format!("domain = {domain}\nparameters = \"read\"")));
        let mut peer = Peer::start("operator", domain);
        let refused = parameters(&mut peer, "set", &json!({ "lamp.brightness": 0.25 }));
        assert_eq!(refused[0][0], json!(false));
        assert!(refused[0][1].as_str().unwrap().contains("parameters = \"set\" in [ros2]"), "{refused}");
        assert_eq!(parameters(&mut peer, "get", &json!(["lamp.brightness"])), json!([0.5]));
        let shown = parameters(&mut peer, "describe", &json!(["lamp.brightness"]));
        assert_eq!(shown[0]["read_only"], json!(true));
        assert_eq!(agent.number("lamp/params/brightness"), 0.5);
    });
}
