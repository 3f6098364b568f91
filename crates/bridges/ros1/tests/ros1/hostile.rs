//! Malicious bytes.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

use serde_json::json;

use crate::ros1::agent::{Running, eventually};
use crate::ros1::peer::Master;

/// Connections that are made to each port.
const COUNT: usize = 10_000;

/// The header of a subscriber.
fn header() -> Vec<u8> {
    let fields = ["callerid=/other", "topic=/odom", "md5sum=*", "type=*", "tcp_nodelay=1"];
    let body: Vec<u8> = fields
        .iter()
        .flat_map(|field| (field.len() as u32).to_le_bytes().into_iter().chain(field.bytes()))
        .collect();
    [&(body.len() as u32).to_le_bytes()[..], &body].concat()
}

/// A call of the node's API.
fn call() -> Vec<u8> {
    let body = "<?xml version=\"1.0\"?><methodCall><methodName>publisherUpdate</methodName><params>\
                <param><value><string>/master</string></value></param><param><value>/cmd_vel</value></param>\
                <param><value><array><data><value>http://127.0.0.1:9/</value></data></array></value></param>\
                </params></methodCall>";
    let length = body.len();
    format!("POST / HTTP/1.1\r\nHost: robot\r\nContent-Length: {length}\r\n\r\n{body}").into_bytes()
}

/// Resident memory of this program, bytes.
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/statm").unwrap();
    status.split(' ').nth(1).unwrap().parse::<u64>().unwrap() * 4096
}

#[test]
fn hostile_bytes_end_neither_the_agent_nor_its_topics() {
    let master = Master::start();
    let links = "\"base/command\" = \"ros1:/cmd_vel\"\n\"ros1:/odom\" = \"base/odometry\"";
    let agent = Running::start(&master.address(), links);
    let mut peer = master.peer("steady");
    peer.advertise("/cmd_vel", "geometry_msgs/Twist");
    eventually("a subscription", || peer.matched("/cmd_vel") == 1);
    let ports = peer.request(json!({ "do": "ports", "node": "/r2_d2", "topic": "/odom" }));
    let [api, topics] = [0, 1].map(|at| ports[at].as_u64().unwrap() as u16);
    // One that says nothing, and ones that want much memory, stay through all of it.
    let mut open: Vec<_> = [api, topics].map(|port| TcpStream::connect(("127.0.0.1", port)).unwrap()).into();
    for length in [u32::MAX, 1 << 31, 1 << 20] {
        let mut stream = TcpStream::connect(("127.0.0.1", topics)).unwrap();
        stream.write_all(&length.to_le_bytes()).unwrap();
        open.push(stream);
    }
    let before = memory();
    let mut state = 1_u64;
    let mut next = move |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for number in 0..2 * COUNT {
        let (port, mut bytes) = if number % 2 == 0 { (api, call()) } else { (topics, header()) };
        for _ in 0..1 + next(8) {
            let place = next(bytes.len());
            bytes[place] = next(256) as u8;
        }
        if next(4) == 0 {
            bytes.truncate(next(bytes.len()));
        }
        let Ok(mut stream) = TcpStream::connect(("127.0.0.1", port)) else { panic!("port {port} is closed") };
        // The node may close it at any time.
        let _ = stream.write_all(&bytes);
        let _ = stream.shutdown(Shutdown::Write);
        if next(16) == 0 {
            stream.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
            let _ = stream.read(&mut [0; 256]);
        }
    }
    // More than a call has ever had.
    let mut long = TcpStream::connect(("127.0.0.1", api)).unwrap();
    let _ = long.write_all(b"POST / HTTP/1.1\r\nContent-Length: 1000000000\r\n\r\n");
    let _ = (0..256).try_for_each(|_| long.write_all(&[b' '; 1 << 20]));
    let grown = memory().saturating_sub(before);
    assert!(grown < 128 << 20, "{grown} bytes more");
    eventually("a command", || {
        peer.publish("/cmd_vel", &json!({ "linear": { "x": 0.75 } }));
        agent.number("base/command/linear") == 0.75
    });
    peer.subscribe("/odom", "nav_msgs/Odometry");
    eventually("odometry", || !peer.take("/odom").is_empty());
    drop(open);
}
