//! A node of ROS 1 of Debian, in Python, and its master: `cargo test -p slate-ros1 --features external-tools`.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Output, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};

use serde_json::{Value as Json, json};

use crate::ros1::agent::eventually;

/// A master, until this is dropped.
pub struct Master {
    child: Child,
    port: u16,
    /// The process of the master, if `roscore` has started it.
    of_core: Option<u32>,
}

impl Master {
    /// A master alone.
    pub fn start() -> Self {
        let port = free_port();
        let mut master = Self { child: alone(port), port, of_core: None };
        master.wait();
        master
    }

    /// That of `roscore`, with all that this starts.
    pub fn core() -> Self {
        let port = free_port();
        let mut master = Self { child: core(port), port, of_core: None };
        master.wait();
        master.of_core = Some(master.process());
        master
    }

    /// Ends it as a fault does.
    pub fn kill(&mut self) {
        self.end();
        let port = self.port;
        eventually("its end", || TcpStream::connect(("127.0.0.1", port)).is_err());
    }

    /// A new one, at the same address.
    pub fn revive(&mut self) {
        self.child = if self.of_core.is_some() { core(self.port) } else { alone(self.port) };
        self.wait();
        self.of_core = self.of_core.map(|_| self.process());
    }

    fn wait(&mut self) {
        let port = self.port;
        eventually("the master", || TcpStream::connect(("127.0.0.1", port)).is_ok());
    }

    fn process(&self) -> u32 {
        let script = "import rosgraph; print(rosgraph.Master('/test').getPid())";
        let output = command("/usr/bin/python3", self.port)
            .args(["-c", script])
            .stdout(Stdio::piped())
            .output()
            .unwrap();
        String::from_utf8_lossy(&output.stdout).trim().parse().unwrap()
    }

    fn end(&mut self) {
        if let Some(process) = self.of_core {
            // It may have ended. When the master is gone, `roscore` ends all that it has started.
            let _ = Command::new("kill").args(["-9", &process.to_string()]).status();
            let _ = self.child.wait();
        }
        end(&mut self.child);
    }

    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}", self.port)
    }

    pub fn peer(&self, name: &str) -> Peer {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros1/program.py");
        let mut command = command("/usr/bin/python3", self.port);
        let command = command
            .arg(script)
            .arg(name)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit());
        let mut child = command.spawn().unwrap();
        let (input, output) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        let mut peer = Peer { child, input, output };
        assert_eq!(peer.request(json!({ "do": "about" })), "rospy");
        peer
    }

    /// Output of a ROS tool.
    pub fn tool(&self, program: &str, arguments: &[&str]) -> String {
        let output = self.run(program, arguments);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{program} {arguments:?}: {text}{error}");
        text
    }

    /// The same of one that may fail.
    pub fn try_tool(&self, program: &str, arguments: &[&str]) -> Option<String> {
        let output = self.run(program, arguments);
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
    }

    fn run(&self, program: &str, arguments: &[&str]) -> Output {
        let mut command = command("timeout", self.port);
        command.arg("60").arg(format!("/usr/bin/{program}")).args(arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).output().unwrap()
    }
}

impl Drop for Master {
    fn drop(&mut self) {
        self.end();
    }
}

/// Another program may take it before the master does; then the test fails with the master's words.
/// Free port, below those that the system gives to connections: one of these could get it before the master does.
fn free_port() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let first = 15_000 + (std::process::id() % 15_000) as u16;
    loop {
        let port = first + NEXT.fetch_add(1, Ordering::Relaxed) % 2_000;
        if TcpListener::bind(("127.0.0.1", port)).is_ok() {
            return port;
        }
    }
}

const PACKAGES: &str = "apt-get install python3-roslaunch python3-rospy python3-rosbag python3-rostopic python3-rosservice \
                        python3-rosnode python3-rosparam rosout python3-std-srvs python3-tf2-msgs python3-nav-msgs \
                        python3-sensor-msgs python3-geometry-msgs";

fn alone(port: u16) -> Child {
    command("/usr/bin/rosmaster", port).args(["--core", "-p", &port.to_string()]).spawn().expect(PACKAGES)
}

/// The whole of what ROS starts first.
fn core(port: u16) -> Child {
    let mut command = command("/usr/bin/roscore", port);
    command.args(["-p", &port.to_string()]).spawn().expect(PACKAGES)
}

fn command(program: &str, port: u16) -> Command {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros1-logs");
    std::fs::create_dir_all(&folder).unwrap();
    let mut command = Command::new(program);
    // Children of a killed program must not keep the output of the test open.
    command
        .stdout(Stdio::null())
        .stderr(Stdio::null())
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
    pub fn request(&mut self, command: Json) -> Json {
        writeln!(self.input, "{command}").unwrap();
        self.input.flush().unwrap();
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{command}: {error}: {line:?}"))
    }

    pub fn advertise(&mut self, topic: &str, message: &str) {
        self.request(json!({ "do": "advertise", "topic": topic, "type": message }));
    }

    pub fn publish(&mut self, topic: &str, value: &Json) {
        self.request(json!({ "do": "publish", "topic": topic, "value": value }));
    }

    pub fn subscribe(&mut self, topic: &str, message: &str) {
        self.request(json!({ "do": "subscribe", "topic": topic, "type": message }));
    }

    /// Messages received since the last call.
    pub fn take(&mut self, topic: &str) -> Vec<Json> {
        self.request(json!({ "do": "take", "topic": topic })).as_array().unwrap().clone()
    }

    pub fn matched(&mut self, topic: &str) -> u64 {
        self.request(json!({ "do": "matched", "topic": topic })).as_u64().unwrap()
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        end(&mut self.child);
    }
}
