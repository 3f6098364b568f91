use proptest::prelude::*;
use slate_interfaces::{Contact, LaserScan, Sighting};
use slate_module::blackboard::interface::{Descriptor, Interface, View};
use slate_ros_messages::{Error, decode, definition, encode};

use crate::ros::interfaces::{Everything, all, value, without_padding};

pub fn any_interface() -> impl Strategy<Value = &'static Descriptor> {
    let all = all();
    (0..all.len()).prop_map(move |i| all[i])
}

fn encoded(descriptor: &Descriptor, bytes: &[u8]) -> Vec<u8> {
    let mut message = Vec::new();
    encode(descriptor, bytes, &mut message).unwrap();
    message
}

proptest! {
    #[test]
    fn every_bit_of_a_value_comes_back(descriptor in any_interface(), tail in 0..4_usize, seed: u64) {
        let bytes = value(descriptor, tail, seed);
        prop_assert_eq!(decode(descriptor, &encoded(descriptor, &bytes)).unwrap(), bytes);
    }

    #[test]
    fn a_value_with_few_bits_set_comes_back(
        descriptor in any_interface(), tail in 0..4_usize, at: prop::sample::Index, bits: u8,
    ) {
        let mut bytes = value(descriptor, tail, 0);
        bytes.fill(0);
        if !bytes.is_empty() {
            let at = at.index(bytes.len());
            bytes[at] = bits;
        }
        let bytes = without_padding(descriptor, tail, bytes);
        prop_assert_eq!(decode(descriptor, &encoded(descriptor, &bytes)).unwrap(), bytes);
    }

    /// A damaged message decodes to the same value for every reader.
    #[test]
    fn a_damaged_message_is_refused_or_is_another_value(
        descriptor in any_interface(), seed: u64, at: prop::sample::Index, bits in 1..=u8::MAX, cut: prop::sample::Index,
    ) {
        let mut message = encoded(descriptor, &value(descriptor, 2, seed));
        let at = at.index(message.len());
        message[at] ^= bits;
        message.truncate(1 + cut.index(2 * message.len()));
        if let Ok(bytes) = decode(descriptor, &message) {
            prop_assert_eq!(decode(descriptor, &encoded(descriptor, &bytes)).unwrap(), bytes);
        }
    }

    #[test]
    fn hostile_bytes_are_no_value_or_one(descriptor in any_interface(), rest: Vec<u8>) {
        let message = [&[0, 1, 0, 0], &rest[..]].concat();
        if let Ok(bytes) = decode(descriptor, &message) {
            prop_assert!(View::new(descriptor, &bytes, 0).is_some());
        }
    }
}

#[test]
fn a_message_lies_as_cdr_says() {
    let mut sighting = Sighting { range: 1.5, bearing: -0.25, name: "r2".into() };
    let message = encoded(Sighting::DESCRIPTOR, View::of(&mut sighting).bytes());
    let mut expected = vec![0, 1, 0, 0];
    expected.extend(1.5_f64.to_le_bytes());
    expected.extend((-0.25_f64).to_le_bytes());
    expected.extend([3, 0, 0, 0, b'r', b'2', 0]);
    // `memory` at a multiple of 4, and empty.
    expected.extend([0, 0, 0, 0, 0]);
    assert_eq!(message, expected);
}

#[test]
fn the_memory_is_in_the_message_only_when_fields_hide_something() {
    let mut contact = Contact {
        time: 7,
        robot: "a".into(),
        other: "b".into(),
        caused: true.into(),
        caused_by_other: false.into(),
    };
    let bytes = View::of(&mut contact).bytes();
    let plain = encoded(Contact::DESCRIPTOR, bytes);
    assert!(plain.len() < bytes.len());
    let mut hiding = bytes.to_vec();
    // Behind the end of the text.
    hiding[8 + 4 + 20] = 1;
    let whole = encoded(Contact::DESCRIPTOR, &hiding);
    assert_eq!(whole.len(), plain.len() + bytes.len());
    assert!(whole.ends_with(&hiding));
}

#[test]
fn fields_and_memory_of_a_message_can_not_disagree() {
    let mut bytes = value(Sighting::DESCRIPTOR, 0, 1);
    bytes[16..20].fill(0xff);
    let mut message = encoded(Sighting::DESCRIPTOR, &bytes);
    message[4] ^= 1;
    let error = decode(Sighting::DESCRIPTOR, &message).unwrap_err().to_string();
    assert!(error.contains("`memory` holds another value"), "{error}");
}

#[test]
fn room_that_is_there_is_enough() {
    for descriptor in all() {
        let bytes = value(descriptor, 3, 5);
        let mut out = encoded(descriptor, &bytes);
        let (length, place) = (out.len(), out.as_ptr());
        out.clear();
        encode(descriptor, &bytes, &mut out).unwrap();
        assert_eq!((out.len(), out.as_ptr()), (length, place), "{}", descriptor.name);
    }
}

#[test]
fn a_message_is_appended_and_aligned_from_its_own_beginning() {
    let bytes = value(Everything::DESCRIPTOR, 2, 9);
    let mut out = vec![7; 5];
    encode(Everything::DESCRIPTOR, &bytes, &mut out).unwrap();
    assert_eq!(out[..5], [7; 5]);
    assert_eq!(out[5..], encoded(Everything::DESCRIPTOR, &bytes));
}

#[test]
fn bytes_that_are_no_value_are_refused() {
    let mut out = Vec::new();
    let error = encode(LaserScan::DESCRIPTOR, &[0; 33], &mut out).unwrap_err();
    assert_eq!(
        error.to_string(),
        "a value of LaserScan has 32 and 4 for each item of its tail bytes, not 33"
    );
    assert!(matches!(encode(Sighting::DESCRIPTOR, &[0; 3], &mut out), Err(Error::Size { .. })));
    assert!(out.is_empty());
}

#[test]
fn refused_messages_say_where_and_why() {
    let message = encoded(LaserScan::DESCRIPTOR, &value(LaserScan::DESCRIPTOR, 2, 3));
    let refused = |message: &[u8]| decode(LaserScan::DESCRIPTOR, message).unwrap_err().to_string();
    assert_eq!(refused(&[0, 1]), "at byte 0 of the message: it has 2 bytes, too few for the header of CDR");
    assert_eq!(
        refused(&[0, 7, 0, 0]),
        "at byte 0 of the message: its encoding is 0x0007, expected plain CDR, 0x0000 or 0x0001"
    );
    assert_eq!(refused(&message[..10]), "at byte 4 of the message: 8 bytes should follow, there are 6");
    assert_eq!(
        refused(&message[..message.len() - 1]),
        "at byte 40 of the message: 2 numbers should follow, there are 7 bytes"
    );
    let longer = [&message[..], &[0; 8]].concat();
    assert_eq!(refused(&longer), "at byte 48 of the message: 8 bytes are left over: it is another message");
    let mut many = message.clone();
    many[36..40].fill(0xff);
    assert_eq!(
        refused(&many),
        "at byte 40 of the message: 4294967295 items should follow, there are 8 bytes"
    );
}

#[test]
fn messages_of_the_other_byte_order_are_read() {
    let mut message = vec![0, 0, 0, 0];
    for number in [1.0_f64, 2.0, 3.0, 4.0] {
        message.extend(number.to_be_bytes());
    }
    message.extend(2_u32.to_be_bytes());
    message.extend(5_f32.to_be_bytes());
    message.extend(6_f32.to_be_bytes());
    let bytes = decode(LaserScan::DESCRIPTOR, &message).unwrap();
    let scan = View::new(LaserScan::DESCRIPTOR, &bytes, 2).unwrap().value();
    assert_eq!(scan.get("range_max").unwrap().as_f64(), Some(4.0));
    assert_eq!(scan.get("ranges").unwrap().to_string(), "[5, 6]");
    let name = definition(LaserScan::DESCRIPTOR).name;
    assert_eq!(name, "slate_msgs/msg/LaserScan");
}
