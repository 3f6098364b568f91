use proptest::prelude::*;
use slate_interfaces::{Image, ImageFormat, Transform, Verdict};
use slate_module::blackboard::interface::Interface;
use slate_module::interface;
use slate_ros_messages::{Definition, Schema, Shown, definition, encode};

use crate::ros::interfaces::{all, value};
use crate::ros::schema::any_text;

/// As recordings of old have them.
#[interface]
struct Picture {
    /// Format.
    pub format: ImageFormat,
    /// Not used.
    pub reserved: [u8; 3],
    /// Rows.
    pub data: [u8],
}

#[interface]
struct Layout {
    /// Not used.
    pub reserved: [u8; 3],
    /// Not used either.
    pub reserved2: u8,
}

#[interface]
struct Seats {
    /// How many are taken.
    pub reserved_seats: u32,
    /// Not used.
    pub reserved: u32,
}

fn fields(definition: &Definition) -> Vec<&str> {
    definition.text.lines().filter(|line| !line.starts_with('#')).collect()
}

#[test]
fn padding_fields_are_not_shown() {
    let shown = |definition: &Definition| Shown::of(definition).unwrap().unwrap().definition().clone();
    // What the compiler leaves between fields is not even in the whole message.
    assert!(Shown::of(&definition(Image::DESCRIPTOR)).unwrap().is_none());
    let picture = shown(&definition(Picture::DESCRIPTOR));
    assert_eq!(
        picture.text.lines().rev().take(4).collect::<Vec<_>>(),
        ["uint8[] data", "# Rows.", "uint8 format", "uint8 FORMAT_RGB8=1"]
    );
    let verdict = shown(&definition(Verdict::DESCRIPTOR));
    assert_eq!(
        fields(&verdict),
        [
            "uint8 STATE_RUNNING=0",
            "uint8 STATE_SUCCEEDED=1",
            "uint8 STATE_FAILED=2",
            "uint8 state",
            "uint8 OUTCOME_OTHER=0",
            "uint8 OUTCOME_GOAL_REACHED=1",
            "uint8 OUTCOME_GOAL_LEFT=2",
            "uint8 OUTCOME_GAP_KEPT=3",
            "uint8 OUTCOME_GAP_LEFT=4",
            "uint8 OUTCOME_COLLIDED=5",
            "uint8 OUTCOME_TIMED_OUT=6",
            "uint8 outcome",
            "string<=64 reason"
        ]
    );
    assert!(!verdict.text.contains("Not used") && !verdict.text.contains("memory"), "{}", verdict.text);
    assert_eq!(fields(&shown(&definition(Seats::DESCRIPTOR))), ["uint32 reserved_seats"]);
    // A message has a field, as ROS wants it.
    assert_eq!(
        fields(&shown(&definition(Layout::DESCRIPTOR))),
        ["uint8 structure_needs_at_least_one_member"]
    );
}

#[test]
fn others_have_fields_of_that_name() {
    let text = "uint8[3] reserved\nuint32 count\n".to_owned();
    let theirs = Definition { name: "other_msgs/msg/Thing".into(), text };
    assert!(Shown::of(&theirs).unwrap().is_none());
    let schema = Schema::parse_shown(&theirs.name, &theirs.text).unwrap();
    let value = schema.decode(&[0, 1, 0, 0, 1, 2, 3, 0, 4, 0, 0, 0]).unwrap();
    assert_eq!(value.to_string(), "{ reserved = [1, 2, 3], count = 4 }");
}

#[test]
fn a_message_of_what_is_shown_holds_what_the_whole_one_shows() {
    let mut reduced = 0;
    for descriptor in all().into_iter().chain([
        Picture::DESCRIPTOR,
        Layout::DESCRIPTOR,
        Seats::DESCRIPTOR,
        Transform::DESCRIPTOR,
    ]) {
        let whole = definition(descriptor);
        let looked = Schema::parse_shown(&whole.name, &whole.text).unwrap();
        let Some(shown) = Shown::of(&whole).unwrap() else { continue };
        reduced += 1;
        let alone = Schema::parse(&whole.name, &shown.definition().text).unwrap();
        for seed in 0..20 {
            let (mut message, mut left) = (Vec::new(), Vec::new());
            encode(descriptor, &value(descriptor, 2, seed), &mut message).unwrap();
            shown.encode(&message, &mut left).unwrap();
            let (one, other) = (looked.decode(&message).unwrap(), alone.decode(&left).unwrap());
            // NaNs differ from themselves.
            let without = |text: String| text.replace("{ structure_needs_at_least_one_member = 0 }", "{ }");
            assert_eq!(without(one.to_string()), without(other.to_string()), "{}", descriptor.name);
            assert!(left.len() <= message.len());
            let cut = &message[..message.len() - 5];
            assert!(shown.encode(cut, &mut Vec::new()).is_err(), "{}", descriptor.name);
        }
    }
    assert!(reduced > 10, "{reduced}");
}

/// A definition of Slate's in which fields with short names are there for the layout alone.
fn padded(text: &str) -> String {
    let line = |line: &str| match line.split_once(' ') {
        Some((of, name)) if name.len() == 1 => format!("{of} reserved\n"),
        _ => format!("{line}\n"),
    };
    text.replace("a_package/", "slate_msgs/").lines().map(line).collect()
}

#[test]
fn of_a_message_that_cannot_be_read_nothing_is_shown() {
    let text = "bool fixed\nuint8[7] reserved\n".into();
    let definition = Definition { name: "slate_msgs/msg/Thing".into(), text };
    let shown = Shown::of(&definition).unwrap().unwrap();
    let encode = |fixed: u8| shown.encode(&[&[0, 1, 0, 0, fixed][..], &[0; 7]].concat(), &mut Vec::new());
    assert_eq!(encode(1), Ok(()));
    assert!(encode(255).unwrap_err().to_string().contains("a truth value is 255"));
}

proptest! {
    /// What others write into a file under a name of Slate's is no harm.
    #[test]
    fn of_any_definition_and_message_what_is_shown_can_be_read(
        text in any_text().prop_map(|text| padded(&text)),
        rest in prop::collection::vec(prop_oneof![Just(0), Just(1), any::<u8>()], 0..200),
    ) {
        let definition = Definition { name: "slate_msgs/msg/Thing".into(), text };
        let Ok(Some(shown)) = Shown::of(&definition) else { return Ok(()) };
        let left = Schema::parse(&definition.name, &shown.definition().text).unwrap();
        let whole = Schema::parse_shown(&definition.name, &definition.text).unwrap();
        let message = [&[0, 1, 0, 0], &rest[..]].concat();
        let mut out = Vec::new();
        let made = shown.encode(&message, &mut out);
        prop_assert_eq!(made.is_ok(), whole.decode(&message).is_ok());
        prop_assert!(made.is_err() || left.decode(&out).is_ok());
    }
}
