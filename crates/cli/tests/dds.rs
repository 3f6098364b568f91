//! Agents with topics of DDS.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common::Running;

const BOOK: &str = include_str!("../../../book/src/33-dds.md");

/// The first block of the book in a language.
fn block(language: &str) -> &'static str {
    let (_, rest) = BOOK.split_once(&format!("```{language}\n")).unwrap();
    rest.split_once("```").unwrap().0
}

#[test]
fn dds_mismatch_is_reported_before_run() {
    let running = Running::new("dds-check");
    let [robot, idl] = ["robot.toml", "robot.idl"].map(|name| running.folder().join(name));
    std::fs::write(&robot, block("toml")).unwrap();
    std::fs::write(&idl, block("idl")).unwrap();
    if !cfg!(feature = "dds") {
        running.fails(7, &["check", "robot.toml"], &["built without DDS, which `dds:Wheels` needs"]);
        running.fails(2, &["run", "robot.toml", "--headless"], &["cargo build --release --features dds"]);
        let (head, _) = block("toml").split_once("[links]").unwrap();
        std::fs::write(&robot, head).unwrap();
        let words = ["built without DDS, which [dds] needs", "robot.toml:12"];
        running.fails(7, &["check", "robot.toml"], &words);
        return;
    }
    running.done(&["check", "robot.toml"]);
    let cases = [
        ("\"dds:Wheels\"", "\"dds:Odometry\"", "Odometry is read by /simulator/r2/wheels and written by"),
        ("demo::Wheels", "demo::Wheel", "robot.idl has no struct demo::Wheel"),
        ("demo::Wheels", "demo::Pose", "demo::Pose (robot.idl:7) has no member left, right"),
        ("idl = \"robot.idl\" }", "idl = \"robots.idl\" }", "robots.idl:1: No such file"),
        (
            "[links]",
            "read.\"simulator/r2/wheels\" = \"Wheel\"\n[links]",
            "/simulator/r2/wheels reads two topics",
        ),
        ("domain = 7", "domain = 7\nnode = \"r2\"", "node"),
    ];
    for (from, to, words) in cases {
        std::fs::write(&robot, block("toml").replacen(from, to, 1)).unwrap();
        running.fails(7, &["check", "robot.toml"], &[words, "robot.toml:1"]);
        running.fails(2, &["run", "robot.toml", "--headless"], &[words]);
    }
    std::fs::write(&robot, block("toml")).unwrap();
    let wrong = [
        ("double left", "string left", "`left` is string in demo::Wheels (robot.idl:3), and f64 in"),
        ("double left", "any left", "robot.idl:4: `any` is not supported"),
        ("double left, right;", "double left, left;", "robot.idl:5: `Wheels` has two members `left`"),
    ];
    for (from, to, words) in wrong {
        std::fs::write(&idl, block("idl").replacen(from, to, 1)).unwrap();
        running.fails(7, &["check", "robot.toml"], &[words, "robot.toml:1"]);
    }
}

#[test]
#[cfg(all(feature = "dds", feature = "external-tools"))]
fn a_dds_program_drives_a_robot_and_the_run_replays() {
    use std::path::Path;
    use std::process::Command;

    let mut running = Running::new("dds-drive");
    let folder = running.folder().to_owned();
    let domain = crate::common::domain();
    let text = block("toml").replacen("domain = 7", &format!("domain = {domain}"), 1);
    std::fs::write(folder.join("robot.toml"), text).unwrap();
    std::fs::write(folder.join("robot.idl"), block("idl")).unwrap();
    let driver = block("python").replacen("DomainParticipant(7)", &format!("DomainParticipant({domain})"), 1);
    std::fs::write(folder.join("driver.py"), driver).unwrap();
    let tools = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cyclone-python");
    let python = slate_test_tools::python(&tools, &["cyclonedds==11.0.1"]);
    running.start("pioneer", &["run", "robot.toml", "--headless", "--rate", "1", "--out", "here"]);
    let mut driver = Command::new("timeout");
    let loopback = "<Domain id=\"any\"><General><Interfaces><NetworkInterface address=\"127.0.0.1\" multicast=\"true\"/></Interfaces></General><Discovery><Peers><Peer address=\"127.0.0.1\"/></Peers><ParticipantIndex>auto</ParticipantIndex></Discovery></Domain>";
    driver.arg("60").arg(python).arg("driver.py").current_dir(&folder).env("CYCLONEDDS_URI", loopback);
    let output = slate_test_tools::run(&mut driver, "the program does not drive the robot");
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "there");
    // A tool can't set an input that a topic fills: the error names the topic.
    running.fails(5, &["set", "/simulator/r2/wheels/left", "1.0", "--agent", "pioneer"], &["dds:Wheels"]);
    running.interrupt();
    running.finish();
    let verdict = running.done(&["replay", "--verify", "here/run.mcap"]);
    assert!(verdict.starts_with("identical, "), "{verdict}");
    let info = running.done(&["bag", "info", "here/run.mcap"]);
    assert!(info.contains("simulator/r2/wheels  dds:Wheels"), "{info}");
}
