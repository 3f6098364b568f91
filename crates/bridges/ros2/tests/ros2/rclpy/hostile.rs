//! Packets that nobody sends by mistake.
#![allow(clippy::disallowed_methods, reason = "packets go by the machine's clock")]

use std::net::UdpSocket;
use std::time::Duration;

use serde_json::json;

use crate::ros2::rclpy::agent::{Running, alone, eventually};
use crate::ros2::rclpy::peer::Peer;

/// Port for discovery of a participant in a domain; the next one is for topics.
fn port(domain: u16, participant: u16) -> u16 {
    7400 + 250 * domain + 10 + 2 * participant
}

/// Real packets of discovery, which go to all ports that a participant could have.
fn packets(socket: &UdpSocket) -> Vec<Vec<u8>> {
    let mut packets = Vec::new();
    eventually("packets of discovery", || {
        let mut buffer = [0; 65_536];
        if let Ok(length) = socket.recv(&mut buffer) {
            packets.push(buffer[..length].to_vec());
        }
        packets.len() >= 3
    });
    packets
}

/// Resident memory of this program, bytes.
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/statm").unwrap();
    status.split(' ').nth(1).unwrap().parse::<u64>().unwrap() * 4096
}

#[test]
fn mutated_packets_end_neither_the_agent_nor_its_connections() {
    alone("ros2::rclpy::hostile::mutated_packets_end_neither_the_agent_nor_its_connections", |domain| {
        let table = format!(
            "domain = {domain}\nread.\"driver/command\" = \"/cmd_vel\"\nwrite.\"/odom\" = \"sensor/odometry\""
        );
        // Of a participant that there is not.
        let socket = UdpSocket::bind(("127.0.0.1", port(domain, 6))).unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
        let agent = Running::start("stoic", &table);
        let mut peer = Peer::start("steady", domain);
        peer.advertise("/cmd_vel", "geometry_msgs/msg/Twist", json!({}));
        eventually("a subscription", || peer.matched("/cmd_vel") == 1);
        let packets = packets(&socket);
        let before = memory();
        let mut state = 1_u64;
        let mut next = move |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below
        };
        for number in 0..20_000 {
            let mut packet = packets[next(packets.len())].clone();
            for _ in 0..1 + next(8) {
                // Behind the name of the protocol, without which it is no packet at all.
                let place = 4 + next(packet.len() - 4);
                packet[place] = next(256) as u8;
            }
            if next(4) == 0 {
                packet.truncate(4 + next(packet.len() - 4));
            }
            // Those of its discovery, and of its topics.
            let to = port(domain, 0) + (number % 2) as u16;
            socket.send_to(&packet, ("127.0.0.1", to)).unwrap();
            if number % 100 == 0 {
                std::thread::sleep(Duration::from_millis(5));
            }
        }
        let grown = memory().saturating_sub(before);
        assert!(grown < 256 << 20, "{grown} bytes more");
        eventually("a command", || {
            peer.publish("/cmd_vel", &json!({ "linear": { "x": 0.75 } }));
            agent.number("driver/command/linear") == 0.75
        });
        peer.subscribe("/odom", "nav_msgs/msg/Odometry", json!({}));
        eventually("odometry", || !peer.take("/odom").is_empty());
    });
}
