//! The address space: what can be read and set by URL, down to fields.
#![cfg(not(any(loom, feature = "shuttle")))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::sample;

use std::sync::Arc;

use proptest::prelude::*;
use sample::{FIELDS, SAMPLE, SIZE};
use slate_blackboard::channel::Budget;
use slate_blackboard::interface::{AccessError, Interface, Value};
use slate_blackboard::message::Mailbox;
use slate_blackboard::{Access, Board, BoardError, Carrier, Property, Store, Url, nearest_names};

const STORE: Store = Store { capacity: 4, depth: 1, budget: Budget { latest: 1, queues: 0, window: 0 } };

fn add(board: &Board, path: &str, access: Access) -> Arc<Property> {
    board.add_channel(path, "A sample.", &SAMPLE, STORE, access).unwrap()
}

/// A parameter `drive/limits`, an output `drive/state` and an input `gate/limits` that is linked to the former.
fn board() -> Board {
    let board = Board::new("base");
    add(&board, "drive/limits", Access::Setting);
    add(&board, "drive/state", Access::Output);
    board.add_alias("gate/limits", "drive/limits").unwrap();
    board
}

fn read(board: &Board, path: &str) -> Option<Value> {
    board.read(path).unwrap().map(|(value, _)| value)
}

fn url(board: &Board, text: &str) -> Result<(String, String), BoardError> {
    board.resolve(&Url::parse(text).unwrap()).map(|(property, field)| (property.path().to_owned(), field))
}

#[test]
fn a_property_knows_what_it_is_for() {
    let property = add(&board(), "drive/more", Access::Setting);
    assert_eq!((property.path(), property.doc()), ("drive/more", "A sample."));
    assert_eq!((property.descriptor().name, property.access()), ("Sample", Access::Setting));
    assert!(matches!(property.carrier(), Carrier::Channel(_)) && property.channel().is_some());
}

#[test]
fn value_set_by_path_is_read_by_path() {
    let board = board();
    assert_eq!(read(&board, "drive/limits"), None, "nobody has written it");
    let first = board.write("drive/limits/point/x", &Value::Float(2.5), 10).unwrap();
    let tail = Value::List(vec![Value::Integer(1), Value::Integer(2)]);
    let second = board.write("drive/limits/tail", &tail, 20).unwrap();
    assert_eq!([(first.sequence, first.time), (second.sequence, second.time)], [(1, 10), (2, 20)]);
    assert_eq!(read(&board, "drive/limits/point/x"), Some(Value::Float(2.5)), "the other field stays");
    assert_eq!(read(&board, "drive/limits/tail/1"), Some(Value::Integer(2)));
    assert_eq!(read(&board, "drive/limits/tail/2"), None, "there is no third item");
    let whole = board.read("drive/limits").unwrap().unwrap();
    assert_eq!((whole.0.get("tail"), whole.1), (Some(&tail), second));
}

#[test]
fn a_linked_input_is_another_name_of_what_it_reads() {
    let board = board();
    board.write("gate/limits/count", &Value::Integer(3), 0).unwrap();
    assert_eq!(read(&board, "drive/limits/count"), Some(Value::Integer(3)));
    assert_eq!(read(&board, "gate/limits/count"), Some(Value::Integer(3)));
    // A link may lead to a field.
    board.add_alias("gate/speed", "drive/limits/point").unwrap();
    board.write("gate/speed/x", &Value::Float(1.0), 0).unwrap();
    assert_eq!(read(&board, "drive/limits/point/x"), Some(Value::Float(1.0)));
    assert_eq!(board.aliases()[0], ("gate/limits".into(), "drive/limits".into()));
    let paths: Vec<_> = board.properties().iter().map(|property| property.path().to_owned()).collect();
    assert_eq!(paths, ["drive/limits", "drive/state"]);
}

#[test]
fn links_in_a_circle_lead_nowhere() {
    let board = board();
    board.add_alias("a", "b").unwrap();
    board.add_alias("b", "a").unwrap();
    assert!(matches!(board.find("a/x"), Err(BoardError::Unknown { .. })));
}

#[test]
fn a_url_leads_to_a_property_of_this_agent() {
    let board = board();
    let expected = Ok(("drive/limits".into(), "point/x".into()));
    for text in ["slate://base/drive/limits/point/x", "/drive/limits/point/x", "gate/limits/point/x"] {
        assert_eq!(url(&board, text), expected, "{text}");
    }
    let error = url(&board, "slate://other/drive/limits").unwrap_err();
    assert_eq!(error.to_string(), "slate://other/drive/limits belongs to another agent than base");
    assert!(matches!(error, BoardError::OtherAgent { .. }));
}

#[test]
fn an_unknown_path_names_the_nearest() {
    let error = board().find("drive/limit").unwrap_err();
    assert_eq!(error.to_string(), "no property at /drive/limit; nearest: drive/limits");
    let error = board().find("drve/limits/point/x").unwrap_err();
    assert_eq!(error.to_string(), "no property at /drve/limits/point/x; nearest: drive/limits, gate/limits");
    let error = board().find("camera/image").unwrap_err();
    assert_eq!(error.to_string(), "no property at /camera/image");
    let BoardError::Unknown { near, .. } = board().find(&vec!["drve"; 100_000].join("/")).unwrap_err() else {
        panic!("it is not there")
    };
    assert!(near.iter().all(|near| near.starts_with("drive/")) && !near.is_empty(), "{near:?}");
    assert_eq!(nearest_names("gain", ["grain", "gains", "speed", "again", "pain"].into_iter()).len(), 3);
    assert_eq!(nearest_names("gain", ["main", "gain"].into_iter()), ["gain", "main"], "the best comes first");
}

#[test]
fn a_former_name_leads_to_the_present_one() {
    let parameters = ["robot_radius", "inflation_margin", "bertha"];
    assert_eq!(nearest_names("berth", parameters.into_iter()), ["inflation_margin"]);
    assert_eq!(nearest_names("berth", ["bertha"].into_iter()), ["bertha"], "of another module");
    let ports = ["r2/pose_estimator/initial_pose", "r2/pose_estimator/pose"];
    assert_eq!(
        nearest_names("r2/pose_estimator/place", ports.into_iter()),
        ["r2/pose_estimator/initial_pose"]
    );
}

#[test]
fn an_unknown_field_names_those_there_are() {
    let error = board().read("drive/limits/point/w").unwrap_err();
    assert_eq!(error.to_string(), "/drive/limits: Point has no field `w`; it has x, y, z");
}

#[test]
fn an_index_beyond_the_items_is_nothing() {
    let board = board();
    board.write("drive/limits/small", &Value::Integer(1), 0).unwrap();
    assert_eq!(read(&board, "drive/limits/tail/4000000000"), None);
    for index in [u64::MAX, u64::MAX / 2 + 1, 1 << 62] {
        // Whether it is nothing or an error, it must not end the process.
        assert!(!matches!(board.read(&format!("drive/limits/tail/{index}")), Ok(Some(_))));
    }
}

#[test]
fn a_path_is_given_once() {
    let board = board();
    for path in ["drive/limits", "gate/limits"] {
        let again = board.add_channel(path, "", &SAMPLE, STORE, Access::Output);
        assert_eq!(again.err(), Some(BoardError::Exists { url: format!("/{path}") }));
        assert_eq!(board.add_alias(path, "x"), Err(BoardError::Exists { url: format!("/{path}") }));
    }
}

#[test]
fn written_property_cannot_be_set() {
    let board = board();
    let error = board.write("drive/state/count", &Value::Integer(1), 0).unwrap_err();
    assert_eq!(error, BoardError::ReadOnly { url: "/drive/state".into() });
    let (state, _) = board.find("drive/state").unwrap();
    assert_eq!(state.set_bytes(&[0; SIZE], 0), Err(error));
    // The host keeps the writer of what it sets, so no module can have it.
    assert!(board.find("drive/limits").unwrap().0.channel().unwrap().writer().is_err());
    let mut writer = state.channel().unwrap().writer().unwrap();
    writer.write(&[1; SIZE], 0, 5).unwrap();
    let (value, stamp) = board.read("drive/state/small").unwrap().unwrap();
    assert_eq!((value, stamp.time), (Value::Integer(1), 5));
}

#[test]
fn messages_are_no_values() {
    let board = board();
    let mailbox = Mailbox::new(SAMPLE.shape(0), 1, 1);
    let property = board.add_mailbox("drive/commands", "", &SAMPLE, mailbox).unwrap();
    assert_eq!((property.access(), property.newest()), (Access::Messages, Ok(None)));
    assert_eq!(read(&board, "drive/commands"), None);
    let read_only = BoardError::ReadOnly { url: "/drive/commands".into() };
    assert_eq!(board.write("drive/commands/count", &Value::Integer(1), 0), Err(read_only));
}

#[test]
fn a_setting_that_does_not_fit_changes_nothing() {
    let board = board();
    board.write("drive/limits/small", &Value::Integer(1), 0).unwrap();
    let error = board.write("drive/limits/small", &Value::Integer(300), 0).unwrap_err();
    assert_eq!(error.to_string(), "/drive/limits: `small` is u8 and can't hold 300 exactly");
    let long = Value::List(vec![Value::Integer(0); 5]);
    let error = board.write("drive/limits/tail", &long, 0).unwrap_err();
    assert!(matches!(error, BoardError::Access { error: AccessError::NotExact { .. }, .. }), "{error}");
    let (value, stamp) = board.read("drive/limits/small").unwrap().unwrap();
    assert_eq!((value, stamp.sequence), (Value::Integer(1), 1));
}

#[test]
fn whole_values_are_set_as_memory() {
    let (limits, _) = board().find("drive/limits").unwrap();
    for length in [0, SIZE - 1, SIZE + 2 * 5] {
        let error = limits.set_bytes(&vec![0; length], 0).unwrap_err();
        assert!(matches!(error, BoardError::Access { .. }), "{length} bytes: {error}");
    }
    let stamp = limits.set_bytes(&[7; SIZE + 4], 9).unwrap();
    let (bytes, items, newest) = limits.newest().unwrap().unwrap();
    assert_eq!((&bytes[..SIZE + 4], items, newest), (&[7; SIZE + 4][..], 2, stamp));
}

#[test]
fn looking_takes_one_reader_of_the_budget() {
    let board = board();
    board.write("drive/limits/small", &Value::Integer(1), 0).unwrap();
    let (limits, _) = board.find("drive/limits").unwrap();
    assert!(limits.channel().unwrap().latest().is_err(), "the board has the only handle");
    let (state, _) = board.find("drive/state").unwrap();
    let reader = state.channel().unwrap().latest().unwrap();
    let error = board.read("drive/state").unwrap_err();
    assert_eq!(error.to_string(), "/drive/state: no reader handle is left of 1");
    drop(reader);
    assert_eq!(read(&board, "drive/state"), None);
}

#[test]
fn an_output_knows_whether_anybody_watches() {
    let (state, _) = board().find("drive/state").unwrap();
    assert!(!state.is_watched());
    let (first, second) = (state.watch(), state.watch());
    assert_eq!(first.property().path(), "drive/state");
    drop(first);
    assert!(state.is_watched());
    drop(second);
    assert!(!state.is_watched());
}

#[test]
fn nothing_is_a_value_too() {
    let board = Board::new("base");
    board.add_channel("bumper/hit", "", <()>::DESCRIPTOR, STORE, Access::Setting).unwrap();
    assert_eq!(board.write("bumper/hit", &Value::Table(vec![]), 3).unwrap().sequence, 1);
    assert_eq!(read(&board, "bumper/hit"), Some(Value::Table(vec![])));
}

#[test]
fn a_relative_url_stands_in_its_scope() {
    let relative = Url::parse("pose/x").unwrap();
    assert_eq!(
        (relative.path_in("localizer"), relative.path_in("")),
        ("localizer/pose/x".into(), "pose/x".into())
    );
    assert_eq!(Url::parse("/pose").unwrap().path_in("localizer"), "pose");
    let full = Url::parse("slate://base/pose").unwrap();
    assert_eq!((full.agent(), full.path_in("localizer")), (Some("base"), "pose".into()));
}

#[test]
fn invalid_url_is_refused_with_reason() {
    for (text, reason) in [
        ("", "names"),
        ("/", "names"),
        ("a//b", "names"),
        ("a/", "names"),
        ("a b", "names"),
        ("ä", "names"),
        ("../a", "names"),
        ("slate://", "expected a path"),
        ("slate://base", "expected a path"),
        ("slate://base/", "names"),
        ("slate:///a", "names"),
        ("ros2://base/a", "scheme"),
    ] {
        let error = Url::parse(text).unwrap_err();
        assert_eq!(error.text, text);
        assert!(error.to_string().contains(reason), "{error}");
    }
}

proptest! {
    #[test]
    fn a_url_is_printed_as_it_is_read(text in "(slate://[a-z]{1,3}/|/|)[a-zA-Z0-9_-]{1,3}(/[a-z]{1,2}){0,3}") {
        prop_assert_eq!(Url::parse(&text).unwrap().to_string(), text);
    }

    #[test]
    fn no_text_breaks_the_address_space(text in "\\PC{0,20}", known in 0..FIELDS.len()) {
        let board = board();
        board.write("drive/limits/small", &Value::Integer(1), 0).unwrap();
        let _ = board.read(&text);
        let _ = board.read(&format!("gate/limits/{}/{text}", FIELDS[known].name));
        if let Ok(url) = Url::parse(&text) {
            let _ = board.resolve(&url);
        }
    }
}

/// Keeps what it sees of all properties but one.
#[derive(Default)]
struct Witness(std::sync::Mutex<Vec<(Vec<u8>, u64)>>);

struct Eye(Arc<Witness>);

impl slate_blackboard::Taps for Eye {
    fn tap(&self, property: &Property) -> Option<Arc<dyn slate_blackboard::channel::Tap>> {
        (property.path() != "private/value").then(|| Arc::clone(&self.0) as _)
    }
}

impl slate_blackboard::channel::Tap for Witness {
    fn wrote(&self, bytes: &[u8], _: usize, stamp: slate_blackboard::Stamp) {
        self.0.lock().unwrap().push((bytes.to_vec(), stamp.sequence));
    }
}

#[test]
fn a_tap_sees_every_value_of_the_properties_it_is_for() {
    let board = Board::new("base");
    let witness = Arc::new(Witness::default());
    board.tap_with(Arc::new(Eye(Arc::clone(&witness))));
    let (open, private) =
        (add(&board, "open/value", Access::Setting), add(&board, "private/value", Access::Setting));
    for number in 1..=3_u8 {
        open.set_bytes(&[number; SIZE], 0).unwrap();
        private.set_bytes(&[number; SIZE], 0).unwrap();
    }
    let seen = witness.0.lock().unwrap().clone();
    assert_eq!(seen, [1, 2, 3].map(|number| (vec![number; SIZE], u64::from(number))));
}
