//! Agents as ROS 1 nodes.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common::Running;

const BOOK: &str = include_str!("../../../book/src/32-ros1.md");

/// The first block of the book in a language.
fn block(language: &str) -> &'static str {
    let (_, rest) = BOOK.split_once(&format!("```{language}\n")).unwrap();
    rest.split_once("```").unwrap().0
}

#[test]
fn ros_1_mismatch_is_reported_before_run() {
    let running = Running::new("ros1-check");
    let robot = running.folder().join("robot.toml");
    std::fs::write(&robot, block("toml")).unwrap();
    if !cfg!(feature = "ros1") {
        running.fails(7, &["check", "robot.toml"], &["built without ROS 1, which `ros1:/odom` needs"]);
        running.fails(2, &["run", "robot.toml", "--headless"], &["cargo build --release --features ros1"]);
        let (head, _) = block("toml").split_once("[links]").unwrap();
        std::fs::write(&robot, head).unwrap();
        running.fails(
            7,
            &["check", "robot.toml"],
            &["built without ROS 1, which [ros1] needs", "robot.toml:12"],
        );
        return;
    }
    running.done(&["check", "robot.toml"]);
    let cases = [
        ("\"ros1:/wheels\"", "\"ros1:/my-wheels\"", "`/my-wheels` can't be the name of a topic: it has '-'"),
        ("\"ros1:/wheels\"", "\"ros1:/odom\"", "/odom is read by /simulator/r2/wheels and written by"),
        ("localhost", "robot", "the master at http://robot:11311 is not named by localhost"),
        (
            "[links]",
            "frames.\"simulator/r2/wheels\" = \"laser\"\n[links]",
            "would be filled by `ros1:/wheels` and by `frame laser of ROS 1`",
        ),
        ("[links]", "clock = 1\n[links]", "`clock` takes true or false"),
    ];
    for (from, to, words) in cases {
        std::fs::write(&robot, block("toml").replacen(from, to, 1)).unwrap();
        running.fails(7, &["check", "robot.toml"], &[words, "robot.toml:1"]);
        running.fails(2, &["run", "robot.toml", "--headless"], &[words]);
    }
    // A check needs no master, and a run does.
    std::fs::write(&robot, block("toml").replacen("localhost:11311", "127.0.0.1:9", 1)).unwrap();
    running.done(&["check", "robot.toml"]);
    let words = ["the master of ROS at http://127.0.0.1:9: ", "start it with roscore"];
    running.fails(2, &["run", "robot.toml", "--headless"], &words);
}

#[test]
#[cfg(all(feature = "ros1", feature = "external-tools"))]
#[allow(clippy::disallowed_methods, reason = "the master goes by the machine's clock")]
fn rospy_drives_a_robot_and_the_run_replays() {
    use std::net::{TcpListener, TcpStream};
    use std::process::{Command, Stdio};

    let mut running = Running::new("ros1-drive");
    let folder = running.folder().to_owned();
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let address = format!("http://localhost:{port}");
    let ros = |program: &str| {
        let mut command = Command::new(program);
        command.current_dir(&folder).env("ROS_MASTER_URI", &address).env("ROS_HOSTNAME", "localhost");
        command.env("ROS_HOME", &folder).env("ROS_LOG_DIR", folder.join("log"));
        command
    };
    let mut master = ros("/usr/bin/rosmaster");
    let master = master.args(["--core", "-p", &port.to_string()]).stdout(Stdio::null()).stderr(Stdio::null());
    let mut master = master.spawn().unwrap();
    let began = std::time::Instant::now();
    while TcpStream::connect(("127.0.0.1", port)).is_err() {
        assert!(began.elapsed().as_secs() < 30, "rosmaster does not listen");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let text = block("toml").replacen("http://localhost:11311", &address, 1);
    std::fs::write(folder.join("robot.toml"), text).unwrap();
    std::fs::write(folder.join("driver.py"), block("python")).unwrap();
    running.start("pioneer", &["run", "robot.toml", "--headless", "--rate", "1", "--out", "here"]);
    let mut driver = ros("timeout");
    driver.args(["60", "/usr/bin/python3", "driver.py"]);
    let output = slate_test_tools::run(&mut driver, "the node does not drive the robot");
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "there");
    // What comes from ROS is overwritten, and a tool gets the name of the writer.
    running.fails(5, &["set", "/simulator/r2/wheels/left", "1.0", "--agent", "pioneer"], &["ros1:/wheels"]);
    running.interrupt();
    running.finish();
    master.kill().unwrap();
    master.wait().unwrap();
    let verdict = running.done(&["replay", "--verify", "here/run.mcap"]);
    assert!(verdict.starts_with("identical, "), "{verdict}");
    let info = running.done(&["bag", "info", "here/run.mcap"]);
    assert!(info.contains("simulator/r2/wheels  ros1:/wheels"), "{info}");
}
