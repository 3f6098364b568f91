//! Links to and from keys of Zenoh.
#![allow(clippy::disallowed_methods, reason = "the other program goes by the machine's clock")]

use std::time::{Duration, Instant};

use slate_blackboard::interface::Value;
use slate_network::{AgentNetwork, NetworkError, NetworkSettings, ReadingStatus, SampleAttachment};
use zenoh::Wait;

use crate::network::agent::{Running, eventually, ports, session};

fn start(name: &str, links: &str, port: u16) -> Running {
    let mut agent = Running::load_with(name, links, &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    agent.connect().unwrap();
    agent
}

#[test]
fn a_link_reads_a_key_and_another_carries_a_property_to_one() {
    let [port] = ports();
    let links = "\"driver/ambient\" = \"zenoh:demo/temperature\"\n\"driver/goal/x\" = \"zenoh:demo/x\"\n\
                 \"zenoh:demo/count\" = \"sensor/count\"";
    let agent = start("linked", links, port);
    let other = session("peer", &[], &[port]);
    let counts = other.declare_subscriber("demo/count").wait().unwrap();
    eventually("a value of the agent", || {
        let _ = other.put("demo/temperature", "21.5").wait();
        let _ = other.put("demo/x", "0.25").wait();
        agent.number("driver/seen/value") == 21.75
    });
    // Numbered values of the property, as at the key of the agent.
    let sample = counts.recv_timeout(Duration::from_secs(20)).unwrap().unwrap();
    let attachment = SampleAttachment::decode(&sample.attachment().unwrap().to_bytes()).unwrap();
    assert_eq!(sample.encoding().to_string(), "application/cdr;slate_msgs/msg/Speed");
    let value = f64::from_le_bytes(sample.payload().to_bytes()[4..].try_into().unwrap());
    assert_eq!(value, attachment.stamp.sequence as f64);
    // A late reader requests the newest one.
    let replies = other.get("demo/count").wait().unwrap();
    let reply = replies.recv_timeout(Duration::from_secs(20)).unwrap().unwrap();
    assert_eq!(reply.into_result().unwrap().payload().len(), 12);
    // A tool's value would be overwritten; the refusal names the writer.
    let refused = agent.surface.board().get("driver/ambient").unwrap().0.set("value", &Value::Float(1.0), 0);
    assert!(refused.unwrap_err().to_string().contains("zenoh:demo/temperature"));
    let composer = agent.surface.agent.composer();
    let external = composer.links().into_iter().filter(|link| link.external);
    assert!(external.map(|link| link.trouble).all(|trouble| trouble.is_none()));
}

#[test]
fn a_queue_reads_each_value_of_a_key() {
    let [port] = ports();
    let agent = start("queue", "\"driver/speeds\" = \"zenoh:demo/speeds\"", port);
    let other = session("peer", &[], &[port]);
    let speeds = other.declare_publisher("demo/speeds").wait().unwrap();
    eventually("a reader", || speeds.matching_status().wait().unwrap().matching());
    for number in 1..=100 {
        speeds.put(number.to_string()).wait().unwrap();
        std::thread::sleep(Duration::from_millis(2));
    }
    eventually("all values", || agent.number("driver/sum/value") == 5050.0);
}

#[test]
fn a_reader_of_a_key_has_a_rate_of_its_own() {
    let [port] = ports();
    let links = "\"driver/ambient\" = { from = \"zenoh:demo/fast\", rate = \"5Hz\" }";
    let agent = start("rated", links, port);
    let other = session("peer", &[], &[port]);
    let fast = other.declare_publisher("demo/fast").wait().unwrap();
    eventually("a reader", || fast.matching_status().wait().unwrap().matching());
    let began = Instant::now();
    for number in 1..=100 {
        fast.put(number.to_string()).wait().unwrap();
        std::thread::sleep(Duration::from_millis(10));
    }
    // The last one comes when its time has come.
    eventually("the last value", || agent.number("driver/ambient/value") == 100.0);
    let ReadingStatus { received, thinned, .. } = agent.network().readings().remove(0);
    let most = began.elapsed().as_millis() as u64 / 200 + 2;
    assert!((3..=most).contains(&received) && received + thinned == 100, "{received} {thinned}");
}

#[test]
fn an_unpublishable_property_is_refused_before_anything_opens() {
    for (from, reason) in [("sensor/cuont", "did you mean count?"), ("driver/notes", "receives messages")] {
        let [port] = ports();
        let text = format!("\"zenoh:demo/a\" = \"{from}\"");
        let network = format!("listen = [\"tcp/127.0.0.1:{port}\"]");
        let configuration = crate::network::agent::modules::configuration("wrong", &text, &network);
        let error = crate::network::agent::refused(&configuration);
        assert!(error.contains(reason) && error.contains("test.toml:"), "{error}");
    }
    let [port] = ports();
    let agent = Running::load("unpublished", &format!("listen = [\"tcp/127.0.0.1:{port}\"]"));
    let mut settings = NetworkSettings::of(&agent.configuration).unwrap().unwrap();
    let (key, property) = ("demo/a".into(), "driver/notes".into());
    settings.write.push(slate_network::NetworkOutput { key, property, place: None });
    let error = AgentNetwork::start(&agent.surface, &settings).unwrap_err();
    assert!(
        matches!(&error, NetworkError::Output { .. }) && error.to_string().contains("takes messages"),
        "{error}"
    );
}
