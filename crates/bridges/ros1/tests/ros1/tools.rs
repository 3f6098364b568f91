//! Tools of ROS that look at an agent.
#![allow(clippy::disallowed_methods, reason = "ROS uses the system clock")]

use std::path::Path;
use std::process::Command;

use crate::ros1::agent::{Running, eventually};
use crate::ros1::peer::Master;

#[test]
fn tools_show_a_node_and_write_its_inputs() {
    let master = Master::core();
    let links = "\"base/command\" = \"ros1:/cmd_vel\"\n\"ros1:/odom\" = \"base/odometry\"\n\"ros1:/sum\" = \"base/sum\"";
    let agent = Running::start(&master.address(), links);
    let list = master.tool("rostopic", &["list"]);
    assert!(
        ["/cmd_vel", "/odom", "/sum"].iter().all(|topic| list.lines().any(|line| line == *topic)),
        "{list}"
    );
    assert_eq!(master.tool("rostopic", &["type", "/odom"]).trim(), "nav_msgs/Odometry");
    let echo = master.tool("rostopic", &["echo", "-n", "1", "/odom"]);
    assert!(echo.contains("y: -2.5") && echo.contains("frame_id: \"odom\""), "{echo}");
    let shown = master.tool("rosnode", &["info", "/r2_d2"]);
    assert!(shown.contains("* /odom [nav_msgs/Odometry]") && shown.contains("* /cmd_vel ["), "{shown}");
    let shown = master.tool("rosnode", &["ping", "-c", "1", "/r2_d2"]);
    assert!(shown.contains("xmlrpc reply from"), "{shown}");
    let twist = "{linear: {x: 0.5}, angular: {z: -0.25}}";
    let publish = ["pub", "-1", "/cmd_vel", "geometry_msgs/Twist", twist];
    master.tool("rostopic", &publish);
    eventually("the command", || agent.number("base/command/angular") == -0.25);
    // It is not ended by others.
    let _ = master.try_tool("rosnode", &["kill", "/r2_d2"]);
    eventually("the wish", || agent.logged("asks this one to end, which it does not") == 1);
    assert!(master.tool("rosnode", &["list"]).contains("/r2_d2"));
}

#[test]
fn rosbag_records_topics_that_others_read() {
    let master = Master::start();
    let links = "\"ros1:/odom\" = \"base/odometry\"\n\"ros1:/sum\" = \"base/sum\"";
    let agent = Running::start(&master.address(), links);
    let bag = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("ros1-{}.bag", std::process::id()));
    let path = bag.to_str().unwrap();
    master.tool("rosbag", &["record", "--duration=4", "-O", path, "/odom", "/sum"]);
    let python = slate_test_tools::python(
        &Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros1-python"),
        &["rosbags==0.11.9"],
    );
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros1/bag.py");
    let mut command = Command::new(python);
    let output = slate_test_tools::run(command.arg(script).arg(&bag), "the bag can't be read");
    let shown: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    for (topic, of) in [("/odom", "nav_msgs/msg/Odometry"), ("/sum", "slate_msgs/msg/Number")] {
        assert_eq!(shown[topic]["type"], of, "{shown}");
        assert!(shown[topic]["count"].as_u64().unwrap() > 50, "{shown}");
    }
    assert_eq!(shown["/odom"]["y"], -2.5);
    assert!(agent.bridge().topics().iter().all(|topic| topic.refused == 0));
    std::fs::remove_file(bag).unwrap();
}
