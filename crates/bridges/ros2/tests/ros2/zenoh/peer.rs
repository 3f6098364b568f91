//! A router of Zenoh and a node of ROS 2 on it, in Python: `cargo test -p slate-ros2 --features external-tools`.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value as Json, json};
use slate_test_tools::zenoh_ros2_python;

use crate::ros2::rclpy::type_hashes::packages;

/// A port that is free.
pub fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// A program that runs until this is dropped.
struct Program {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Program {
    fn start(arguments: &[&str]) -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros2/zenoh/program.py");
        let mut command = Command::new(zenoh_ros2_python(Path::new(env!("CARGO_TARGET_TMPDIR"))));
        command.arg(script).args(arguments);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (input, output) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        let mut program = Self { child, input, output };
        assert_eq!(program.line().trim(), "listening");
        program
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        line
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A router.
pub struct Router {
    pub port: u16,
    _program: Program,
}

impl Router {
    pub fn start() -> Self {
        Self::at(free_port())
    }

    pub fn at(port: u16) -> Self {
        Self { port, _program: Program::start(&["router", &port.to_string()]) }
    }

    /// Lines of `[ros2]` for an agent of a domain.
    pub fn table(&self, domain: u16) -> String {
        format!("wire = \"zenoh\"\nrouter = \"tcp/127.0.0.1:{}\"\ndomain = {domain}\n", self.port)
    }
}

/// A node that carries out commands.
pub struct Node(Program);

impl Node {
    pub fn start(router: &Router, domain: u16) -> Self {
        let packages = packages();
        let (port, domain) = (router.port.to_string(), domain.to_string());
        Self(Program::start(&["node", &port, &domain, packages.to_str().unwrap()]))
    }

    /// Has it do something; returns what comes of it.
    pub fn request(&mut self, command: Json) -> Json {
        writeln!(self.0.input, "{command}").unwrap();
        self.0.input.flush().unwrap();
        let line = self.0.line();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{command}: {error}: {line:?}"))
    }

    pub fn advertise(&mut self, topic: &str, message: &str, qos: Json) {
        self.request(json!({ "do": "advertise", "topic": topic, "type": message, "qos": qos }));
    }

    pub fn publish(&mut self, topic: &str, value: &Json) {
        self.request(json!({ "do": "publish", "topic": topic, "value": value }));
    }

    pub fn subscribe(&mut self, topic: &str, message: &str, qos: Json) {
        self.request(json!({ "do": "subscribe", "topic": topic, "type": message, "qos": qos }));
    }

    /// Messages received since the last call.
    pub fn take(&mut self, topic: &str) -> Vec<Json> {
        self.list("take", topic)
    }

    pub fn list(&mut self, verb: &str, topic: &str) -> Vec<Json> {
        self.request(json!({ "do": verb, "topic": topic })).as_array().unwrap().clone()
    }

    pub fn tokens(&mut self) -> Vec<String> {
        let tokens = self.request(json!({ "do": "tokens" }));
        tokens.as_array().unwrap().iter().map(|token| token.as_str().unwrap().to_owned()).collect()
    }
}
