//! Packets that nobody sends by mistake.

use serde_json::json;
use slate_test_tools::{HostileSender, PacketCapture, resident_memory, values_alone};

use crate::dds::agent::{Running, eventually, start};
use crate::dds::cyclone::peer::{Peer, alone};

/// A program that has an agent's topics both ways.
fn connected(domain: u16, agent: &Running) -> Peer {
    let mut peer = Peer::cyclone(domain);
    peer.advertise("Number", "Count", json!({}));
    peer.subscribe("Sum", "Count", json!({}));
    exchange(&mut peer, agent);
    peer
}

fn exchange(peer: &mut Peer, agent: &Running) {
    let value = if agent.number("planner/number/value") == 2.0 { 1.0 } else { 2.0 };
    eventually("a number", || {
        peer.publish("Number", &json!({ "value": value }));
        agent.number("planner/number/value") == value
    });
    peer.take("Sum");
    eventually("a sum", || !peer.take("Sum").is_empty());
}

#[test]
fn mutated_packets_end_neither_a_participant_nor_its_matches() {
    alone("dds::cyclone::hostile::mutated_packets_end_neither_a_participant_nor_its_matches", |domain| {
        let of = "type = \"demo::Count\", idl = \"tests/dds/count.idl\"";
        // Discovery and topics, for all and for the first participant of the domain.
        let ports = [0, 1, 10, 11].map(|port| 7400 + 250 * domain + port);
        let capture = PacketCapture::start();
        let agent = start(&format!(
            "domain = {domain}\nread.\"planner/number\" = {{ topic = \"Number\", {of} }}\n\
             write.\"Sum\" = {{ from = \"planner/sum\", {of} }}"
        ));
        drop(connected(domain, &agent));
        let packets = capture.end(&ports);
        let packets: Vec<_> = packets.iter().filter_map(|packet| values_alone(packet)).collect();
        assert!(packets.len() >= 10, "{}", packets.len());
        let before = resident_memory();
        let mut sender = HostileSender::new(packets);
        sender.send(&ports, 10_000);
        let mut peer = connected(domain, &agent);
        sender.send(&ports[2..], 10_000);
        let grown = resident_memory().saturating_sub(before);
        assert!(grown < 256 << 20, "{grown} bytes more");
        exchange(&mut peer, &agent);
        // And one that starts afterwards.
        connected(domain, &agent);
    });
}
