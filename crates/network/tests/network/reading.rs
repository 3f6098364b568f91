//! Reading of other agents.

use slate_blackboard::interface::Interface;
use slate_interfaces::Pose2;
use slate_network::{AgentNetwork, InputSource, NetworkError, NetworkSettings, encoding};
use zenoh::Wait;
use zenoh::bytes::Encoding;

use crate::network::agent::{Running, eventually, ports, session, wait_for_agent};

#[test]
fn an_input_reads_any_program_by_its_type() {
    let [port] = ports();
    let agent = Running::start(
        "thermo",
        &format!(
            "listen = [\"tcp/127.0.0.1:{port}\"]\nread.\"driver/ambient\" = \"zenoh:demo/temperature\"\nread.\"driver/goal/x\" = \"zenoh:demo/x\""
        ),
    );
    let other = session("peer", &[], &[port]);
    let temperature = other.declare_publisher("demo/temperature").wait().unwrap();
    eventually("a reader", || temperature.matching_status().wait().unwrap().matching());
    temperature.put("21.5").encoding(Encoding::TEXT_PLAIN).wait().unwrap();
    eventually("text", || agent.number("driver/seen/value") == 21.5);
    temperature.put("22.5").encoding(Encoding::ZENOH_STRING).wait().unwrap();
    eventually("text", || agent.number("driver/seen/value") == 22.5);
    temperature.put("{\"value\": 23.5}").encoding(Encoding::APPLICATION_JSON).wait().unwrap();
    eventually("JSON", || agent.number("driver/seen/value") == 23.5);
    let cdr = [&[0, 1, 0, 0][..], &24.5_f64.to_le_bytes()].concat();
    temperature.put(&cdr).encoding(Encoding::APPLICATION_CDR).wait().unwrap();
    eventually("CDR", || agent.number("driver/seen/value") == 24.5);
    other.put("demo/x", "0.25").wait().unwrap();
    eventually("a field", || agent.number("driver/seen/value") == 24.75);
    // A mismatch is reported once, changes nothing, and the rest continues.
    for _ in 0..3 {
        temperature.put(&cdr).encoding(encoding(Pose2::DESCRIPTOR)).wait().unwrap();
    }
    eventually("a refusal", || agent.network().readings()[0].refused == 3);
    let status = agent.network().readings().remove(0);
    assert_eq!((status.input.as_str(), status.received), ("driver/ambient", 4));
    let error = status.error.unwrap();
    assert!(error.contains("it is slate_msgs/msg/Pose2, expected slate_msgs/msg/Speed"), "{error}");
    let told = agent
        .log
        .lines()
        .iter()
        .filter(|line| line.to_string().contains("does not fit /driver/ambient"))
        .count();
    assert_eq!(told, 1);
    temperature.put("hot").encoding(Encoding::TEXT_PLAIN).wait().unwrap();
    eventually("a refusal", || agent.network().readings()[0].refused == 4);
    assert_eq!(agent.number("driver/ambient/value"), 24.5);
    temperature.put("25").encoding(Encoding::TEXT_PLAIN).wait().unwrap();
    eventually("the next value", || agent.number("driver/seen/value") == 25.25);
    assert_eq!(agent.network().readings()[0].error, None);
}

fn pair(first: &str, second: &str) -> (String, String) {
    let [port] = ports();
    let server = format!("listen = [\"tcp/127.0.0.1:{port}\"]");
    let source = format!("slate://{first}/sensor/count");
    let reader = format!("connect = [\"tcp/127.0.0.1:{port}\"]\nread.\"driver/ambient\" = \"{source}\"");
    assert!(InputSource::parse(&source).is_ok() && first != second);
    (server, reader)
}

#[test]
fn an_agent_reads_another_whichever_starts_first() {
    for (name, reader_first) in [("a", true), ("b", false)] {
        let (base, arm) = (format!("base-{name}"), format!("arm-{name}"));
        let (server, reader) = pair(&base, &arm);
        let mut agents = [Running::load(&base, &server), Running::load(&arm, &reader)];
        if reader_first {
            agents.reverse();
        }
        for agent in &mut agents {
            agent.connect().unwrap();
        }
        if reader_first {
            agents.reverse();
        }
        let [base, arm] = &agents;
        eventually("values", || arm.number("driver/seen/value") > 5.0);
        assert!(arm.number("driver/seen/value") <= base.number("sensor/count/value"));
        assert_eq!(
            arm.network().agents(),
            ["arm-a", "base-a"].map(|agent| agent.replace("-a", &format!("-{name}")))
        );
    }
}

#[test]
fn a_value_that_is_not_written_again_comes_to_a_late_reader() {
    let [port] = ports();
    let base = Running::start("still", &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    eventually("a value", || base.number("sensor/count/value") > 10.0);
    base.surface.agent.composer().enable("sensor", false).unwrap();
    std::thread::sleep(std::time::Duration::from_millis(100));
    let last = base.number("sensor/count/value");
    let late = Running::start(
        "late",
        &format!(
            "connect = [\"tcp/127.0.0.1:{port}\"]\nread.\"driver/ambient\" = \"slate://still/sensor/count\""
        ),
    );
    eventually("the newest value", || late.number("driver/seen/value") == last);
}

#[test]
fn an_agent_that_restarts_is_read_again_from_its_first_value() {
    let (server, reader) = pair("phoenix", "watcher");
    let watcher = Running::start("watcher", &reader);
    let mut base = Running::start("phoenix", &server);
    eventually("values", || watcher.number("driver/seen/value") > 50.0);
    drop(base);
    eventually("its absence", || watcher.network().agents() == ["watcher"]);
    assert!(watcher.has_logged("agent `phoenix` has left the network"));
    let kept = watcher.number("driver/seen/value");
    base = Running::start("phoenix", &server);
    eventually("values that begin anew", || {
        let seen = watcher.number("driver/seen/value");
        seen != kept && seen <= base.number("sensor/count/value")
    });
    assert_eq!(watcher.network().readings()[0].refused, 0);
}

#[test]
fn unreadable_input_is_reported_before_opening() {
    let cases = [
        ("driver/gaol", "driver/goal"),
        ("driver/linked", "it is linked, from /sensor/count"),
        ("sensor/params", "it is not an input"),
        ("sensor/count", "it is not an input"),
        ("driver/notes/value", "an inbox takes whole messages"),
    ];
    for (input, reason) in cases {
        let [port] = ports();
        let table = format!("listen = [\"tcp/127.0.0.1:{port}\"]\nread.\"{input}\" = \"zenoh:a\"");
        let agent = Running::load(&format!("wrong-{}", input.replace('/', "-")), &table);
        let settings = NetworkSettings::of(&agent.configuration).unwrap().unwrap();
        let error = AgentNetwork::start(&agent.surface, &settings).unwrap_err();
        assert!(
            matches!(&error, NetworkError::Input { .. }) && error.to_string().contains(reason),
            "{error}"
        );
        let report = error.report(&agent.configuration);
        let place = report.diagnostics()[0].placed();
        assert!(place.starts_with("test.toml:13:"), "{place}");
    }
}

#[test]
fn an_inbox_takes_each_value_of_a_key_as_a_message() {
    let [port] = ports();
    let agent = Running::start(
        "hearing",
        &format!("listen = [\"tcp/127.0.0.1:{port}\"]\nread.\"driver/notes\" = \"zenoh:demo/notes\""),
    );
    let other = session("peer", &[], &[port]);
    wait_for_agent(&other, "hearing");
    let publisher = other.declare_publisher("demo/notes").wait().unwrap();
    eventually("the subscriber", || publisher.matching_status().wait().unwrap().matching());
    for note in ["1", "2", "{\"value\": 4}", "-1", "8", "many", "16"] {
        publisher.put(note).wait().unwrap();
    }
    let status = || agent.network().readings().remove(0);
    eventually("the messages", || status().received == 5);
    eventually("their sum", || agent.number("driver/heard/value") == 31.0);
    // One that the module refuses, and one that is no message.
    assert_eq!((status().refused, status().lost), (2, 0));
    assert!(agent.has_logged("/driver/notes refuses the message"), "{:?}", agent.log.lines());
}
