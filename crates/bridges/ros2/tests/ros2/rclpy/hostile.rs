//! Malicious packets.
#![allow(clippy::disallowed_methods, reason = "packets go by the machine's clock")]

use serde_json::json;
use slate_test_tools::{HostileSender, PacketCapture, resident_memory, values_alone};

use crate::ros2::rclpy::agent::{Running, alone, eventually};
use crate::ros2::rclpy::peer::Peer;

/// Ports of the only participant in a domain: discovery and topics, for all and for itself.
fn ports(domain: u16) -> [u16; 4] {
    [0, 1, 10, 11].map(|port| 7400 + 250 * domain + port)
}

/// A node that has an agent's topics both ways.
fn connected(name: &str, domain: u16, agent: &Running) -> Peer {
    let mut peer = Peer::start(name, domain);
    peer.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
    peer.subscribe("/odom", "nav_msgs/msg/Odometry", json!({}));
    exchange(&mut peer, agent);
    peer
}

fn exchange(peer: &mut Peer, agent: &Running) {
    let before = agent.number("driver/command/linear");
    let speed = if before == 0.75 { 0.25 } else { 0.75 };
    eventually("a command", || {
        peer.publish("/cmd_vel", &json!({ "linear": { "x": speed } }));
        agent.number("driver/command/linear") == speed
    });
    peer.take("/odom");
    eventually("odometry", || !peer.take("/odom").is_empty());
}

#[test]
fn mutated_packets_end_neither_the_agent_nor_its_connections() {
    alone("ros2::rclpy::hostile::mutated_packets_end_neither_the_agent_nor_its_connections", |domain| {
        let table = format!(
            "domain = {domain}\nread.\"driver/command\" = \"/cmd_vel\"\nwrite.\"/odom\" = \"sensor/odometry\""
        );
        let ports = ports(domain);
        let capture = PacketCapture::start();
        let agent = Running::start("stoic", &table);
        drop(connected("model", domain, &agent));
        let packets = capture.end(&ports);
        let packets: Vec<_> = packets.iter().filter_map(|packet| values_alone(packet)).collect();
        assert!(packets.len() >= 10, "{}", packets.len());
        let before = resident_memory();
        let mut sender = HostileSender::new(packets);
        sender.send(&ports, 10_000);
        let mut peer = connected("steady", domain, &agent);
        sender.send(&ports[2..], 10_000);
        let grown = resident_memory().saturating_sub(before);
        assert!(grown < 256 << 20, "{grown} bytes more");
        exchange(&mut peer, &agent);
        // And one that starts afterwards.
        connected("late", domain, &agent);
    });
}
