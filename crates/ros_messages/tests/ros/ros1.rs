use slate_interfaces::{LaserScan, Pose2};
use slate_module::blackboard::interface::{Interface, View};
use slate_ros_messages::{Error, Schema, WireFormat, decode_in, definition_in, encode_in, standard_in};

use crate::ros::interfaces::{all, value};

const ROS1: WireFormat = WireFormat::Ros1;

/// Two beams from -1 rad on, by half a radian.
pub fn scan() -> Vec<u8> {
    let head = [-1.0_f64, 0.5, 0.25, 8.0].into_iter().flat_map(f64::to_ne_bytes);
    head.chain([1.5_f32, f32::INFINITY].into_iter().flat_map(f32::to_ne_bytes)).collect()
}

#[test]
fn values_come_back_bit_for_bit() {
    for descriptor in all() {
        for (tail, seed) in [(0, 1), (3, 2)] {
            let own = value(descriptor, tail, seed);
            let mut message = Vec::new();
            encode_in(ROS1, descriptor, &own, &mut message).unwrap();
            assert_eq!(decode_in(ROS1, descriptor, &message).unwrap(), own, "{}", descriptor.name);
            // A definition says all that is needed for reading it.
            let definition = definition_in(ROS1, descriptor);
            assert!(!definition.text.contains("<="), "{}", definition.text);
            let schema = Schema::parse(&definition.name, &definition.text).unwrap();
            schema.decode_in(ROS1, &message).unwrap();
            for end in 0..message.len() {
                assert!(decode_in(ROS1, descriptor, &message[..end]).is_err(), "{}", descriptor.name);
            }
            message.push(0);
            assert!(decode_in(ROS1, descriptor, &message).is_err(), "{}", descriptor.name);
        }
    }
}

#[test]
fn a_scan_lies_as_ros_1_has_it() {
    let standard = standard_in(ROS1, LaserScan::DESCRIPTOR).unwrap();
    assert_eq!(standard.definition().name, "sensor_msgs/LaserScan");
    let mut message = Vec::new();
    standard.encode(&scan(), 12_000_000_034, "laser", &mut message).unwrap();
    let mut expected = Vec::new();
    for word in [0_u32, 12, 34, 5] {
        expected.extend(word.to_le_bytes());
    }
    expected.extend(b"laser");
    for number in [-1.0_f32, -0.5, 0.5, 0.0, 0.0, 0.25, 8.0] {
        expected.extend(number.to_le_bytes());
    }
    expected.extend(2_u32.to_le_bytes());
    expected.extend([1.5_f32, f32::INFINITY].into_iter().flat_map(f32::to_le_bytes));
    expected.extend(0_u32.to_le_bytes());
    assert_eq!(message, expected);
    assert_eq!(standard.decode(&message).unwrap(), scan());
}

#[test]
fn invalid_message_is_refused_with_place() {
    let standard = standard_in(ROS1, Pose2::DESCRIPTOR).unwrap();
    let mut pose = Pose2 { x: 1.0, y: 2.0, theta: 3.0 };
    let mut message = Vec::new();
    standard.encode(View::of(&mut pose).bytes(), 0, "", &mut message).unwrap();
    assert_eq!(message.len(), 24);
    let cut = standard.decode(&message[..20]).unwrap_err();
    let reason = "8 bytes should follow, there are 4".to_owned();
    assert_eq!(cut, Error::Message { at: 16, reason });
    message.push(0);
    let long = standard.decode(&message).unwrap_err().to_string();
    assert!(long.contains("1 bytes are left over"), "{long}");
    // A list that says it has more than there is takes no memory.
    let laser = standard_in(ROS1, LaserScan::DESCRIPTOR).unwrap();
    let mut hostile = vec![0; 16 + 28];
    hostile.extend(u32::MAX.to_le_bytes());
    assert!(laser.decode(&hostile).unwrap_err().to_string().contains("should follow"));
}
