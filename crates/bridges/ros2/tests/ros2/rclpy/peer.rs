//! A node of ROS 2, in Python: `cargo test -p slate-ros2 --features external-tools`.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value as Json, json};

/// A Python that has ROS 2.
pub fn python() -> PathBuf {
    slate_test_tools::ros2_python(Path::new(env!("CARGO_TARGET_TMPDIR")))
}

/// Another implementation of DDS.
pub fn cyclone_python() -> PathBuf {
    slate_test_tools::python(
        &Path::new(env!("CARGO_TARGET_TMPDIR")).join("cyclone-python"),
        &["cyclonedds==11.0.1"],
    )
}

fn script(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros2/rclpy").join(name)
}

/// A node that carries out commands, until this is dropped.
pub struct Peer {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Peer {
    pub fn start(name: &str, domain: u16) -> Self {
        Self::begin(Self::node(name, domain), "rmw_fastrtps_cpp")
    }

    /// A node whose sockets have room for large messages, as the book says.
    pub fn with_large_buffers(name: &str, domain: u16) -> Self {
        let mut command = Self::node(name, domain);
        command.env("FASTDDS_DEFAULT_PROFILES_FILE", script("large_messages.xml"));
        Self::begin(command, "rmw_fastrtps_cpp")
    }

    fn node(name: &str, domain: u16) -> Command {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2-logs");
        let mut command = Command::new(python());
        command
            .arg(script("program.py"))
            .arg(name)
            .env("ROS_DOMAIN_ID", domain.to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .env("ROS_LOG_DIR", folder)
            .env("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp");
        command
    }

    /// A program of CycloneDDS that writes and reads transforms.
    pub fn frames(domain: u16) -> Self {
        let mut command = Command::new(cyclone_python());
        command.arg(script("frames.py")).env("CYCLONEDDS_URI", "<Domain id=\"any\"><General><Interfaces><NetworkInterface address=\"127.0.0.1\" multicast=\"true\"/></Interfaces></General><Discovery><Peers><Peer address=\"127.0.0.1\"/></Peers><ParticipantIndex>auto</ParticipantIndex></Discovery></Domain>").arg(domain.to_string());
        Self::begin(command, "cyclonedds")
    }

    fn begin(mut command: Command, about: &str) -> Self {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (input, output) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        let mut peer = Self { child, input, output };
        assert_eq!(peer.request(json!({ "do": "about" })), about);
        peer
    }

    /// Has it do something; returns what comes of it.
    pub fn request(&mut self, command: Json) -> Json {
        writeln!(self.input, "{command}").unwrap();
        self.input.flush().unwrap();
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
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
        let taken = self.request(json!({ "do": "take", "topic": topic }));
        taken.as_array().unwrap().clone()
    }

    pub fn matched(&mut self, topic: &str) -> u64 {
        self.request(json!({ "do": "matched", "topic": topic })).as_u64().unwrap()
    }

    /// Ends it without a word, as a crash does.
    pub fn kill(mut self) {
        self.child.kill().unwrap();
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
