//! A node of ROS 1 of Debian, in Python, and its master: `cargo test -p slate-ros1 --features external-tools`.
#![allow(clippy::disallowed_methods, reason = "ROS goes by the machine's clock")]

use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value as Json, json};

use crate::ros1::agent::eventually;

/// A master, until this is dropped.
pub struct Master {
    child: Child,
    port: u16,
}

impl Master {
    pub fn start() -> Self {
        // Another program may take it before the master does; then the test fails with the master's words.
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let child = command("rosmaster", port).args(["--core", "-p", &port.to_string()]).spawn();
        let child = child.expect("apt-get install python3-rosmaster python3-rospy python3-sensor-msgs");
        let master = Self { child, port };
        eventually("the master", || TcpStream::connect(("127.0.0.1", port)).is_ok());
        master
    }

    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}", self.port)
    }

    pub fn peer(&self, name: &str) -> Peer {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros1/program.py");
        let mut command = command("/usr/bin/python3", self.port);
        let command = command.arg(script).arg(name).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let (input, output) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        let mut peer = Peer { child, input, output };
        assert_eq!(peer.tell(json!({ "do": "about" })), "rospy");
        peer
    }
}

impl Drop for Master {
    fn drop(&mut self) {
        end(&mut self.child);
    }
}

fn command(program: &str, port: u16) -> Command {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros1-logs");
    let mut command = Command::new(program);
    command
        .env("ROS_MASTER_URI", format!("http://127.0.0.1:{port}"))
        .env("ROS_IP", "127.0.0.1")
        .env("ROS_LOG_DIR", &folder)
        .env("ROS_HOME", &folder)
        .env("PYTHONDONTWRITEBYTECODE", "1");
    command
}

/// It may have ended.
fn end(child: &mut Child) {
    let _ = child.kill();
    let _ = child.wait();
}

/// A node that carries out commands, until this is dropped.
pub struct Peer {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Peer {
    /// Has it do something; returns what comes of it.
    pub fn tell(&mut self, command: Json) -> Json {
        writeln!(self.input, "{command}").unwrap();
        self.input.flush().unwrap();
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{command}: {error}: {line:?}"))
    }

    pub fn advertise(&mut self, topic: &str, message: &str) {
        self.tell(json!({ "do": "advertise", "topic": topic, "type": message }));
    }

    pub fn publish(&mut self, topic: &str, value: &Json) {
        self.tell(json!({ "do": "publish", "topic": topic, "value": value }));
    }

    pub fn subscribe(&mut self, topic: &str, message: &str) {
        self.tell(json!({ "do": "subscribe", "topic": topic, "type": message }));
    }

    /// What it has heard since it was asked last.
    pub fn take(&mut self, topic: &str) -> Vec<Json> {
        self.tell(json!({ "do": "take", "topic": topic })).as_array().unwrap().clone()
    }

    pub fn matched(&mut self, topic: &str) -> u64 {
        self.tell(json!({ "do": "matched", "topic": topic })).as_u64().unwrap()
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        end(&mut self.child);
    }
}
