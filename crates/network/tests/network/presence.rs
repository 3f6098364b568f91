//! Sessions: presence, refused settings, and lost connections.

use slate_network::{AgentNetwork, NetworkSettings, alive_key};
use zenoh::Wait;
use zenoh::sample::SampleKind;

use crate::network::agent::{Running, ask_json, eventually, ports, session, wait_for_agent};

fn failure(name: &str, table: &str) -> String {
    let agent = Running::load(name, table);
    let settings = NetworkSettings::of(&agent.configuration).unwrap().unwrap();
    let error = AgentNetwork::start(&agent.surface, &settings).unwrap_err();
    let report = error.report(&agent.configuration);
    let first = &report.diagnostics()[0];
    format!("{} ({})", first.placed(), first.help_text().unwrap())
}

#[test]
fn presence_is_liveliness() {
    let [port] = ports();
    let watcher = session("peer", &[port], &[]);
    let tokens = watcher.liveliness().declare_subscriber(alive_key("*")).history(true).wait().unwrap();
    let agent = Running::start("alive", &format!("connect = [\"tcp/127.0.0.1:{port}\"]"));
    let sample = tokens.recv().unwrap();
    assert_eq!((sample.key_expr().as_str(), sample.kind()), ("slate/alive/@alive", SampleKind::Put));
    drop(agent);
    let sample = tokens.recv().unwrap();
    assert_eq!((sample.key_expr().as_str(), sample.kind()), ("slate/alive/@alive", SampleKind::Delete));
}

#[test]
fn used_port_and_missing_router_are_reported_with_line() {
    let [port, free] = ports();
    let taken = std::net::TcpListener::bind(("127.0.0.1", port)).unwrap();
    let text = failure("port", &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    assert!(text.starts_with("test.toml:12:"), "{text}");
    assert!(
        text.contains(&format!("`tcp/127.0.0.1:{port}` can't be listened at")) && text.contains("in use"),
        "{text}"
    );
    drop(taken);
    let text = failure("router", &format!("mode = \"client\"\nconnect = [\"tcp/127.0.0.1:{free}\"]"));
    assert!(text.starts_with("test.toml:13:"), "{text}");
    assert!(
        text.contains("no router is reached")
            && text.contains("refused")
            && text.contains("start the router first"),
        "{text}"
    );
}

#[test]
fn agents_reach_each_other_through_a_router() {
    let [port] = ports();
    let router = session("router", &[port], &[]);
    let table = format!("mode = \"client\"\nconnect = [\"tcp/127.0.0.1:{port}\"]");
    let base = Running::start("routed", &table);
    let arm = Running::start(
        "routed-arm",
        &format!("{table}\nread.\"driver/ambient\" = \"slate://routed/sensor/count\""),
    );
    eventually("values", || arm.number("driver/seen/value") > 5.0);
    // The router is a program of Zenoh as any other.
    assert_eq!(ask_json(&router, "slate/routed/sensor/pose/x", None), Ok(1.5.into()));
    drop(base);
}

#[test]
fn agents_reach_each_other_over_udp() {
    let port = std::net::UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let _base = Running::start("datagram", &format!("listen = [\"udp/127.0.0.1:{port}\"]"));
    let read = "read.\"driver/ambient\" = \"slate://datagram/sensor/count\"";
    let arm = Running::start("datagram-arm", &format!("connect = [\"udp/127.0.0.1:{port}\"]\n{read}"));
    eventually("values", || arm.number("driver/seen/value") > 5.0);
}

#[test]
fn an_agent_is_a_router_for_others() {
    let [port] = ports();
    let _hub = Running::start("hub", &format!("mode = \"router\"\nlisten = [\"tcp/127.0.0.1:{port}\"]"));
    let table = format!("mode = \"client\"\nconnect = [\"tcp/127.0.0.1:{port}\"]");
    let _leaf = Running::start("leaf", &table);
    let other = session("client", &[], &[port]);
    wait_for_agent(&other, "leaf");
    assert_eq!(ask_json(&other, "slate/leaf/sensor/pose/x", None), Ok(1.5.into()));
}

#[test]
fn a_connection_that_ends_is_made_again() {
    let [port] = ports();
    let table = format!("mode = \"client\"\nconnect = [\"tcp/127.0.0.1:{port}\"]");
    let mut router = session("router", &[port], &[]);
    let base = Running::start("again", &table);
    let arm = Running::start(
        "again-arm",
        &format!("{table}\nread.\"driver/ambient\" = \"slate://again/sensor/count\""),
    );
    eventually("values", || arm.number("driver/seen/value") > 5.0);
    router.close().wait().unwrap();
    eventually("the absence", || arm.network().agents() == ["again-arm"]);
    // The last value may be on its way through the cycle.
    std::thread::sleep(std::time::Duration::from_millis(100));
    let kept = arm.number("driver/seen/value");
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert_eq!(arm.number("driver/seen/value"), kept);
    router = session("router", &[port], &[]);
    eventually("values", || arm.number("driver/seen/value") > kept + 20.0);
    assert_eq!(arm.network().agents(), ["again", "again-arm"]);
    // The agent did not notice.
    assert!(base.number("sensor/count/value") > kept);
    drop(router);
}

#[test]
fn second_agent_of_same_name_is_reported() {
    let [port] = ports();
    let first = Running::start("twin", &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    let second = Running::start("twin", &format!("connect = [\"tcp/127.0.0.1:{port}\"]"));
    eventually("the warning", || second.has_logged("another agent is called `twin`"));
    eventually("the warning", || first.has_logged("another agent is called `twin`"));
    let [port] = ports();
    let alone = Running::start("single", &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    let other = session("peer", &[], &[port]);
    assert_eq!(ask_json(&other, &alive_key("single"), None), Ok(serde_json::json!({ "agent": "single" })));
    std::thread::sleep(std::time::Duration::from_millis(500));
    assert!(!alone.has_logged("another agent"));
}
