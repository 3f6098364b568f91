//! Properties of a node, over Zenoh.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use std::time::Duration;

use serde_json::{Value as Json, json};
use slate_ros2::{RosExplorer, RosWireSettings};

use crate::ros2::rclpy::agent::{Running, eventually};
use crate::ros2::rclpy::type_hashes::{hash_of_ros, packages};
use crate::ros2::zenoh::peer::{Node, Router};

/// An agent with all that a node can have of itself.
fn house(router: &Router) -> Running {
    let table = router.table(3) + "parameters = \"set\"\nlifecycle = \"set\"\nclock = true\ntf = true\n";
    Running::lockstep(&format!("agent.name = \"house\"\n[modules.lamp]\n[modules.mast]\n[ros2]\n{table}"))
}

#[test]
fn endpoints_of_a_node_have_the_types_and_hashes_of_ros() {
    let router = Router::start();
    let _agent = house(&router);
    let mut node = Node::start(&router, 3);
    let mut tokens = Vec::new();
    eventually("all tokens", || {
        tokens = node.tokens();
        tokens.len() >= 18
    });
    assert!(tokens.iter().any(|token| token.ends_with("/0/0/NN/%/%/house")), "{tokens:?}");
    let mut checked = 0;
    for token in &tokens {
        let parts: Vec<_> = token.split('/').collect();
        let [.., kind, _, "%", "house", _, type_name, hash, _] = parts[..] else { continue };
        let name = type_name.replace("::dds_::", "/").replace("::", "/");
        let name = name.trim_end_matches('_');
        // The packages have no tf2_msgs.
        if !name.starts_with("tf2_msgs") {
            assert_eq!(hash, hash_of_ros(&packages().join(name), name), "{token}");
            assert_eq!(kind, if name.contains("/srv/") { "SS" } else { "MP" });
            checked += 1;
        }
    }
    // Six services of parameters and five of a lifecycle; time, log, and changes of parameters and of the state.
    assert_eq!(checked, 15, "{tokens:?}");
}

#[test]
fn parameters_time_and_state_are_there_over_zenoh() {
    let router = Router::start();
    let agent = house(&router);
    let mut node = Node::start(&router, 3);
    let call = |node: &mut Node, name: &str, kind: &str, request: Json| {
        node.request(
            json!({ "do": "call", "service": format!("/house/{name}"), "type": kind, "request": request }),
        )
    };
    eventually("the services", || {
        let services = node.request(json!({ "do": "services" }));
        services["/house/get_parameters"] == json!(["rcl_interfaces/srv/GetParameters"])
    });
    let names = json!({ "names": ["lamp.brightness"] });
    let got = call(&mut node, "get_parameters", "rcl_interfaces/srv/GetParameters", names);
    assert_eq!(got["values"][0]["double_value"], 0.5);
    let value = json!({ "type": 3, "double_value": 0.25 });
    let change = json!({ "parameters": [{ "name": "lamp.brightness", "value": value }] });
    let done = call(&mut node, "set_parameters", "rcl_interfaces/srv/SetParameters", change);
    assert_eq!(done["results"][0]["successful"], json!(true), "{done}");
    eventually("the parameter", || agent.number("lamp/params/brightness") == 0.25);
    // Without actuators, there is nothing to deactivate.
    let change = json!({ "transition": { "id": 4 } });
    let changed = call(&mut node, "change_state", "lifecycle_msgs/srv/ChangeState", change);
    assert_eq!(changed["success"], json!(false));

    node.subscribe("/clock", "rosgraph_msgs/msg/Clock", json!({}));
    let mut clock = Vec::new();
    eventually("the time", || {
        clock.extend(node.take("/clock"));
        clock.len() > 5
    });
    let time =
        |own: &Json| own["clock"]["sec"].as_f64().unwrap() + own["clock"]["nanosec"].as_f64().unwrap() / 1e9;
    assert!(clock.windows(2).all(|pair| time(&pair[0]) < time(&pair[1])));
    assert!((time(clock.last().unwrap()) - agent.composer.now() as f64 / 1e9).abs() < 5.0);
}

#[test]
fn frames_go_between_agents_over_zenoh() {
    let router = Router::start();
    let house = house(&router);
    // It comes after the fixed frame was sent.
    eventually("some cycles", || house.composer.cycles() > 50);
    let table = router.table(3) + "frames.\"view/transform\" = \"mast\"";
    let agent = Running::of(&format!(
        "agent.name = \"viewer\"\nloop.period = \"10ms\"\n[modules.view]\nkind = \"external_frame\"\n[ros2]\n{table}"
    ));
    eventually("the mast", || agent.number("view/frame/translation/z") == 1.25);
}

#[test]
fn tools_see_a_domain_over_zenoh() {
    let router = Router::start();
    let table = "write.\"/odom\" = \"sensor/odometry\"\nwrite.\"/scan\" = \"sensor/scan\"";
    let agent = Running::start("talker", &(router.table(3) + table));
    let mut node = Node::start(&router, 3);
    node.subscribe("/odom", "nav_msgs/msg/Odometry", json!({ "reliable": false }));
    let wire = RosWireSettings::zenoh(&format!("tcp/127.0.0.1:{}", router.port), false).unwrap();
    let mut explorer = RosExplorer::join(3, &wire, false).unwrap();
    eventually("the topic", || {
        explorer.discover(Duration::from_millis(100));
        explorer.topics().get("/odom").is_some_and(|own| own.publishers.len() + own.subscriptions.len() == 2)
    });
    assert!(explorer.nodes().contains("/talker") && explorer.nodes().contains("/peer"));
    let topics = explorer.topics();
    let (publisher, subscription) = (&topics["/odom"].publishers[0], &topics["/odom"].subscriptions[0]);
    assert_eq!(publisher.node.as_deref(), Some("/talker"));
    assert_eq!(publisher.type_hash, slate_ros2::known_type_hash("nav_msgs/msg/Odometry", None).ok());
    assert!(publisher.reliable && !subscription.reliable);
    assert_eq!(explorer.services()["/talker/get_parameters"], "rcl_interfaces/srv/GetParameters");
    // All that was kept, also for this one.
    let texts = ["one", "two", "three"];
    texts.iter().for_each(|text| agent.composer.log(slate_module::Level::Warn, text));
    std::thread::sleep(Duration::from_millis(300));
    let log = explorer.subscribe("/rosout").unwrap();
    let (schema, mut heard) = (log.schema(None).unwrap(), Vec::new());
    eventually("the kept lines", || {
        heard.extend(log.next(Duration::from_secs(1)).map(|line| {
            let line = serde_json::to_value(schema.decode(&line).unwrap()).unwrap();
            line["msg"].as_str().unwrap().to_owned()
        }));
        texts.iter().all(|text| heard.iter().any(|line| line == text))
    });
    // One with a subscription of a node, and one without.
    for topic in ["/odom", "/scan"] {
        let stream = explorer.subscribe(topic).unwrap();
        let message = stream.next(Duration::from_secs(10)).unwrap();
        assert!(stream.schema(None).unwrap().decode(&message).is_ok());
    }
    drop(agent);
    eventually("nobody", || {
        explorer.discover(Duration::from_millis(50));
        !explorer.nodes().contains("/talker")
    });
    // No router, and none that clear text may reach.
    let nowhere = RosWireSettings::zenoh("tcp/127.0.0.1:9", false).unwrap();
    let error = RosExplorer::join(3, &nowhere, false).unwrap_err();
    assert!(error.to_string().contains("no router is reached at `tcp/127.0.0.1:9`"), "{error}");
    assert!(error.help().contains("rmw_zenohd"));
}
