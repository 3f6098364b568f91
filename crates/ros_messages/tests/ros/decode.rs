//! Values of interfaces from ROS's own messages.

use slate_interfaces::{
    Echo, Image, LaserScan, Odometry, Orientation, Path, Pose2, PoseEstimate, SonarScan, Transform, Twist2,
    Verdict, WheelSpeeds,
};
use slate_module::blackboard::interface::{Descriptor, Interface, View};
use slate_ros_messages::{Error, Schema, Value, standard};

use crate::ros::interfaces::{all, value};

fn encoded(descriptor: &'static Descriptor, bytes: &[u8]) -> Vec<u8> {
    let mut message = Vec::new();
    standard(descriptor).unwrap().encode(bytes, 12_000_000_034, "base_link", &mut message).unwrap();
    message
}

fn again<T: Interface + Copy + PartialEq + std::fmt::Debug>(value: &T) {
    let mut own = *value;
    let bytes = View::of(&mut own).bytes().to_vec();
    let message = encoded(T::DESCRIPTOR, &bytes);
    assert_eq!(standard(T::DESCRIPTOR).unwrap().decode(&message).unwrap(), bytes, "{value:?}");
}

#[test]
fn values_come_back_from_their_messages() {
    again(&Twist2 { linear: 0.5, angular: -1.25 });
    again(&Pose2 { x: 1.0, y: 2.0, theta: 3.0 });
    again(&WheelSpeeds { left: 1.0, right: -2.0 });
    for theta in [-3.0, -0.5, 0.0, 0.5, 1.5, 3.0, std::f64::consts::PI] {
        let message = encoded(Orientation::DESCRIPTOR, View::of(&mut Orientation { theta }).bytes());
        let bytes = standard(Orientation::DESCRIPTOR).unwrap().decode(&message).unwrap();
        let found = f64::from_ne_bytes(bytes.try_into().unwrap());
        assert!((found - theta).abs() < 1e-15, "{found} {theta}");
    }
    let mut odometry =
        Odometry { pose: Pose2 { x: 1.0, y: 2.0, theta: 0.0 }, twist: Twist2 { linear: 0.5, angular: -1.0 } };
    again(&odometry);
    odometry.pose.theta = 1.0;
    let mut estimate = PoseEstimate { pose: Pose2 { theta: 0.0, ..odometry.pose }, covariance: [0.0; 9] };
    for (number, own) in (1_u8..).zip(&mut estimate.covariance) {
        *own = number.into();
    }
    again(&estimate);
}

/// Numbers of a message that differ by their rounding alone are the same.
fn is_close(a: &Value, b: &Value) -> bool {
    match (a, b) {
        // `angle_max` is computed, and not read.
        (Value::Map(a), Value::Map(b)) => {
            a.iter().zip(b.iter()).all(|((name, a), (_, b))| name == "angle_max" || is_close(a, b))
        }
        (Value::List(a), Value::List(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_close(a, b))
        }
        (Value::Double(a), Value::Double(b)) => {
            a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan() || (a - b).abs() < 1e-12
        }
        (Value::Numbers(a), Value::Numbers(b)) => {
            // NaNs are of many bits.
            a.bytes() == b.bytes()
                || a.len() == b.len() && a.iter().zip(b.iter()).all(|(a, b)| is_close(&a, &b))
        }
        (Value::Single(a), Value::Single(b)) => a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan(),
        (a, b) => a == b,
    }
}

#[test]
fn all_messages_that_tell_a_whole_value_are_read_again() {
    let (mut read, mut refused) = (Vec::new(), Vec::new());
    for descriptor in all() {
        let Some(own) = standard(descriptor) else { continue };
        if let Err(reason) = own.check_decodable() {
            refused.push(reason);
            continue;
        }
        read.push(descriptor.name);
        let schema = Schema::parse(&own.definition().name, &own.definition().text).unwrap();
        for seed in 0..200 {
            let message = encoded(descriptor, &value(descriptor, (seed % 5) as usize, seed));
            // A text that is longer than its room, and a format of images without a name, are in no message of others.
            let Ok(bytes) = own.decode(&message) else { continue };
            let second = encoded(descriptor, &bytes);
            let [first, second] = [message, second].map(|message| schema.decode(&message).unwrap());
            let is_turn =
                ["Odometry", "Orientation", "OccupancyGrid", "PoseEstimate"].contains(&descriptor.name);
            // Half the angle of a huge random number is a quaternion of either sign, which is the same turn.
            assert!(is_turn || is_close(&first, &second), "{first}\n{second}");
        }
    }
    assert_eq!(
        read,
        [
            "CameraInfo",
            "Clearance",
            "FourWheelSpeeds",
            "HolonomicTwist",
            "Image",
            "Imu",
            "Joy",
            "LaserScan",
            "OccupancyGrid",
            "Odometry",
            "Orientation",
            "PanTiltCommand",
            "PanTiltState",
            "Point2",
            "Pose2",
            "PoseEstimate",
            "Position",
            "Quaternion",
            "SonarPlacement",
            "Transform",
            "Twist2",
            "Vector3",
            "WheelSpeeds",
            "Battery",
        ]
    );
    let told = |interface: &Descriptor, field: &str| {
        let wanted =
            format!("{} can't be read from {}, which does not tell `{field}`", interface.name, interface.ros);
        assert!(refused.contains(&wanted), "{wanted}: {refused:?}");
    };
    told(Path::DESCRIPTOR, "length");
    told(Echo::DESCRIPTOR, "range");
    told(SonarScan::DESCRIPTOR, "field_of_view");
    told(Verdict::DESCRIPTOR, "state");
}

/// A message by hand: numbers of 4 bytes, as all of a scan are behind its name.
fn scan(ranges: &[f32]) -> Vec<u8> {
    let mut message = vec![0, 1, 0, 0];
    message.extend([12_u32, 34, 6].iter().flat_map(|number| number.to_le_bytes()));
    message.extend(b"laser\0\0\0");
    let numbers = [-1.5_f32, 1.5, 0.5, 0.0, 0.1, 0.05, 30.0];
    message.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    message.extend((ranges.len() as u32).to_le_bytes());
    message.extend(ranges.iter().flat_map(|number| number.to_le_bytes()));
    message.extend([0; 4]);
    message
}

#[test]
fn a_scan_of_another_program_has_its_ranges_as_the_tail() {
    let own = standard(LaserScan::DESCRIPTOR).unwrap();
    let bytes = own.decode(&scan(&[1.0, f32::INFINITY, 2.5])).unwrap();
    let number = |at: usize| f64::from_ne_bytes(bytes[at..at + 8].try_into().unwrap());
    assert_eq!([number(0), number(8), number(24)], [-1.5, 0.5, 30.0]);
    let tail: Vec<u8> =
        [1.0, f32::INFINITY, 2.5].iter().flat_map(|range: &f32| range.to_ne_bytes()).collect();
    assert_eq!(bytes[LaserScan::DESCRIPTOR.size..], tail);
    // A cut message, and none at all.
    let whole = scan(&[1.0; 8]);
    for length in 0..whole.len() - 4 {
        assert!(own.decode(&whole[..length]).is_err(), "{length}");
    }
}

#[test]
fn oversized_field_is_refused_by_name() {
    let refused = |descriptor, message: &[u8], wanted: &str| {
        let error = standard(descriptor).unwrap().decode(message).unwrap_err();
        assert!(matches!(error, Error::Field { .. }) && error.to_string().contains(wanted), "{error}");
    };
    let header = |frame: &str| {
        let mut message = vec![0, 1, 0, 0];
        message.extend([12_u32, 34, frame.len() as u32 + 1].iter().flat_map(|number| number.to_le_bytes()));
        message.extend(frame.as_bytes());
        message.push(0);
        message
    };
    let align = |message: &mut Vec<u8>, size: usize| {
        message.resize(4 + (message.len() - 4).next_multiple_of(size), 0);
    };
    let text = |message: &mut Vec<u8>, text: &str| {
        align(message, 4);
        message.extend((text.len() as u32 + 1).to_le_bytes());
        message.extend(text.as_bytes());
        message.push(0);
    };
    let mut message = header("camera");
    align(&mut message, 4);
    message.extend([0; 8]);
    text(&mut message, "yuv422");
    message.push(0);
    align(&mut message, 4);
    message.extend([0; 8]);
    refused(
        Image::DESCRIPTOR,
        &message,
        "`encoding` of the message is \"yuv422\", expected one of mono8, rgb8",
    );
    let mut message = header(&"frame".repeat(20));
    text(&mut message, "child");
    align(&mut message, 8);
    message.extend([0; 56]);
    refused(
        Transform::DESCRIPTOR,
        &message,
        "`header/frame_id` of the message has 100 bytes of text, and there is room for 64",
    );
    let mut message = header("");
    align(&mut message, 4);
    message.extend(1_u32.to_le_bytes());
    text(&mut message, "right_wheel");
    align(&mut message, 4);
    message.extend([0; 4]);
    message.extend(1_u32.to_le_bytes());
    align(&mut message, 8);
    message.extend(1.0_f64.to_le_bytes());
    message.extend([0; 4]);
    refused(WheelSpeeds::DESCRIPTOR, &message, "`velocity` of the message has no number of `left_wheel`");
}

#[test]
fn mutated_messages_are_refused_or_are_values() {
    let mut state = 1_u64;
    let mut next = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let (mut read, mut refused) = (0, 0);
    for descriptor in all() {
        let Some(own) = standard(descriptor).filter(|own| own.check_decodable().is_ok()) else { continue };
        for seed in 0..2_000 {
            let mut message = encoded(descriptor, &value(descriptor, next(20), seed));
            for _ in 0..1 + next(4) {
                let place = 4 + next(message.len() - 4);
                message[place] = next(256) as u8;
            }
            message.truncate(message.len() - next(2) * next(8));
            let Ok(bytes) = own.decode(&message) else {
                refused += 1;
                continue;
            };
            read += 1;
            // Nothing takes much more than what came.
            assert!(bytes.len() <= descriptor.size + 4 * message.len());
            own.encode(&bytes, 0, "map", &mut Vec::new()).unwrap();
        }
    }
    assert!(read > 1_000 && refused > 1_000, "{read} {refused}");
}
