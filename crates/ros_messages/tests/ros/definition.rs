use slate_interfaces::{Image, Odometry};
use slate_module::blackboard::interface::Interface;
use slate_ros_messages::{Schema, definition, definition_named};

use crate::ros::interfaces::{ODD, all, value};

#[test]
fn documentation_units_and_constants_are_in_the_definition() {
    let definition = definition(Image::DESCRIPTOR);
    assert_eq!(definition.name, "slate_msgs/msg/Image");
    assert_eq!(
        definition.text,
        "# Image of a camera.\n\
         # Pixels of a row.\n\
         uint32 width\n\
         # Number of rows.\n\
         uint32 height\n\
         # Bytes of a row, with padding. [byte]\n\
         uint32 step\n\
         # Pixel format.\n\
         # One byte of brightness.\n\
         uint8 FORMAT_MONO8=0\n\
         # One byte each of red, green and blue.\n\
         uint8 FORMAT_RGB8=1\n\
         uint8 format\n\
         # Rows from the top; pixels from the left.\n\
         uint8[] data\n"
    );
}

#[test]
fn messages_inside_follow() {
    let definition = definition_named(Odometry::DESCRIPTOR, "odometry_2");
    assert_eq!(definition.name, "slate_msgs/msg/Odometry2");
    let lines: Vec<_> = definition.text.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(
        lines,
        [
            "slate_msgs/Odometry2Pose2 pose",
            "slate_msgs/Odometry2Twist2 twist",
            &"=".repeat(80),
            "MSG: slate_msgs/Odometry2Pose2",
            "float64 x",
            "float64 y",
            "float64 theta",
            &"=".repeat(80),
            "MSG: slate_msgs/Odometry2Twist2",
            "float64 linear",
            "float64 angular",
        ]
    );
}

#[test]
fn names_are_adapted_to_ros() {
    let definition = definition(&ODD);
    assert_eq!(definition.name, "slate_msgs/msg/OddOne");
    let lines: Vec<_> = definition.text.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(
        lines,
        [
            "uint32 camel_case",
            "float32 camel_case2",
            "int16 field_1st_try",
            "int8 FROM_LOW=-1",
            "int8 FROM_LOW2=1",
            "int8 from",
            "bool field",
            "string memory",
            "slate_msgs/OddOneNothing nothing",
            "slate_msgs/OddOneNothing[<=2] nothings",
            "float64[] no_room",
            "bool has_twice",
            "bool has_twice2",
            "uint32 twice",
            "slate_msgs/OddOneLists[6] lists",
            "uint8[] memory2",
            &"=".repeat(80),
            "MSG: slate_msgs/OddOneNothing",
            "uint8 structure_needs_at_least_one_member",
            &"=".repeat(80),
            "MSG: slate_msgs/OddOneListsValue",
            "uint8[2] value",
            &"=".repeat(80),
            "MSG: slate_msgs/OddOneLists",
            "slate_msgs/OddOneListsValue[1] value",
        ]
    );
    assert!(definition.text.starts_with("# Two lines. [not a unit] # MSG: a/B ===\n"));
}

#[test]
fn each_definition_says_how_its_messages_lie() {
    for descriptor in all() {
        let definition = definition(descriptor);
        let schema = Schema::parse(&definition.name, &definition.text).unwrap();
        for seed in 0..20 {
            let mut message = Vec::new();
            slate_ros_messages::encode(descriptor, &value(descriptor, 2, seed), &mut message).unwrap();
            schema.decode(&message).unwrap();
        }
    }
}
