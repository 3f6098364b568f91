//! Malicious packets.

use std::net::UdpSocket;
use std::time::Duration;

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

/// Announces so many participants of which nothing can be read.
#[allow(clippy::disallowed_methods, reason = "packets go by the machine's clock")]
fn announce_unreadable(port: u16, count: u32) {
    let socket = UdpSocket::bind(("127.0.0.1", 0)).unwrap();
    for number in 0..count {
        // DATA of the built-in writer and reader of participants, which has a list of no parameters.
        let mut packet =
            b"RTPS\x02\x03\x01\x12nobody here.\x15\x05\x1c\0\0\0\x10\0\0\x01\0\xc7\0\x01\0\xc2\0\0\0\0"
                .to_vec();
        packet.extend((2 * number + 1).to_le_bytes());
        packet.extend([0, 3, 0, 0, 1, 0, 0, 0]);
        socket.send_to(&packet, ("127.0.0.1", port)).unwrap();
        if number % 100 == 0 {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

#[test]
fn unreadable_announcements_hide_no_later_program() {
    alone("dds::cyclone::hostile::unreadable_announcements_hide_no_later_program", |domain| {
        let of = "type = \"demo::Count\", idl = \"tests/dds/count.idl\"";
        let read = format!("read.\"planner/number\" = {{ topic = \"Sum\", {of} }}");
        let agent = start(&format!("domain = {domain}\n{read}"));
        announce_unreadable(7410 + 250 * domain, 500);
        let later = start(&format!("domain = {domain}\nwrite.\"Sum\" = {{ from = \"planner/sum\", {of} }}"));
        eventually("a number", || agent.number("planner/number/value") == later.number("planner/sum/value"));
    });
}
