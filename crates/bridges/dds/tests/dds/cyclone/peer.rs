//! Programs of DDS, in Python: `cargo test -p slate-dds --features external-tools`.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value as Json, json};

/// Only the loopback interface, without other machines.
const CYCLONE: &str = "<Domain id=\"any\"><General><Interfaces><NetworkInterface address=\"127.0.0.1\" multicast=\"true\"/></Interfaces></General><Discovery><Peers><Peer address=\"127.0.0.1\"/></Peers><ParticipantIndex>auto</ParticipantIndex></Discovery></Domain>";

/// A Python that has CycloneDDS.
pub fn cyclone_python() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cyclone-python");
    slate_test_tools::python(&folder, &["cyclonedds==11.0.1"])
}

/// A Python that has Fast DDS, below ROS 2.
pub fn fast_python() -> PathBuf {
    slate_test_tools::ros2_python(Path::new(env!("CARGO_TARGET_TMPDIR")))
}

/// Runs a test of that path in a network namespace of its own.
pub fn alone(test: &str, body: impl FnOnce(u16)) {
    let prepare = || {
        cyclone_python();
        fast_python();
    };
    slate_test_tools::alone(test, prepare, body);
}

/// A program that carries out commands, until this is dropped.
pub struct Peer {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Peer {
    /// A program of CycloneDDS.
    pub fn cyclone(domain: u16) -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dds/cyclone/program.py");
        let mut command = Command::new(cyclone_python());
        command.arg(script).env("CYCLONEDDS_URI", CYCLONE).arg(domain.to_string());
        Self::begin(command, "cyclonedds")
    }

    /// A node of ROS 2 on Fast DDS.
    pub fn fast(domain: u16) -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../ros2/tests/ros2/rclpy/program.py");
        let mut command = Command::new(fast_python());
        command
            .arg(script)
            .arg("peer")
            .env("ROS_DOMAIN_ID", domain.to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .env("ROS_LOG_DIR", Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2-logs"))
            .env("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp");
        Self::begin(command, "rmw_fastrtps_cpp")
    }

    fn begin(mut command: Command, about: &str) -> Self {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (input, output) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        let mut peer = Self { child, input, output };
        assert_eq!(peer.request(json!({ "do": "about" })), about);
        peer
    }

    /// Has it do something; returns the result.
    pub fn request(&mut self, command: Json) -> Json {
        writeln!(self.input, "{command}").unwrap();
        self.input.flush().unwrap();
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{command}: {error}: {line:?}"))
    }

    pub fn advertise(&mut self, topic: &str, of: &str, qos: Json) {
        self.request(json!({ "do": "advertise", "topic": topic, "type": of, "qos": qos }));
    }

    pub fn publish(&mut self, topic: &str, value: &Json) {
        self.request(json!({ "do": "publish", "topic": topic, "value": value }));
    }

    pub fn subscribe(&mut self, topic: &str, of: &str, qos: Json) {
        self.request(json!({ "do": "subscribe", "topic": topic, "type": of, "qos": qos }));
    }

    /// Messages received since the last call.
    pub fn take(&mut self, topic: &str) -> Vec<Json> {
        self.request(json!({ "do": "take", "topic": topic })).as_array().unwrap().clone()
    }

    pub fn matched(&mut self, topic: &str) -> u64 {
        self.request(json!({ "do": "matched", "topic": topic })).as_u64().unwrap()
    }

    /// Ends it as a crash does.
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
