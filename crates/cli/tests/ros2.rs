//! Agents as ROS 2 nodes.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common::Running;

const BOOK: &str = include_str!("../../../book/src/31-ros2.md");

/// The first block of the book in a language.
fn block(language: &str) -> &'static str {
    let (_, rest) = BOOK.split_once(&format!("```{language}\n")).unwrap();
    rest.split_once("```").unwrap().0
}

#[test]
fn mismatched_topics_are_reported_before_run() {
    let running = Running::new("ros2-check");
    let robot = running.folder().join("robot.toml");
    std::fs::write(&robot, block("toml")).unwrap();
    if !cfg!(feature = "ros2") {
        running.fails(7, &["check", "robot.toml"], &["built without ROS 2"]);
        running.fails(2, &["run", "robot.toml", "--headless"], &["cargo build --release --features ros2"]);
        return;
    }
    running.done(&["check", "robot.toml"]);
    let cases = [
        ("\"/wheels\"", "\"/my-wheels\"", "`/my-wheels` can't be the name of a topic: it has '-'"),
        ("simulator/r2/wheels", "simulator/r2/wheel", "no property at /simulator/r2/wheel"),
        ("simulator/r2/wheels", "simulator/r2/odometry", "it is not an input with values"),
        (
            "from = \"simulator/r2/odometry\"",
            "from = \"simulator/r2/odometer\"",
            "no property at /simulator/r2/odometer",
        ),
        (
            "\"/wheels\"",
            "\"/odom\"",
            "/odom is read by /simulator/r2/wheels and written by /simulator/r2/odometry here",
        ),
    ];
    for (from, to, words) in cases {
        std::fs::write(&robot, block("toml").replacen(from, to, 1)).unwrap();
        running.fails(7, &["check", "robot.toml"], &[words, "robot.toml:1"]);
        running.fails(2, &["run", "robot.toml", "--headless"], &[words]);
    }
}

#[test]
fn a_link_needs_a_bridge_that_is_known_and_built_in() {
    let running = Running::new("bridges");
    let robot = running.folder().join("robot.toml");
    let (head, _) = block("toml").split_once("[ros2]").unwrap();
    let with = |links: &str| std::fs::write(&robot, format!("{head}[links]\n{links}\n")).unwrap();
    let refused = |words: &[&str]| {
        running.fails(7, &["check", "robot.toml"], &[words, &["robot.toml:13:"]].concat());
        running.fails(2, &["run", "robot.toml", "--headless"], words);
    };
    with("\"simulator/r2/wheels\" = \"lcm:wheels\"");
    refused(&["`lcm:wheels` has an unknown scheme", "available: dds:, ros1:, ros2:, zenoh: and slate://"]);
    with("\"simulator/r2/wheel\" = \"ros2:/wheels\"");
    running.fails(7, &["check", "robot.toml"], &["`simulator` has no input `r2/wheel`", "r2/wheels"]);
    with("\"zenoh:demo/odometry\" = \"simulator/r2/odometry\"");
    match cfg!(feature = "zenoh") {
        true => refused(&["the configuration has no [network]", "add [network]"]),
        false => refused(&["built without Zenoh, which `zenoh:demo/odometry` needs", "--features zenoh"]),
    }
    with(
        "\"simulator/r2/wheels\" = \"ros2:/wheels\"\n\"ros2:/odom\" = { from = \"simulator/r2/odometry\", depth = 1 }",
    );
    match cfg!(feature = "ros2") {
        true => drop(running.done(&["check", "robot.toml"])),
        false => refused(&["built without ROS 2, which `ros2:/wheels` needs", "--features ros2"]),
    }
    if cfg!(all(feature = "ros2", feature = "zenoh")) {
        let network =
            "[network]\nlisten = [\"tcp/127.0.0.1:7447\"]\nread.\"simulator/r2/wheels\" = \"zenoh:wheels\"";
        with(&format!("\"simulator/r2/wheels\" = \"ros2:/wheels\"\n{network}"));
        refused(&["would be filled by `zenoh:wheels` and by `ros2:/wheels`", "take one of the two away"]);
        with("\"simulator/r2/wheels\" = \"ros2:/wheels\"\n\"ros2:/odom\" = \"simulator/r2/odometry\"");
    }
    if cfg!(feature = "ros2") {
        let link = "\"simulator/r2/wheels\" = \"ros2:/wheels\"";
        with(&format!("{link}\n[ros2]\nframes.\"simulator/r2/wheels\" = \"laser\""));
        let words =
            ["would be filled by", "`ros2:/wheels`", "`frame laser of ROS 2`", "take one of the two away"];
        running.fails(7, &["check", "robot.toml"], &words);
        with(&format!("{link}\n\"ros2:/odom\" = \"simulator/r2/odometry\""));
    }
    // A drawing needs no bridge.
    let graph = running.done(&["graph", "robot.toml", "--format", "mermaid"]);
    let has = |name: &str| graph.contains(&format!("([\"{name}\"])"));
    assert!(has("ros2:/wheels") && has("ros2:/odom") && graph.contains("r2/odometry"), "{graph}");
}

#[test]
#[cfg(all(feature = "ros2", feature = "external-tools"))]
fn a_node_drives_a_robot_and_the_run_replays() {
    use std::path::Path;
    use std::process::Command;

    let mut running = Running::new("ros2-drive");
    let folder = running.folder().to_owned();
    let domain = crate::common::domain();
    let text = block("toml").replacen("domain = 7", &format!("domain = {domain}"), 1);
    std::fs::write(folder.join("robot.toml"), text).unwrap();
    std::fs::write(folder.join("driver.py"), block("python")).unwrap();
    let python = slate_test_tools::ros2_python(Path::new(env!("CARGO_TARGET_TMPDIR")));
    running.start("pioneer", &["run", "robot.toml", "--headless", "--rate", "1", "--out", "here"]);
    let mut driver = Command::new("timeout");
    driver.arg("60").arg(python).arg("driver.py").current_dir(&folder);
    driver.env("ROS_DOMAIN_ID", domain).env("ROS_LOG_DIR", folder.join("log"));
    let output = slate_test_tools::run(&mut driver, "the node does not drive the robot");
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "there");
    // What comes from ROS is overwritten, and a tool gets the name of the writer.
    running.fails(5, &["set", "/simulator/r2/wheels/left", "1.0", "--agent", "pioneer"], &["ros2:/wheels"]);
    running.interrupt();
    running.finish();
    let verdict = running.done(&["replay", "--verify", "here/run.mcap"]);
    assert!(verdict.starts_with("identical, "), "{verdict}");
    let info = running.done(&["bag", "info", "here/run.mcap"]);
    assert!(info.contains("simulator/r2/wheels  ros2:/wheels"), "{info}");
}

#[test]
#[cfg(not(feature = "ros2"))]
fn a_command_without_ros_says_how_to_get_it() {
    let running = Running::new("ros2-missing");
    running.fails(2, &["ros", "list"], &["built without ROS 2", "cargo build --release --features ros2"]);
}

#[test]
#[cfg(all(feature = "ros2", feature = "external-tools"))]
fn topics_of_a_domain_are_listed_printed_and_measured() {
    use std::path::Path;
    use std::process::{Command, Stdio};

    let running = Running::new("ros2-tools");
    let domain = crate::common::domain();
    let python = slate_test_tools::ros2_python(Path::new(env!("CARGO_TARGET_TMPDIR")));
    let base = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/exp1/base.py");
    let mut node = Command::new(python);
    node.arg(base).env("ROS_DOMAIN_ID", &domain).env("ROS_LOG_DIR", running.folder().join("log"));
    let mut node = node.stdin(Stdio::null()).spawn().unwrap();
    let ros = |verb: &[&str]| {
        let domain = ["--domain", domain.as_str(), "--wait", "4s"];
        running.done(&[&["ros"], verb, &domain].concat())
    };
    // A busy machine takes longer to start the node and to find it.
    let shows = |verb: &[&str], words: &[&str]| {
        let is_whole = |shown: &String| words.iter().all(|word| shown.contains(word));
        let shown = (0..6).map(|_| ros(verb)).find(is_whole);
        shown.unwrap_or_else(|| panic!("{words:?}: {}", ros(verb)))
    };
    shows(&["list"], &["node     /base", "nav_msgs/msg/Odometry", "service  /base/get_parameters"]);
    let list: serde_json::Value = serde_json::from_str(&ros(&["list", "--json"])).unwrap();
    assert!(list["topics"].as_array().unwrap().iter().any(|topic| topic["topic"] == "/cmd_vel"), "{list}");
    let info = shows(&["info", "/scan"], &["publisher", "/base", "BEST_EFFORT"]);
    let hash = "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828";
    assert_eq!(info.matches(hash).count(), 2, "{info}");
    let echo = ros(&["echo", "/odom", "--count", "2", "--timeout", "10s"]);
    assert!(echo.contains("child_frame_id: \"base_link\"") && echo.ends_with("---\n"), "{echo}");
    let scan = ros(&["echo", "/scan", "--count", "1", "--timeout", "10s", "--json"]);
    let scan: serde_json::Value = serde_json::from_str(&scan).unwrap();
    assert_eq!(scan["ranges"].as_array().map(Vec::len), Some(180));
    let rate: serde_json::Value = serde_json::from_str(&ros(&["hz", "/odom", "--json"])).unwrap();
    let hertz = rate["rate"].as_f64().unwrap();
    assert!((20.0..80.0).contains(&hertz), "{rate}");
    let end = ["--domain", &domain, "--wait", "4s"];
    running.fails(4, &[&["ros", "info", "/odometry"], &end[..]].concat(), &["/odometry", "/odom"]);
    running.fails(7, &[&["ros", "hz", "/odom", "--min", "1000"], &end[..]].concat(), &[]);
    node.kill().unwrap();
    node.wait().unwrap();
}

#[test]
#[cfg(feature = "ros2")]
fn missing_or_forbidden_router_is_reported() {
    let running = Running::new("ros2-router");
    let list = ["ros", "list", "--wait", "10ms"];
    let far = [&list[..], &["--wire", "zenoh", "--router", "tcp/10.0.0.7:7447"]].concat();
    running.fails(2, &far, &["is on another machine, and what goes there is clear text", "trusted"]);
    running.fails(2, &[&list[..], &["--router", "tcp/127.0.0.1:9"]].concat(), &["DDS has no router"]);
    let nowhere = [&list[..], &["--wire", "zenoh", "--router", "tcp/127.0.0.1:9"]].concat();
    match cfg!(feature = "zenoh") {
        true => running.fails(2, &nowhere, &["no router is reached at `tcp/127.0.0.1:9`", "rmw_zenohd"]),
        false => running.fails(2, &nowhere, &["built without", "--features ros2,zenoh"]),
    };
    let robot = running.folder().join("robot.toml");
    let text = block("toml").replacen("domain = 7", "domain = 7\nwire = \"zenoh\"", 1);
    std::fs::write(&robot, text).unwrap();
    match cfg!(feature = "zenoh") {
        true => drop(running.done(&["check", "robot.toml"])),
        false => drop(running.fails(7, &["check", "robot.toml"], &["built without", "robot.toml:14:"])),
    }
}

#[test]
#[cfg(all(feature = "ros2", feature = "zenoh", feature = "external-tools"))]
fn a_robot_over_zenoh_is_driven_seen_and_made_again() {
    use std::io::{BufRead, BufReader, Write};
    use std::path::Path;
    use std::process::{ChildStdin, ChildStdout, Command, Stdio};

    struct Program(std::process::Child, ChildStdin, BufReader<ChildStdout>);
    impl Program {
        fn start(arguments: &[&str]) -> Self {
            let temporary = Path::new(env!("CARGO_TARGET_TMPDIR"));
            let script =
                Path::new(env!("CARGO_MANIFEST_DIR")).join("../bridges/ros2/tests/ros2/zenoh/program.py");
            let mut command = Command::new(slate_test_tools::zenoh_ros2_python(temporary));
            command.arg(script).args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
            let mut child = command.spawn().unwrap();
            let (input, output) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
            let mut program = Self(child, input, output);
            assert_eq!(program.line(), "listening");
            program
        }
        fn line(&mut self) -> String {
            let mut line = String::new();
            self.2.read_line(&mut line).unwrap();
            line.trim().into()
        }
        fn request(&mut self, command: &serde_json::Value) -> serde_json::Value {
            writeln!(self.1, "{command}").unwrap();
            serde_json::from_str(&self.line()).unwrap()
        }
    }
    impl Drop for Program {
        fn drop(&mut self) {
            // It may have ended.
            let _ = self.0.kill();
            let _ = self.0.wait();
        }
    }

    let mut running = Running::new("ros2-zenoh");
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port().to_string();
    let _router = Program::start(&["router", &port]);
    let python = slate_test_tools::ros2_python(Path::new(env!("CARGO_TARGET_TMPDIR")));
    let packages = python.parent().and_then(Path::parent).unwrap().join("share");
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let wire = format!("domain = 7\nwire = \"zenoh\"\nrouter = \"{endpoint}\"");
    std::fs::write(running.folder().join("robot.toml"), block("toml").replacen("domain = 7", &wire, 1))
        .unwrap();
    running.start("pioneer", &["run", "robot.toml", "--headless", "--rate", "1", "--out", "here"]);
    let mut node = Program::start(&["node", &port, "7", packages.to_str().unwrap()]);
    let advertise =
        serde_json::json!({ "do": "advertise", "topic": "/wheels", "type": "sensor_msgs/msg/JointState" });
    node.request(&advertise);
    let wheels = serde_json::json!({ "name": ["left_wheel", "right_wheel"], "velocity": [2.0, 1.5] });
    let ros = |verb: &[&str]| {
        let place = ["--wire", "zenoh", "--router", &endpoint, "--domain", "7", "--wait", "1s"];
        running.done(&[&["ros"], verb, &place].concat())
    };
    let list = ros(&["list"]);
    for words in
        ["node     /pioneer", "node     /peer", "nav_msgs/msg/Odometry", "service  /pioneer/get_parameters"]
    {
        assert!(list.contains(words), "{words}: {list}");
    }
    let info = ros(&["info", "/odom"]);
    let hash = "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0";
    assert_eq!(info.matches(hash).count(), 2, "{info}");
    let x = || -> f64 {
        let echo = ros(&["echo", "/odom", "--count", "1", "--timeout", "10s", "--json"]);
        let odometry: serde_json::Value = serde_json::from_str(&echo).unwrap();
        odometry["pose"]["pose"]["position"]["x"].as_f64().unwrap()
    };
    let before = x();
    let moved = (0..20).any(|_| {
        node.request(&serde_json::json!({ "do": "publish", "topic": "/wheels", "value": wheels }));
        (x() - before).abs() > 0.05
    });
    assert!(moved, "the robot stands at {before}");
    let rate: serde_json::Value = serde_json::from_str(&ros(&["hz", "/odom", "--json"])).unwrap();
    assert!((20.0..80.0).contains(&rate["rate"].as_f64().unwrap()), "{rate}");
    running.interrupt();
    running.finish();
    let verdict = running.done(&["replay", "--verify", "here/run.mcap"]);
    assert!(verdict.starts_with("identical, "), "{verdict}");
}
