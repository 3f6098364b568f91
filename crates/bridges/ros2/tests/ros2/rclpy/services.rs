//! Services both ways.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use serde_json::{Value as Json, json};
use slate_blackboard::interface::Value;
use slate_ros2::{RosSettings, check_topics};

use crate::ros2::rclpy::agent::{Running, alone, eventually};
use crate::ros2::rclpy::peer::Peer;

const SET_BOOL: &str = "std_srvs/srv/SetBool";

fn text(ros2: &str) -> String {
    format!(
        "agent.name = \"house\"\nloop.period = \"10ms\"\n[modules.lamp]\n[modules.asker]\n[ros2]\n{ros2}\n"
    )
}

fn call(peer: &mut Peer, service: &str, kind: &str, request: &Json) -> Json {
    peer.request(json!({ "do": "call", "service": service, "type": kind, "request": request }))
}

fn wish(agent: &Running, on: bool) {
    let (input, _) = agent.composer.board().get("asker/wish").unwrap();
    input.set("on", &Value::Bool(on), agent.composer.now()).unwrap();
}

#[test]
fn an_inbox_is_a_service_that_tells_how_messages_fare() {
    alone("ros2::rclpy::services::an_inbox_is_a_service_that_tells_how_messages_fare", |domain| {
        let table = format!(
            "domain = {domain}\nserve.\"/lamp\" = {{ to = \"lamp/switches\", type = \"{SET_BOOL}\" }}\n\
             serve.\"~/off\" = {{ to = \"lamp/switches\", type = \"std_srvs/srv/Trigger\", value = {{ on = false }} }}\n\
             serve.\"/on\" = {{ to = \"lamp/switches\", type = \"std_srvs/srv/Empty\", value = {{ on = true }} }}"
        );
        let agent = Running::of(&text(&table));
        let mut peer = Peer::start("person", domain);
        let on = call(&mut peer, "/lamp", SET_BOOL, &json!({ "data": true }));
        assert_eq!(on, json!({ "success": true, "message": "done" }));
        let lit = || agent.composer.board().read("lamp/lit/on").unwrap().map(|(value, _)| value);
        assert_eq!(lit(), Some(Value::Bool(true)));
        let off = call(&mut peer, "/house/off", "std_srvs/srv/Trigger", &json!({}));
        assert_eq!(off, json!({ "success": true, "message": "done" }));
        assert_eq!(lit(), Some(Value::Bool(false)));
        assert_eq!(call(&mut peer, "/on", "std_srvs/srv/Empty", &json!({})), json!({}));
        assert_eq!(lit(), Some(Value::Bool(true)));
        // Each response is that to its own request.
        let mut other = Peer::start("other", domain);
        for number in 0..20 {
            let on = number % 2 == 0;
            let done = json!({ "success": true, "message": "done" });
            assert_eq!(call(&mut peer, "/lamp", SET_BOOL, &json!({ "data": on })), done);
            assert_eq!(lit(), Some(Value::Bool(on)));
            assert_eq!(call(&mut other, "/lamp", SET_BOOL, &json!({ "data": !on })), done);
            assert_eq!(lit(), Some(Value::Bool(!on)));
        }
        assert_eq!(agent.number("lamp/count/value"), 43.0);
        // A module that refuses, in its own code.
        let (params, _) = agent.composer.board().get("lamp/params").unwrap();
        params.set("locked", &Value::Bool(true), agent.composer.now()).unwrap();
        let refused = call(&mut peer, "/lamp", SET_BOOL, &json!({ "data": true }));
        assert_eq!(refused["success"], json!(false));
        assert_eq!(refused["message"], "/lamp/switches refuses the message, with code 7");
        assert_eq!(agent.number("lamp/count/value"), 43.0);
        let services = peer.request(json!({ "do": "services", "name": "house" }));
        assert_eq!(services["/lamp"], json!([SET_BOOL]));
        assert_eq!(services["/house/off"], json!(["std_srvs/srv/Trigger"]));
    });
}

#[test]
fn service_mismatch_is_reported_before_offer() {
    let cases = [
        (
            "serve.\"/on\" = { to = \"lamp/switches\", type = \"std_srvs/srv/Empty\" }",
            "/lamp/switches and /on: std_srvs/srv/Empty_Request has no on",
        ),
        (
            "serve.\"/on\" = { to = \"lamp/lit\", type = \"std_srvs/srv/SetBool\" }",
            "/lamp/lit and /on: it takes no messages",
        ),
        (
            "serve.\"/on\" = { to = \"lamp/switches\", type = \"a/srv/B\", definition = \"string on\\n---\" }",
            "`Switch/on` is bool, not text",
        ),
        (
            "call.\"/on\" = { from = \"asker/wish\", type = \"std_srvs/srv/SetBool\" }",
            "/asker/wish and /on: it takes no messages",
        ),
        (
            "call.\"/on\" = { from = \"asker/requests\", type = \"a/srv/B\", definition = \"string on\\n---\" }",
            "`on` of the message is a text",
        ),
        (
            "call.\"/on\" = { from = \"asker/requests\", type = \"std_srvs/srv/SetBool\", response = \"asker/delivery\" }",
            "/asker/delivery and /on: it is not an input",
        ),
    ];
    for (table, words) in cases {
        let agent = Running::load_text(&text(table));
        let settings = RosSettings::of(&agent.configuration).unwrap().unwrap();
        let error = check_topics(&agent.composer, &settings).unwrap_err().to_string();
        assert!(error.contains(words), "{table}: {error}");
    }
}

#[test]
fn an_outbox_calls_a_service_of_a_node() {
    alone("ros2::rclpy::services::an_outbox_calls_a_service_of_a_node", |domain| {
        let table = format!(
            "domain = {domain}\ncall.\"/enable\" = {{ from = \"asker/requests\", type = \"{SET_BOOL}\", \
             response = \"asker/reply\", timeout = \"800ms\" }}"
        );
        let agent = Running::of(&text(&table));
        // Without a server.
        wish(&agent, true);
        eventually("a lost message", || {
            agent.has_logged("a message of /asker/requests is not answered: /enable has no server")
        });
        eventually("what becomes of it", || agent.number("asker/delivery/value") == 2.0);
        let mut peer = Peer::start("base", domain);
        let serve = |peer: &mut Peer, service: &str, success: bool| {
            let response = json!({ "success": success, "message": "as you say" });
            peer.request(
                json!({ "do": "serve", "service": service, "type": SET_BOOL, "response": response }),
            );
        };
        serve(&mut peer, "/enable", true);
        // A node that has just come is found within the time that a message waits, or the next one finds it.
        eventually("an answer", || {
            if agent.number("asker/delivery/value") == 2.0 {
                wish(&agent, true);
                std::thread::sleep(std::time::Duration::from_millis(100));
            }
            agent.number("asker/replies/value") >= 1.0
        });
        eventually("done", || agent.number("asker/delivery/value") == 1.0);
        let asked = peer.request(json!({ "do": "asked", "service": "/enable" }));
        assert!(!asked.as_array().unwrap().is_empty());
        assert!(
            asked.as_array().unwrap().iter().all(|request| *request == json!({ "data": true })),
            "{asked}"
        );
        let (reply, _) = agent.composer.board().read("asker/reply/message").unwrap().unwrap();
        assert_eq!(reply.as_str(), Some("as you say"));
        let before = agent.number("asker/replies/value");
        for number in 1..=20 {
            wish(&agent, number % 2 == 0);
            eventually("the next answer", || {
                agent.number("asker/replies/value") == before + f64::from(number)
            });
        }
        let asked = peer.request(json!({ "do": "asked", "service": "/enable" }));
        let asked: Vec<_> =
            asked.as_array().unwrap().iter().map(|own| own["data"].as_bool().unwrap()).collect();
        assert_eq!(asked, (1..=20).map(|number| number % 2 == 0).collect::<Vec<_>>());
    });
}

#[test]
fn a_response_without_success_refuses_the_message() {
    alone("ros2::rclpy::services::a_response_without_success_refuses_the_message", |domain| {
        let table = format!(
            "domain = {domain}\ncall.\"/enable\" = {{ from = \"asker/requests\", type = \"{SET_BOOL}\", \
             response = \"asker/reply\" }}"
        );
        let agent = Running::of(&text(&table));
        let mut peer = Peer::start("base", domain);
        let response = json!({ "success": false, "message": "the battery is empty" });
        peer.request(json!({ "do": "serve", "service": "/enable", "type": SET_BOOL, "response": response }));
        wish(&agent, true);
        eventually("a refusal", || agent.number("asker/delivery/value") == f64::from((1 << 16) + 1));
        eventually("the response", || agent.number("asker/replies/value") == 100.0);
        let (reply, _) = agent.composer.board().read("asker/reply/message").unwrap().unwrap();
        assert_eq!(reply.as_str(), Some("the battery is empty"));
    });
}
