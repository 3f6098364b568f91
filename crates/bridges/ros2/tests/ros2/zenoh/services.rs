//! Services and actions over Zenoh.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use serde_json::{Value as Json, json};
use slate_blackboard::interface::Value;

use crate::ros2::rclpy::actions::{self, ABORTED, CANCELED, refused, set};
use crate::ros2::rclpy::agent::{Running, eventually};
use crate::ros2::rclpy::type_hashes::packages;
use crate::ros2::zenoh::peer::{Node, Router};

const SET_BOOL: &str = "std_srvs/srv/SetBool";

fn text(ros2: &str) -> String {
    format!(
        "agent.name = \"house\"\nloop.period = \"10ms\"\n[modules.lamp]\n[modules.asker]\n[ros2]\n{ros2}\n"
    )
}

fn call(node: &mut Node, service: &str, on: bool) -> Json {
    node.request(json!({ "do": "call", "service": service, "type": SET_BOOL, "request": { "data": on } }))
}

#[test]
fn an_inbox_answers_requests_over_zenoh() {
    let router = Router::start();
    let table =
        router.table(3) + &format!("serve.\"/lamp\" = {{ to = \"lamp/switches\", type = \"{SET_BOOL}\" }}");
    let agent = Running::of(&text(&table));
    let mut node = Node::start(&router, 3);
    eventually("the service", || node.request(json!({ "do": "services" }))["/lamp"] == json!([SET_BOOL]));
    let mut other = Node::start(&router, 3);
    let lit = || agent.composer.board().read("lamp/lit/on").unwrap().map(|(value, _)| value);
    let done = json!({ "success": true, "message": "done" });
    for number in 0..20 {
        let on = number % 2 == 0;
        assert_eq!(call(&mut node, "/lamp", on), done);
        assert_eq!(lit(), Some(Value::Bool(on)));
        assert_eq!(call(&mut other, "/lamp", !on), done);
        assert_eq!(lit(), Some(Value::Bool(!on)));
    }
    // A module that refuses, in its own code.
    let (params, _) = agent.composer.board().get("lamp/params").unwrap();
    params.set("locked", &Value::Bool(true), agent.composer.now()).unwrap();
    let refused = call(&mut node, "/lamp", true);
    assert_eq!(refused["success"], json!(false));
    assert_eq!(refused["message"], "/lamp/switches refuses the message, with code 7");
    assert_eq!(agent.number("lamp/count/value"), 40.0);
}

#[test]
fn an_outbox_calls_a_service_over_zenoh() {
    let router = Router::start();
    let table = router.table(3)
        + &format!(
            "call.\"/enable\" = {{ from = \"asker/requests\", type = \"{SET_BOOL}\", response = \"asker/reply\", timeout = \"800ms\" }}"
        );
    let agent = Running::of(&text(&table));
    let wish = |on: bool| {
        let (input, _) = agent.composer.board().get("asker/wish").unwrap();
        input.set("on", &Value::Bool(on), agent.composer.now()).unwrap();
    };
    wish(true);
    eventually("a lost message", || agent.has_logged("is not answered: /enable has no server"));
    eventually("what becomes of it", || agent.number("asker/delivery/value") == 2.0);
    let mut node = Node::start(&router, 3);
    let response = json!({ "success": true, "message": "as you say" });
    node.request(json!({ "do": "serve", "service": "/enable", "type": SET_BOOL, "response": response }));
    for number in 1..=20 {
        wish(number % 2 == 0);
        eventually("the answer", || agent.number("asker/replies/value") == f64::from(number));
    }
    let asked = node.request(json!({ "do": "asked", "service": "/enable" }));
    let asked: Vec<_> = asked.as_array().unwrap().iter().map(|own| own["data"].as_bool().unwrap()).collect();
    assert_eq!(asked, (1..=20).map(|number| number % 2 == 0).collect::<Vec<_>>());
    let (reply, _) = agent.composer.board().read("asker/reply/message").unwrap().unwrap();
    assert_eq!(reply.as_str(), Some("as you say"));
    // A server that dies.
    drop(node);
    eventually("a lost message", || {
        wish(true);
        agent.number("asker/delivery/value") == 2.0
    });
}

#[test]
fn an_agent_pursues_goals_of_another_over_zenoh() {
    let router = Router::start();
    let table = |own: String| router.table(3) + &own.replace("domain = 3\n", "");
    let house = Running::of(&actions::text(&table(actions::served(3))));
    let caller = actions::text(&table(actions::called(3))).replace("\"house\"", "\"visitor\"");
    let agent = Running::of(&caller);
    set(&agent, "seeker/wish", 6);
    eventually("the result", || agent.number("seeker/sum/value") == 1.0 + 20.0);
    eventually("done", || agent.number("seeker/delivery/value") == 1.0);
    assert!(agent.number("seeker/heard/value") >= 1.0);
    set(&agent, "seeker/wish", -1);
    eventually("a refusal", || agent.number("seeker/delivery/value") == refused(1));
    set(&agent, "seeker/wish", 41);
    eventually("a failure", || agent.number("seeker/delivery/value") == refused(ABORTED));
    let heard = agent.number("seeker/heard/value");
    set(&agent, "seeker/wish", 40);
    eventually("feedback", || agent.number("seeker/heard/value") > heard);
    set(&agent, "seeker/enough", 1);
    eventually("the end", || {
        let delivery = agent.number("seeker/delivery/value");
        delivery == refused(CANCELED) || delivery == 1.0
    });
    drop(house);
    set(&agent, "seeker/wish", 6);
    eventually("no server", || agent.has_logged("/count has no server"));
}

#[test]
fn an_action_over_zenoh_is_called_by_another_program() {
    let router = Router::start();
    let table = router.table(3) + &actions::served(3).replace("domain = 3\n", "");
    let _agent = Running::of(&actions::text(&table));
    let mut node = Node::start(&router, 3);
    eventually("the action", || {
        let services = node.request(json!({ "do": "services" }));
        services["/count/_action/send_goal"] == json!(["test_msgs/action/Fibonacci_SendGoal"])
    });
    let folder = packages();
    let mut pursue = |order: i32| {
        let goal = json!({ "do": "pursue", "action": "/count", "folder": folder, "order": order });
        node.request(goal).as_array().unwrap().clone()
    };
    let ended = pursue(9);
    assert_eq!(ended[..3], [json!(true), json!(4), json!([0, 1, 1, 2, 3, 5, 8, 13, 21, 34])]);
    assert!(ended[3].as_u64().unwrap() >= 1, "{ended:?}");
    assert_eq!(pursue(-1)[0], json!(false));
}
