//! Names of topics and types.

use slate_interfaces::{Contacts, LaserScan, Path, Twist2};
use slate_module::blackboard::interface::Interface;
use slate_ros_messages::WireFormat;
use slate_ros2::{NodeName, RosMessage, check_topic, type_name, wire_topic};

#[test]
fn topics_are_named_from_the_root_the_namespace_or_the_node() {
    let node = NodeName { namespace: "/robots".into(), name: "r2".into() };
    assert_eq!(node.topic("/scan").unwrap(), "/scan");
    assert_eq!(node.topic("scan").unwrap(), "/robots/scan");
    assert_eq!(node.topic("~/scan").unwrap(), "/robots/r2/scan");
    assert_eq!(NodeName { namespace: "/".into(), name: "r2".into() }.topic("scan").unwrap(), "/scan");
    assert_eq!(NodeName::of_agent("r2-d2"), NodeName { namespace: "/".into(), name: "r2_d2".into() });
    assert_eq!(NodeName::of_agent("2nd").name, "_2nd");
    assert_eq!(wire_topic("/r2/scan"), "rt/r2/scan");
}

#[test]
fn names_forbidden_by_ros_are_reported() {
    let cases = [
        ("scan", "begin with a slash"),
        ("/", "a part of it is empty"),
        ("/a//b", "a part of it is empty"),
        ("/a/", "a part of it is empty"),
        ("/cmd-vel", "it has '-'"),
        ("/größe", "it has 'ö'"),
        ("/{node}/a", "it has '{'"),
        ("/2d", "`2d` begins with a digit"),
        ("/a__b", "two `_` in a row"),
    ];
    for (name, reason) in cases {
        let error = check_topic(name).unwrap_err();
        assert!(error.contains(reason), "{name}: {error}");
    }
    assert!(check_topic(&format!("/{}", "a".repeat(247))).unwrap_err().contains("248 letters"));
    let node = NodeName::of_agent("r2");
    assert!(node.topic("~scan").unwrap_err().contains("slash"));
    for name in ["/_private", "/a/b_1", "/A"] {
        check_topic(name).unwrap();
    }
}

#[test]
fn interfaces_have_the_types_of_ros_or_those_of_recordings() {
    let of = |message: &RosMessage| (message.name().to_owned(), type_name(message.name()));
    assert_eq!(
        of(&RosMessage::new(WireFormat::Cdr, LaserScan::DESCRIPTOR)),
        ("sensor_msgs/msg/LaserScan".into(), "sensor_msgs::msg::dds_::LaserScan_".into())
    );
    assert_eq!(
        type_name(RosMessage::new(WireFormat::Cdr, Twist2::DESCRIPTOR).name()),
        "geometry_msgs::msg::dds_::Twist_"
    );
    let own = RosMessage::new(WireFormat::Cdr, Contacts::DESCRIPTOR);
    assert_eq!(type_name(own.name()), "slate_msgs::msg::dds_::Contacts_");
    own.check_decodable().unwrap();
    assert!(
        RosMessage::new(WireFormat::Cdr, Path::DESCRIPTOR)
            .check_decodable()
            .unwrap_err()
            .contains("`length`")
    );
    assert_eq!(type_name("std_msgs/msg/Float64"), "std_msgs::msg::dds_::Float64_");
    let mut message = Vec::new();
    let bytes = [0.5_f64, -0.25].iter().flat_map(|number| number.to_ne_bytes()).collect::<Vec<_>>();
    let twist = RosMessage::new(WireFormat::Cdr, Twist2::DESCRIPTOR);
    twist.encode(&bytes, 0, "base_link", &mut message).unwrap();
    assert_eq!((message.len(), twist.decode(&message).unwrap()), (4 + 48, bytes));
}
