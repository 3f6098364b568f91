//! Values as messages of structs of IDL.

use proptest::prelude::*;
use serde_json::json;
use slate_blackboard::interface::Interface;
use slate_dds::{DdsMessage, IdlFile, IdlMessage, Representation, TopicType};

use crate::dds::interfaces::{Blob, Count, Point, Target, bytes_of, message, structure, target};

const BOTH: [Representation; 2] = [Representation::Xcdr1, Representation::Xcdr2];

fn count(value: f64) -> Vec<u8> {
    bytes_of::<Count>(&json!({ "value": value }))
}

fn encoded(message: &IdlMessage, value: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    message.encode(value, &mut out).unwrap();
    out
}

#[test]
fn a_value_comes_back_in_each_representation() {
    for name in ["demo::Target", "demo::GrowingTarget"] {
        for representation in BOTH {
            let message = message(name, representation);
            for number in 0..12 {
                let value = bytes_of::<Target>(&target(number));
                assert_eq!(
                    message.decode(&encoded(&message, &value)).unwrap(),
                    value,
                    "{name} {representation:?}"
                );
            }
        }
    }
}

/// Messages that CycloneDDS 11.0.1 writes of target 1.
const CYCLONE: [(&str, Representation, &str); 3] = [
    (
        "demo::Target",
        Representation::Xcdr1,
        "00010000ffffffff010000000000000000000000000000000000f03f000000000000d0bf0900000074617267657420310000\
         0000010000000000003f0100000000000000000000000000f03f000000000000f03f000000000000f83f000000000000e03f",
    ),
    (
        "demo::Target",
        Representation::Xcdr2,
        "00070000ffffffff0100000000000000000000000000f03f000000000000d0bf090000007461726765742031000000000100\
         00000000003f1400000001000000000000000000f03f000000000000f03f000000000000f83f000000000000e03f",
    ),
    (
        "demo::GrowingTarget",
        Representation::Xcdr2,
        "0009000069000000ffffffff010000000000000010000000000000000000f03f000000000000d0bf09000000746172676574\
         203100000000010000000000003f180000000100000010000000000000000000f03f000000000000f03f000000000000f83f\
         000000000000e03f0100000000",
    ),
];

#[test]
fn messages_are_those_of_another_implementation() {
    for (name, representation, hexadecimal) in CYCLONE {
        let digits = hexadecimal.as_bytes();
        let digit = |digit: u8| char::from(digit).to_digit(16).unwrap() as u8;
        let wire: Vec<_> = digits.chunks(2).map(|pair| 16 * digit(pair[0]) + digit(pair[1])).collect();
        let (message, value) = (message(name, representation), bytes_of::<Target>(&target(1)));
        assert_eq!(message.decode(&wire).unwrap(), value, "{name} {representation:?}");
        assert_eq!(encoded(&message, &value), wire, "{name} {representation:?}");
    }
}

#[test]
fn fields_lie_as_the_standard_says() {
    // A long and a double are 4 apart in XCDR1, and adjacent in XCDR2; an appendable struct has its length before it.
    let cases = [
        ("@final", Representation::Xcdr1, vec![0, 1, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0]),
        ("@final", Representation::Xcdr2, vec![0, 7, 0, 0, 5, 0, 0, 0]),
        ("@appendable", Representation::Xcdr1, vec![0, 1, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0]),
        ("@appendable", Representation::Xcdr2, vec![0, 9, 0, 0, 12, 0, 0, 0, 5, 0, 0, 0]),
    ];
    for (extensibility, representation, before) in cases {
        let text = format!("{extensibility} struct Two {{ long value2; double value; }};");
        let two = IdlFile::parse("two.idl", &text).unwrap().structure("Two").unwrap();
        let message = IdlMessage::of(Count::DESCRIPTOR, &two, representation).unwrap();
        let mut wire = encoded(&message, &count(1.5));
        assert!(wire.ends_with(&1.5_f64.to_le_bytes()));
        // A member without a field is zero.
        let number = before.len() - if representation == Representation::Xcdr1 { 8 } else { 4 };
        assert_eq!(std::mem::replace(&mut wire[number], 5), 0);
        assert_eq!(wire[..wire.len() - 8], before, "{extensibility} {representation:?}");
        // A reader does not mind its value.
        assert_eq!(message.decode(&wire).unwrap(), count(1.5));
    }
}

#[test]
fn big_endian_messages_are_read() {
    let two = IdlFile::parse("two.idl", "struct Two { short n; double value; };").unwrap();
    let message =
        IdlMessage::of(Count::DESCRIPTOR, &two.structure("Two").unwrap(), Representation::Xcdr1).unwrap();
    let mut wire = vec![0, 0, 0, 0, 1, 2, 0, 0, 0, 0, 0, 0];
    wire.extend(2.25_f64.to_be_bytes());
    assert_eq!(message.decode(&wire).unwrap(), count(2.25));
}

#[test]
fn a_newer_or_older_appendable_type_is_read() {
    let of = |text: &str, representation| {
        let own = IdlFile::parse("grow.idl", text).unwrap().structure("G").unwrap();
        IdlMessage::of(Count::DESCRIPTOR, &own, representation).unwrap()
    };
    for representation in BOTH {
        let old = of("@appendable struct G { double value; };", representation);
        let new = of("@appendable struct G { double value; string more; long much; };", representation);
        let value = count(-4.0);
        assert_eq!(old.decode(&encoded(&new, &value)).unwrap(), value);
        assert_eq!(new.decode(&encoded(&old, &value)).unwrap(), value);
    }
    let fixed = of("@final struct G { double value; long much; };", Representation::Xcdr1);
    let shorter = of("@final struct G { double value; };", Representation::Xcdr1);
    let value = count(-4.0);
    let error = shorter.decode(&encoded(&fixed, &value)).unwrap_err();
    assert!(error.contains("4 bytes are left over: it is another type"), "{error}");
    assert!(fixed.decode(&encoded(&shorter, &value)).unwrap_err().contains("much: 4 bytes should follow"));
    let grown = of("@appendable struct G { double value; };", Representation::Xcdr2);
    let fixed = of("@final struct G { double value; };", Representation::Xcdr2);
    let error = fixed.decode(&encoded(&grown, &value)).unwrap_err();
    assert!(error.contains("its type is @appendable, and @final in grow.idl:1"), "{error}");
}

#[test]
fn a_list_of_any_length_is_the_tail() {
    let own = structure("demo::Blob");
    for representation in BOTH {
        let message = IdlMessage::of(Blob::DESCRIPTOR, &own, representation).unwrap();
        let data: Vec<_> = (0..1000).map(|at| at % 251).collect();
        let value = bytes_of::<Blob>(&json!({ "width": 640, "data": data }));
        let wire = encoded(&message, &value);
        assert_eq!(wire.len(), 4 + 4 + 4 + 1000);
        assert_eq!(message.decode(&wire).unwrap(), value);
    }
}

#[test]
fn mismatch_is_named_by_both_sides() {
    let cases = [
        ("struct P { string x; double y; };", "`x` is string in P (p.idl:1), and f64 in Point"),
        ("struct P { long x; double y; };", "`x` is long in P (p.idl:1), and f64 in Point"),
        ("struct P { boolean x; double y; };", "`x` is boolean"),
        ("struct P { double x[2]; double y; };", "`x` is array of 2 x double"),
        ("struct P { double x; double z; };", "P (p.idl:1) has no member y, as Point has"),
    ];
    for (text, reason) in cases {
        let structure = IdlFile::parse("p.idl", text).unwrap().structure("P");
        let of = TopicType { name: "P".into(), structure, representation: Representation::Xcdr1 };
        let message = DdsMessage::of(Point::DESCRIPTOR, Some(&of));
        let error = message.and_then(|message| message.check_decodable()).unwrap_err();
        assert!(error.contains(reason), "{error}");
    }
    let structure = IdlFile::parse("p.idl", "struct P { double z; };").unwrap().structure("P");
    let of = TopicType { name: "P".into(), structure, representation: Representation::Xcdr1 };
    let error = DdsMessage::of(Point::DESCRIPTOR, Some(&of)).unwrap().check_encodable().unwrap_err();
    assert!(error.contains("P (p.idl:1) has no member of a field of Point: x, y"), "{error}");
}

#[test]
fn values_that_the_other_side_has_no_room_for_are_refused() {
    let wide = message("demo::GrowingTarget", Representation::Xcdr1);
    let mut long = target(1);
    long["name"] = json!("sixteen letters!");
    let error = wide.encode(&bytes_of::<Target>(&long), &mut Vec::new()).unwrap_err();
    assert_eq!(error, "name: a string has 16 bytes, more than 15");
    let mut large = target(1);
    large["id"] = json!(1_u64 << 40);
    let error = wide.encode(&bytes_of::<Target>(&large), &mut Vec::new()).unwrap_err();
    assert!(error.starts_with("id: ") && error.ends_with("does not fit a i32"), "{error}");
    let lists = "struct Target { long long id; octet mode; boolean valid; Point position; string name; \
                 sequence<float> weights; double corner[2]; sequence<Point> path; };";
    let text = format!("struct Point {{ double x; double y; }}; {lists}");
    let free = IdlFile::parse("free.idl", &text).unwrap().structure("Target").unwrap();
    let free = IdlMessage::of(Target::DESCRIPTOR, &free, Representation::Xcdr1).unwrap();
    let mut wire = encoded(&free, &bytes_of::<Target>(&target(0)));
    // The number of points.
    let at = wire.len() - 4;
    wire[at] = 5;
    wire.extend([0; 4 + 5 * 16]);
    assert_eq!(free.decode(&wire).unwrap_err(), "path: a sequence has 5 items, the interface has room for 4");
}

proptest! {
    #[test]
    fn mutated_messages_are_values_or_refused(
        number in any::<u8>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
        second in any::<bool>(),
        growing in any::<bool>(),
    ) {
        let name = if growing { "demo::GrowingTarget" } else { "demo::Target" };
        let message = message(name, BOTH[usize::from(second)]);
        let mut wire = encoded(&message, &bytes_of::<Target>(&target(number)));
        for (at, byte) in changes {
            let length = wire.len();
            wire[at.index(length)] = byte;
        }
        if let Some(cut) = cut {
            wire.truncate(cut.index(wire.len() + 1));
        }
        if let Ok(value) = message.decode(&wire) {
            prop_assert_eq!(value.len(), size_of::<Target>());
            // What was read can be sent on, unless it is not a value of the struct.
            let mut again = Vec::new();
            if message.encode(&value, &mut again).is_ok() {
                prop_assert_eq!(message.decode(&again).unwrap(), value);
            }
        }
    }
}
