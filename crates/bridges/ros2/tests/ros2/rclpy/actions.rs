//! Actions both ways.

use std::path::Path;

use serde_json::{Value as Json, json};
use slate_blackboard::interface::Value;
use slate_module::prelude::*;
use slate_ros2::{RosBridge, RosSettings, check_topics};
use slate_runtime::{Composer, ExternalContent, ExternalValue};

use crate::ros2::rclpy::agent::{
    Number, Running, alone, assert_repeated, database, eventually, plugins, record,
};
use crate::ros2::rclpy::peer::{Peer, python};

const FIBONACCI: &str = "test_msgs/action/Fibonacci";

/// States of goals, as `action_msgs/msg/GoalStatus` has them.
const SUCCEEDED: u64 = 4;
pub const CANCELED: u64 = 5;
pub const ABORTED: u64 = 6;

/// How far to count.
#[interface]
#[derive(PartialEq)]
pub struct Order {
    pub order: i32,
}

/// Numbers so far.
#[interface]
#[derive(PartialEq)]
pub struct Numbers {
    pub sequence: Sequence<i32, 64>,
}

/// All numbers.
#[interface]
#[derive(PartialEq)]
pub struct Counted {
    pub sequence: Sequence<i32, 64>,
    pub success: Bool,
}

#[ports]
pub struct CounterIo {
    orders: Inbox<Order>,
    stops: Inbox<Order>,
    progress: Output<Numbers>,
    counted: Output<Counted>,
}

/// Counts, a number in each step. It refuses negative orders, fails above 40, and does not stop before it has three numbers.
pub struct Counter;

#[module(stage = Act)]
impl Module for Counter {
    type Io = CounterIo;
    type Params = ();
    type State = (Vec<i32>, usize);

    fn tick((numbers, order): &mut Self::State, io: &CounterIo, _: &(), _: &Tick) -> Outcome {
        for request in io.orders.iter() {
            match usize::try_from(request.order) {
                Ok(wanted) => (*numbers, *order) = (vec![0, 1], wanted),
                Err(_) => request.refuse(3),
            }
        }
        let end = |numbers: &mut Vec<i32>, success: bool| {
            io.counted.set(Counted { sequence: Sequence::new(numbers), success: success.into() });
            numbers.clear();
        };
        for request in io.stops.iter() {
            if numbers.len() < 3 { request.refuse(4) } else { end(numbers, false) }
        }
        if *order > 40 && !numbers.is_empty() {
            end(numbers, false);
        }
        if let [.., one, other] = numbers[..] {
            numbers.push(one + other);
            io.progress.set(Numbers { sequence: Sequence::new(numbers) });
            if numbers.len() > *order {
                end(numbers, true);
            }
        }
        Outcome::Ok
    }
}

#[ports]
pub struct SeekerIo {
    wish: Input<Order>,
    enough: Input<Order>,
    progress: Input<Numbers>,
    counted: Input<Counted>,
    orders: Outbox<Order>,
    stops: Outbox<Order>,
    delivery: Output<Number>,
    heard: Output<Number>,
    sum: Output<Number>,
}

/// Sends goals of counting, and adds up the results; a failure counts a thousand.
pub struct Seeker;

#[module(stage = Act)]
impl Module for Seeker {
    type Io = SeekerIo;
    type Params = ();
    type State = (u64, f64, f64);

    fn tick(state: &mut (u64, f64, f64), io: &SeekerIo, _: &(), _: &Tick) -> Outcome {
        if let Some(wish) = io.wish.updated() {
            state.0 = io.orders.send_tracked(*wish).unwrap_or(0);
        }
        if let Some(enough) = io.enough.updated() {
            io.stops.send_tracked(*enough);
        }
        state.1 += if io.progress.updated().is_some() { 1.0 } else { 0.0 };
        if let Some(counted) = io.counted.updated() {
            state.2 += if counted.success.get() { 1.0 } else { 1000.0 };
            state.2 += counted.sequence.iter().map(|number| f64::from(*number)).sum::<f64>();
        }
        // How messages fare is not recorded.
        if io.wish.get().is_some_and(|wish| wish.order < 1000) {
            io.delivery.set(Number { value: io.orders.delivery(state.0).code().into() });
        }
        io.heard.set(Number { value: state.1 });
        io.sum.set(Number { value: state.2 });
        Outcome::Ok
    }
}

fn definition() -> String {
    let environment = python().parent().and_then(Path::parent).unwrap().to_owned();
    environment.join("share/test_msgs/action/Fibonacci.action").display().to_string()
}

pub fn text(ros2: &str) -> String {
    format!(
        "agent.name = \"house\"\nloop.period = \"10ms\"\n[modules.counter]\n[modules.seeker]\n[ros2]\n{ros2}\n"
    )
}

pub fn served(domain: u16) -> String {
    format!(
        "domain = {domain}\n[ros2.serve.\"/count\"]\nto = \"counter/orders\"\ntype = \"{FIBONACCI}\"\n\
         definition = \"{}\"\nfeedback = \"counter/progress\"\nresult = \"counter/counted\"\n\
         cancel = {{ to = \"counter/stops\", value = {{ order = 0 }} }}",
        definition()
    )
}

pub fn called(domain: u16) -> String {
    format!(
        "domain = {domain}\n[ros2.call.\"/count\"]\nfrom = \"seeker/orders\"\ntype = \"{FIBONACCI}\"\n\
         definition = \"{}\"\nfeedback = \"seeker/progress\"\nresult = \"seeker/counted\"\ncancel = \"seeker/stops\"\n\
         timeout = \"20s\"",
        definition()
    )
}

fn send(peer: &mut Peer, order: i32) -> Json {
    peer.request(
        json!({ "do": "send_goal", "action": "/count", "type": FIBONACCI, "goal": { "order": order } }),
    )
}

#[test]
fn an_inbox_is_an_action_with_feedback_result_and_cancel() {
    alone("ros2::rclpy::actions::an_inbox_is_an_action_with_feedback_result_and_cancel", |domain| {
        let _agent = Running::of(&text(&served(domain)));
        let mut peer = Peer::start("person", domain);
        let first = send(&mut peer, 9);
        let ended = peer.request(json!({ "do": "goal_result", "number": first }));
        assert_eq!(ended[0], SUCCEEDED);
        assert_eq!(ended[1]["sequence"], json!([0, 1, 1, 2, 3, 5, 8, 13, 21, 34]));
        let feedback = ended[2].as_array().unwrap();
        let prefixes = feedback.iter().all(|own| {
            let (own, all) = (own["sequence"].as_array().unwrap(), ended[1]["sequence"].as_array().unwrap());
            all.starts_with(own)
        });
        assert!((1..=8).contains(&feedback.len()) && prefixes, "{feedback:?}");
        // Refused by the module.
        assert_eq!(send(&mut peer, -1), Json::Null);
        // Ended without success.
        let failed = send(&mut peer, 41);
        assert_eq!(peer.request(json!({ "do": "goal_result", "number": failed }))[0], ABORTED);
    });
}

#[test]
fn a_goal_is_cancelled_when_the_module_agrees() {
    alone("ros2::rclpy::actions::a_goal_is_cancelled_when_the_module_agrees", |domain| {
        let text = text(&served(domain)).replace("10ms", "100ms");
        let agent = Running::of(&text);
        let mut peer = Peer::start("person", domain);
        let long = send(&mut peer, 40);
        // One goal at a time.
        assert_eq!(send(&mut peer, 3), Json::Null);
        eventually("three numbers", || agent.number("counter/progress/sequence/2") == 1.0);
        assert_eq!(peer.request(json!({ "do": "cancel_goal", "number": long })), json!([0, 1]));
        let ended = peer.request(json!({ "do": "goal_result", "number": long }));
        assert_eq!(ended[0], CANCELED);
        assert!((3..40).contains(&ended[1]["sequence"].as_array().unwrap().len()), "{ended}");
        // It has ended already.
        assert_eq!(peer.request(json!({ "do": "cancel_goal", "number": long })), json!([3, 0]));
    });
}

/// The outcome of a message that was refused with a code.
pub fn refused(code: u64) -> f64 {
    (0x1_0000 + code) as f64
}

pub fn set(agent: &Running, input: &str, order: i64) {
    let (input, _) = agent.composer.board().get(input).unwrap();
    input.set("order", &Value::Integer(order.into()), agent.composer.now()).unwrap();
}

#[test]
fn an_outbox_calls_an_action_of_a_node() {
    alone("ros2::rclpy::actions::an_outbox_calls_an_action_of_a_node", |domain| {
        let agent = Running::of(&text(&called(domain)));
        let mut peer = Peer::start("counter", domain);
        peer.request(json!({ "do": "offer_fibonacci", "action": "/count", "type": FIBONACCI }));
        set(&agent, "seeker/wish", 6);
        eventually("the result", || agent.number("seeker/sum/value") == 1.0 + 20.0);
        eventually("done", || agent.number("seeker/delivery/value") == 1.0);
        assert!(agent.number("seeker/heard/value") >= 1.0);
        // Rejected, without a result.
        set(&agent, "seeker/wish", -1);
        eventually("a refusal", || agent.number("seeker/delivery/value") == refused(1));
        assert_eq!(agent.number("seeker/sum/value"), 21.0);
        // Cancelled by the agent, with the numbers so far.
        let heard = agent.number("seeker/heard/value");
        set(&agent, "seeker/wish", 40);
        eventually("feedback", || agent.number("seeker/heard/value") > heard);
        set(&agent, "seeker/enough", 1);
        eventually("a result", || agent.number("seeker/sum/value") > 1021.0);
        eventually("the refusal", || agent.number("seeker/delivery/value") == refused(CANCELED));
        set(&agent, "seeker/wish", 41);
        eventually("a failure", || agent.number("seeker/delivery/value") == refused(ABORTED));
    });
}

#[test]
fn a_goal_without_a_server_is_lost() {
    alone("ros2::rclpy::actions::a_goal_without_a_server_is_lost", |domain| {
        let agent = Running::of(&text(&called(domain).replace("20s", "300ms")));
        set(&agent, "seeker/wish", 6);
        eventually("a line", || agent.has_logged("a goal of /seeker/orders is lost: /count has no server"));
        let mut peer = Peer::start("counter", domain);
        peer.request(json!({ "do": "offer_fibonacci", "action": "/count", "type": FIBONACCI }));
        eventually("an action that is found", || {
            set(&agent, "seeker/wish", 200);
            agent.number("seeker/sum/value") >= 1000.0
        });
        set(&agent, "seeker/wish", 40);
        let heard = agent.number("seeker/heard/value");
        eventually("feedback", || agent.number("seeker/heard/value") > heard + 1.0);
        drop(peer);
        eventually("a line", || agent.has_logged("the server of /count has ended before its goal"));
    });
}

fn wish(composer: &Composer, order: i32) {
    let content = ExternalContent::Bytes(order.to_ne_bytes().to_vec());
    let value = ExternalValue { input: "seeker/wish".into(), content };
    assert!(composer.set_external(vec![value])[0].is_ok());
}

#[test]
fn goals_feedback_and_results_come_again_without_ros() {
    alone("ros2::rclpy::actions::goals_feedback_and_results_come_again_without_ros", |domain| {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2-actions.mcap");
        let text = text(&format!(
            "{}\n{}",
            served(domain),
            called(domain).replace("\"/count\"", "\"/others\"").replace(&format!("domain = {domain}\n"), "")
        ));
        record::<RosBridge>(&path, (&database(&text), &plugins()), &["seeker/wish"], |_, composer| {
            let mut peer = Peer::start("person", domain);
            peer.request(json!({ "do": "offer_fibonacci", "action": "/others", "type": FIBONACCI }));
            for round in 0..4 {
                let goal = send(&mut peer, 5 + round);
                // More than 40 fails, and more than 1000 leaves the delivery out, which is not recorded.
                wish(composer, 1001 + round);
                assert_eq!(peer.request(json!({ "do": "goal_result", "number": goal }))[0], SUCCEEDED);
                let sum =
                    || composer.board().read("seeker/sum/value").unwrap().and_then(|(own, _)| own.as_f64());
                eventually("a result", || sum() == Some(1000.0 * f64::from(round + 1)));
            }
        });
        assert_repeated(&path, &plugins(), 60);
    });
}

#[test]
fn actions_that_do_not_fit_are_refused() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2-wrong-actions");
    std::fs::create_dir_all(&folder).unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let good = file("Good.action", "int32 order\n---\nint32[] sequence\n---\nint32[] sequence\n");
    let short = file("Short.action", "int32 order\n---\nint32[] sequence\n");
    let texts = file("Texts.action", "string order\n---\nint32[] sequence\n---\n");
    let other = file("Other.action", "int32 order\n---\nbool done\nbool failed\n---\n");
    let serve = |rest: &str, file: &str| {
        format!(
            "serve.\"/count\" = {{ to = \"counter/orders\", type = \"own/action/Count\", definition = {file:?}, {rest} }}"
        )
    };
    let result = "result = \"counter/counted\"";
    let settings = [
        (serve("feedback = \"counter/progress\"", &good), "an entry lacks `result`"),
        (serve(result, &short), "own/action/Count has 2 parts, expected goal, result and feedback"),
        (serve(&format!("{result}, response = \"a/b\""), &good), "response"),
        ("serve.\"/count\" = { to = \"counter/orders\", type = \"own/action/Count\", result = \"counter/counted\" }".into(), "an entry of an action lacks `definition`"),
        ("call.\"/count\" = { from = \"seeker/orders\", type = \"own/action/Count\", definition = \"int32 order\\n---\\n---\", cancel = \"seeker/orders\" }".into(), "/seeker/orders calls two services or actions"),
    ];
    for (table, words) in settings {
        let database = database(&text(&table));
        let report = RosSettings::of(&database.current()).unwrap_err();
        let found = report.diagnostics().iter().find(|own| own.message().contains(words));
        assert!(found.unwrap_or_else(|| panic!("{table}: {report}")).help_text().is_some());
    }
    let ports = [
        (serve(result, &texts), "/counter/orders and /count: ", "take a type with fields"),
        (
            serve(result, &other),
            "/counter/counted and /count: no field of it is one of own/action/Count_Result",
            "output",
        ),
        (serve("result = \"counter/nothing\"", &good), "/counter/nothing and /count: ", "slate list"),
        (
            serve(&format!("{result}, cancel = \"counter/stops\""), &good),
            "/counter/stops and /count: ",
            "value",
        ),
    ];
    for (table, words, help) in ports {
        let agent = Running::load_text(&text(&table));
        let settings = RosSettings::of(&agent.configuration).unwrap().unwrap();
        let error = check_topics(&agent.composer, &settings).unwrap_err();
        assert!(
            error.to_string().contains(words) && error.help().contains(help),
            "{error}: {}",
            error.help()
        );
    }
}
