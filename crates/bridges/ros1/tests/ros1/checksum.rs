//! Checksums as ROS has them.

use slate_interfaces::{LaserScan, Odometry, Twist2};
use slate_module::blackboard::interface::Interface;
use slate_ros_messages::WireFormat;
use slate_ros1::{RosMessage, message_checksum, service_checksum};

#[test]
fn checksums_are_those_of_ros() {
    let known = [
        (Twist2::DESCRIPTOR, "9f195f881246fdfa2798d1d3eebca84a"),
        (Odometry::DESCRIPTOR, "cd5e73d190d741a2f92e81eda573aca7"),
        (LaserScan::DESCRIPTOR, "90c7ef2dc6895d81024acba2ac42f369"),
    ];
    for (descriptor, checksum) in known {
        let message = RosMessage::new(WireFormat::Ros1, descriptor);
        assert_eq!(
            message_checksum(message.name(), message.definition()).as_deref(),
            Ok(checksum),
            "{}",
            message.name()
        );
    }
    let services = [
        ("std_srvs/Empty", "", "", "d41d8cd98f00b204e9800998ecf8427e"),
        (
            "std_srvs/SetBool",
            "bool data # on",
            "bool success\nstring message",
            "09fb03525b03e7ea1fd3992bafd87e16",
        ),
        ("std_srvs/Trigger", "", "bool success\nstring message", "937c9679a518e3a18d831e57125ea522"),
    ];
    for (name, request, response, checksum) in services {
        assert_eq!(service_checksum(name, request, response).as_deref(), Ok(checksum), "{name}");
    }
    let log = "byte DEBUG=1 #debug level\nbyte INFO=2\nbyte WARN=4\nbyte ERROR=8\nbyte FATAL=16\nHeader header\nbyte level\n\
               string name\nstring msg\nstring file\nstring function\nuint32 line\nstring[] topics\n===\nMSG: std_msgs/Header\n\
               uint32 seq\ntime stamp\nstring frame_id\n";
    assert_eq!(message_checksum("rosgraph_msgs/Log", log).as_deref(), Ok("acffd30cd6b6de30f120938c17c593fb"));
    assert_eq!(message_checksum("a/B", "C c").unwrap_err(), "a/C is not defined");
    assert_eq!(message_checksum("a/B", "B b").unwrap_err(), "a/B is not defined");
}
