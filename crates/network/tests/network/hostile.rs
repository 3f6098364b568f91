//! Bytes of others: whatever they send, the agent answers or refuses, and continues.

use std::time::Duration;

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, TestRunner};
use zenoh::Wait;

use crate::network::agent::{Running, eventually, ports, session, wait_for_agent};

/// Malicious query or publication.
#[derive(Debug)]
struct Attack {
    key: String,
    parameters: String,
    encoding: String,
    payload: Option<Vec<u8>>,
    attachment: Option<Vec<u8>>,
}

fn attack() -> impl Strategy<Value = Attack> {
    let paths = [
        "sensor/count",
        "sensor/params",
        "sensor/params/step",
        "sensor/enabled",
        "driver/goal",
        "driver/goal/x",
        "driver/notes",
        "driver/linked",
        "driver",
        "@tree",
        "@tree/arm",
        "@set/sensor/params/step",
        "@set/driver/goal",
        "@set/driver/notes",
        "@set/*/params",
        "@set/nothing",
        "@schema/Pose2",
        "@schema/*",
        "**",
        "*/params",
        "sensor/@alive",
        "x",
        "driver/goal/x/y/z",
    ];
    let encodings = [
        "",
        "application/cdr",
        "application/cdr;slate_msgs/msg/Pose2",
        "application/cdr;slate_msgs/msg/Speed",
        "application/json",
        "text/plain",
        "zenoh/bytes",
        "image/png",
        ";;;",
    ];
    let bytes = prop_oneof![
        proptest::collection::vec(any::<u8>(), 0..200),
        proptest::collection::vec(any::<u8>(), 0..64).prop_map(|bytes| [&[0, 1, 0, 0][..], &bytes].concat()),
        "[\\[{\"x:0-9.eE,\\]}-]{0,60}".prop_map(String::into_bytes),
        Just(vec![b'['; 5_000]),
        Just(b"1e999".to_vec()),
    ];
    (
        proptest::sample::select(paths.to_vec()),
        "[a-z=;%&|\\[\\]]{0,12}",
        proptest::sample::select(encodings.to_vec()),
        proptest::option::of(bytes),
        proptest::option::of(proptest::collection::vec(any::<u8>(), 0..60)),
    )
        .prop_map(|(path, parameters, encoding, payload, attachment)| Attack {
            key: format!("slate/target/{path}"),
            parameters,
            encoding: encoding.into(),
            payload,
            attachment,
        })
}

#[test]
fn any_query_gets_an_answer_and_harms_nothing() {
    let [port] = ports();
    let agent = Running::start("target", &format!("listen = [\"tcp/127.0.0.1:{port}\"]\nset = [\"**\"]"));
    let other = session("peer", &[], &[port]);
    wait_for_agent(&other, "target");
    let mut runner = TestRunner::new_with_rng(
        Config::default(),
        proptest::test_runner::TestRng::deterministic_rng(Default::default()),
    );
    let (mut answers, mut refusals) = (0, 0);
    for _ in 0..400 {
        let attack = attack().new_tree(&mut runner).unwrap().current();
        // The module stays on, as the test goes by its count.
        let attack =
            if attack.key.ends_with("/enabled") { Attack { payload: None, ..attack } } else { attack };
        let get = other.get(format!("{}?{}", attack.key, attack.parameters)).timeout(Duration::from_secs(10));
        let get = if let Some(payload) = &attack.payload {
            get.payload(payload).encoding(attack.encoding.as_str())
        } else {
            get
        };
        let get = if let Some(attachment) = &attack.attachment { get.attachment(attachment) } else { get };
        let replies: Vec<_> = get.wait().unwrap().iter().collect();
        let has_wildcards = attack.key.contains('*');
        assert!(!replies.is_empty() || has_wildcards || attack.key.contains("/@alive"), "{attack:?}");
        for reply in replies {
            match reply.result() {
                Ok(_) => answers += 1,
                Err(error) => {
                    let text = error.payload().try_to_string().unwrap_or_default().into_owned();
                    assert!(text.contains("\"status\":\"refused\""), "{attack:?}: {text}");
                    refusals += 1;
                }
            }
        }
    }
    assert!(answers > 50 && refusals > 50, "{answers} answers, {refusals} refusals");
    let count = agent.number("sensor/count/value");
    eventually("the next cycles", || agent.number("sensor/count/value") > count + 5.0);
}

#[test]
fn any_publication_sets_an_input_or_is_counted() {
    let [port] = ports();
    let agent = Running::start(
        "target",
        &format!(
            "listen = [\"tcp/127.0.0.1:{port}\"]\nread.\"driver/goal\" = \"zenoh:slate/target/driver/goal\""
        ),
    );
    let other = session("peer", &[], &[port]);
    let publisher = other.declare_publisher("slate/target/driver/goal").wait().unwrap();
    eventually("a reader", || publisher.matching_status().wait().unwrap().matching());
    let mut runner = TestRunner::new_with_rng(
        Config::default(),
        proptest::test_runner::TestRng::deterministic_rng(Default::default()),
    );
    let mut sent = 0;
    for _ in 0..400 {
        let attack = attack().new_tree(&mut runner).unwrap().current();
        let put = publisher.put(attack.payload.unwrap_or_default()).encoding(attack.encoding.as_str());
        let put = if let Some(attachment) = &attack.attachment { put.attachment(attachment) } else { put };
        put.wait().unwrap();
        sent += 1;
    }
    let counted = || {
        let status = agent.network().readings().remove(0);
        status.received + status.refused
    };
    // The agent publishes the input too, but does not read itself: a session may hear its own.
    eventually("all of them", || counted() >= sent);
    assert!(agent.network().readings()[0].refused > 100);
    let count = agent.number("sensor/count/value");
    eventually("the next cycles", || agent.number("sensor/count/value") > count + 5.0);
}
