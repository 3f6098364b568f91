//! Services both ways, with rospy.

use serde_json::{Value as Json, json};
use slate_blackboard::interface::Value;
use slate_ros1::{Ros1Bridge, Ros1Settings, check_topics};
use slate_runtime::Options;

use crate::ros1::agent::{Running, eventually};
use crate::ros1::peer::{Master, Peer};

const SET_BOOL: &str = "std_srvs/SetBool";

fn text(master: &str, ros1: &str) -> String {
    format!("[modules.lamp]\n[modules.asker]\n[ros1]\nmaster = \"{master}\"\n{ros1}\n")
}

fn call(peer: &mut Peer, service: &str, kind: &str, request: &Json) -> Json {
    peer.request(json!({ "do": "call", "service": service, "type": kind, "request": request }))
}

#[test]
fn rospy_calls_an_inbox_and_learns_how_its_message_fares() {
    let master = Master::start();
    let table = format!(
        "serve.\"/lamp\" = {{ to = \"lamp/switches\", type = \"{SET_BOOL}\" }}\n\
         serve.\"~/off\" = {{ to = \"lamp/switches\", type = \"std_srvs/Trigger\", value = {{ on = false }} }}\n\
         serve.\"/on\" = {{ to = \"lamp/switches\", type = \"std_srvs/Empty\", value = {{ on = true }} }}"
    );
    let agent = Running::of(&text(&master.address(), &table));
    let mut peer = master.peer("person");
    let lit = || agent.value("lamp/lit/on");
    let done = json!({ "success": true, "message": "done" });
    assert_eq!(call(&mut peer, "/lamp", SET_BOOL, &json!({ "data": true })), done);
    assert_eq!(lit(), Some(Value::Bool(true)));
    assert_eq!(call(&mut peer, "/r2_d2/off", "std_srvs/Trigger", &json!({})), done);
    assert_eq!(lit(), Some(Value::Bool(false)));
    assert_eq!(call(&mut peer, "/on", "std_srvs/Empty", &json!({})), json!({}));
    assert_eq!(lit(), Some(Value::Bool(true)));
    // Over one connection, too.
    let many =
        json!({ "do": "call_often", "service": "/lamp", "type": SET_BOOL, "requests": [false, true, false] });
    assert_eq!(peer.request(many), json!([true, true, true]));
    assert_eq!(agent.number("lamp/count/value"), 6.0);
    // A module that refuses, in its own code.
    agent.set("lamp/params", "locked", Value::Bool(true));
    let refused = call(&mut peer, "/lamp", SET_BOOL, &json!({ "data": true }));
    assert_eq!(refused["success"], json!(false));
    assert_eq!(refused["message"], "/lamp/switches refuses the message, with code 7");
    // A response that can't say so fails.
    let failed = call(&mut peer, "/on", "std_srvs/Empty", &json!({}));
    assert!(failed["error"].as_str().unwrap().contains("refuses the message, with code 7"), "{failed}");
    assert_eq!(agent.number("lamp/count/value"), 6.0);
    // Tools of ROS know the service and its type.
    let shown = master.tool("rosservice", &["type", "/lamp"]);
    assert_eq!(shown.trim(), SET_BOOL);
    let shown = master.tool("rosservice", &["call", "/r2_d2/off"]);
    assert!(shown.contains("success: True"), "{shown}");
    // Another type is refused with the checksums of both.
    let failed = call(&mut peer, "/lamp", "std_srvs/Trigger", &json!({}));
    let words = "has type std_srvs/Trigger (937c9679a518e3a18d831e57125ea522) and this agent std_srvs/SetBool \
                 (09fb03525b03e7ea1fd3992bafd87e16)";
    assert!(failed["error"].is_string(), "{failed}");
    eventually("the reason", || agent.logged("(09fb03525b03e7ea1fd3992bafd87e16): use another service") == 1);
    assert!(words.contains("937c9679a518e3a18d831e57125ea522"));
}

#[test]
fn a_service_of_an_own_definition_is_offered() {
    let master = Master::start();
    let definition =
        "definition = \"bool on\\nstd_msgs/String[] why\\n---\\n====\\nMSG: std_msgs/String\\nstring data\"";
    let table =
        format!("serve.\"/lamp\" = {{ to = \"lamp/switches\", type = \"house/Light\", {definition} }}");
    let agent = Running::of(&text(&master.address(), &table));
    let shown = master.tool("rosservice", &["type", "/lamp"]);
    assert_eq!(shown.trim(), "house/Light");
    drop(agent);
}

#[test]
fn a_service_of_ros_1_that_does_not_fit_its_port_is_refused() {
    let cases = [
        (
            "serve.\"/on\" = { to = \"lamp/switches\", type = \"std_srvs/Empty\" }",
            "/lamp/switches and /on: std_srvs/EmptyRequest has no on",
        ),
        (
            "serve.\"/on\" = { to = \"lamp/lit\", type = \"std_srvs/SetBool\" }",
            "/lamp/lit and /on: it takes no messages",
        ),
        (
            "call.\"/on\" = { from = \"asker/wish\", type = \"std_srvs/SetBool\" }",
            "/asker/wish and /on: it takes no messages",
        ),
        (
            "call.\"/on\" = { from = \"asker/requests\", type = \"std_srvs/SetBool\", response = \"asker/delivery\" }",
            "/asker/delivery and /on: it is not an input",
        ),
    ];
    for (table, words) in cases {
        let agent = Running::load(&text("http://127.0.0.1:9", table), Options::default());
        let settings = Ros1Settings::of(&agent.configuration).unwrap().unwrap();
        let error = check_topics(&agent.composer, &settings).unwrap_err().to_string();
        assert!(error.contains(words), "{table}: {error}");
    }
}

#[test]
fn services_without_a_master_are_an_error_that_names_it() {
    let table = "serve.\"/lamp\" = { to = \"lamp/switches\", type = \"std_srvs/SetBool\" }";
    let agent = Running::load(&text("http://127.0.0.1:9", table), Options::default());
    let settings = Ros1Settings::of(&agent.configuration).unwrap().unwrap();
    let error = Ros1Bridge::open(&agent.surface, &settings).unwrap_err().to_string();
    assert!(error.contains("127.0.0.1:9"), "{error}");
}

#[test]
fn an_outbox_calls_a_service_of_rospy() {
    let master = Master::start();
    let table = format!(
        "call.\"/enable\" = {{ from = \"asker/requests\", type = \"{SET_BOOL}\", response = \"asker/reply\", \
         timeout = \"2s\" }}"
    );
    let agent = Running::of(&text(&master.address(), &table));
    let wish = |on: bool| agent.set("asker/wish", "on", Value::Bool(on));
    // Without a server.
    wish(true);
    let words = "a message of /asker/requests is not answered: /enable has no server";
    eventually("a lost message", || agent.logged(words) == 1);
    eventually("what becomes of it", || agent.number("asker/delivery/value") == 2.0);
    let mut peer = master.peer("base");
    let serve = |peer: &mut Peer, response: Json| {
        peer.request(json!({ "do": "serve", "service": "/enable", "type": SET_BOOL, "response": response }))
    };
    serve(&mut peer, json!({ "success": true, "message": "as you say" }));
    for number in 1..=20 {
        wish(number % 2 == 0);
        eventually("the next answer", || agent.number("asker/replies/value") == f64::from(number));
    }
    eventually("done", || agent.number("asker/delivery/value") == 1.0);
    let asked = peer.request(json!({ "do": "asked" }));
    let asked: Vec<_> = asked.as_array().unwrap().iter().map(|own| own["data"].as_bool().unwrap()).collect();
    assert_eq!(asked, (1..=20).map(|number| number % 2 == 0).collect::<Vec<_>>());
    assert_eq!(agent.value("asker/reply/message").unwrap().as_str(), Some("as you say"));
    // A response without success refuses the message, and so does a server that fails.
    let refused = f64::from((1 << 16) + 1);
    serve(&mut peer, json!({ "success": false, "message": "the battery is empty" }));
    wish(true);
    eventually("a refusal", || agent.number("asker/delivery/value") == refused);
    eventually("its response", || agent.number("asker/replies/value") == 120.0);
    serve(&mut peer, Json::Null);
    wish(false);
    eventually("a failure", || agent.logged("/enable failed: ") == 1);
    assert_eq!(agent.number("asker/replies/value"), 120.0);
}
