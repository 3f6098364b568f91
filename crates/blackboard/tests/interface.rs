//! Use of values by tools that learn the type from a descriptor.
#![cfg(not(any(loom, feature = "shuttle")))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::sample;

use proptest::prelude::*;
use sample::{FIELDS, MODE, POINT, SAMPLE, SIZE};
use serde_json::json;
use slate_blackboard::interface::{
    AccessError, Bool, CanonicalForm, Constant, Enumeration, Field, Kind, Optional, Sequence, Text, Value,
    View, edit, find, schema_hash,
};

fn text(text: &str) -> Value {
    Value::Text(text.into())
}

fn table(entries: &[(&str, Value)]) -> Value {
    Value::Table(entries.iter().map(|(name, value)| ((*name).into(), value.clone())).collect())
}

/// Zeros with these fields set; how many tail items there are.
fn value_with(fields: &[(&str, Value)]) -> (Vec<u8>, usize) {
    let mut bytes = vec![0; SIZE + 8];
    let items =
        fields.iter().fold(0, |items, (path, value)| edit(&SAMPLE, &mut bytes, items, path, value).unwrap());
    (bytes, items)
}

fn json_of(bytes: &[u8], items: usize) -> serde_json::Value {
    serde_json::to_value(View::new(&SAMPLE, bytes, items).unwrap()).unwrap()
}

/// What an empty value holds after one field was set.
fn after(path: &str, value: Value) -> Result<Option<Value>, AccessError> {
    let mut bytes = vec![0; SIZE + 8];
    let items = edit(&SAMPLE, &mut bytes, 0, path, &value)?;
    Ok(View::new(&SAMPLE, &bytes, items).unwrap().at(&find(&SAMPLE, path)?))
}

#[test]
fn a_value_is_json_with_the_names_of_its_fields() {
    let (bytes, items) = value_with(&[
        ("flag", Value::Bool(true)),
        ("long", Value::Integer(i64::MIN.into())),
        ("big", Value::Integer(u64::MAX.into())),
        ("wide", Value::Float(0.1)),
        ("mode", text("fast")),
        ("name", text("ä robot")),
        ("maybe", Value::Integer(3)),
        ("point", table(&[("x", Value::Float(1.5)), ("y", Value::Integer(-2))])),
        ("points", Value::List(vec![table(&[]), table(&[("x", Value::Integer(7))])])),
        ("pair", Value::List(vec![Value::Integer(1), Value::Integer(-1)])),
        ("tail", Value::List(vec![Value::Integer(9), Value::Integer(65_535)])),
    ]);
    let expected = json!({
        "flag": true, "small": 0, "signed": 0, "count": 0, "big": u64::MAX, "long": i64::MIN, "wide": 0.1,
        "narrow": 0.0, "mode": "FAST", "spare": [0, 0, 0], "name": "ä robot", "maybe": 3.0,
        "point": {"x": 1.5, "y": -2, "z": 0}, "points": [{"x": 0.0, "y": 0, "z": 0}, {"x": 7.0, "y": 0, "z": 0}],
        "pair": [1, -1], "tail": [9, 65_535],
    });
    assert_eq!(json_of(&bytes, items), expected);
}

#[test]
fn fields_stand_in_the_order_of_the_interface() {
    let bytes = [0; SIZE];
    let json = serde_json::to_string(&View::new(&SAMPLE, &bytes, 0).unwrap()).unwrap();
    let places: Vec<_> = FIELDS.iter().map(|field| json.find(&format!("\"{}\":", field.name))).collect();
    assert!(places.is_sorted() && places[0].is_some());
}

#[test]
fn a_path_leads_to_nested_fields_and_items() {
    let (bytes, items) = value_with(&[
        ("points", Value::List(vec![table(&[]), table(&[("y", Value::Integer(5))])])),
        ("tail", Value::List(vec![Value::Integer(1), Value::Integer(2)])),
    ]);
    let view = View::new(&SAMPLE, &bytes, items).unwrap();
    let at = |path| view.at(&find(&SAMPLE, path).unwrap());
    assert_eq!(at("points/1/y"), Some(Value::Integer(5)));
    assert_eq!(at("point/x"), Some(Value::Float(0.0)));
    assert_eq!(at("tail/1"), Some(Value::Integer(2)));
    assert_eq!(at("maybe"), Some(Value::Null));
    // The index is possible, but the value has fewer items.
    assert_eq!((at("points/2/y"), at("tail/2")), (None, None));
}

#[test]
fn a_path_that_leads_nowhere_names_what_is_there() {
    for (path, known) in [
        ("", "flag, small"),
        ("flags", "flag, small"),
        ("point/w", "x, y, z"),
        ("point/x/0", "indices"),
        ("points/3", "indices"),
        ("points/-1", "indices"),
        ("pair/2", "indices"),
        ("pair/first", "indices"),
        ("flag/", "indices"),
    ] {
        let error = find(&SAMPLE, path).unwrap_err();
        assert!(error.to_string().contains(known), "{path}: {error}");
    }
}

#[test]
fn numbers_convert_where_that_is_exact() {
    let integer = Value::Integer;
    let float = Value::Float;
    for (path, value, expected) in [
        ("small", float(255.0), integer(255)),
        ("signed", integer(-32_768), integer(-32_768)),
        ("count", float(4_294_967_295.0), integer(4_294_967_295)),
        ("wide", integer(1 << 53), float(9_007_199_254_740_992.0)),
        ("narrow", float(0.1), float(f64::from(0.1_f32))),
        ("mode", integer(77), integer(77)),
        ("mode", integer(1), text("FAST")),
        ("maybe", Value::Null, Value::Null),
    ] {
        assert_eq!(after(path, value.clone()), Ok(Some(expected)), "{path} = {value}");
    }
    for (path, value) in [
        ("small", integer(256)),
        ("small", integer(-1)),
        ("small", float(0.5)),
        ("count", float(f64::NAN)),
        ("big", float(f64::INFINITY)),
        ("big", integer(i128::MAX)),
        ("long", float(1e300)),
        ("wide", integer((1 << 53) + 1)),
        ("mode", integer(256)),
        ("name", text("thirteen byte")),
        ("points", Value::List(vec![table(&[]); 4])),
        ("tail", Value::List(vec![integer(0); 5])),
    ] {
        let error = after(path, value.clone()).unwrap_err();
        assert!(matches!(error, AccessError::NotExact { .. }), "{path} = {value}: {error}");
    }
}

#[test]
fn a_value_of_another_type_is_refused_in_words() {
    for (path, value, expected) in [
        ("flag", Value::Integer(1), "`flag` is bool, not a whole number (1)"),
        ("wide", text("1"), "`wide` is f64, not text (\"1\")"),
        ("mode", text("flying"), "`mode` is one of SLOW, FAST, not text (\"flying\")"),
        ("name", Value::Null, "`name` is text of at most 12 bytes, not nothing (none)"),
        ("pair", Value::List(vec![]), "`pair` is 2 x i32, not a list ([])"),
        ("point", Value::List(vec![]), "`point` is Point, not a list ([])"),
        ("points", table(&[]), "`points` is at most 3 x Point, not a table ({ })"),
        ("pair", Value::List(vec![Value::Integer(1), Value::Null]), "`pair/1` is i32, not nothing (none)"),
        ("point", table(&[("y", Value::Bool(true))]), "`point/y` is i16, not a truth value (true)"),
    ] {
        assert_eq!(after(path, value).unwrap_err().to_string(), expected);
    }
}

#[test]
fn an_edit_that_fails_changes_nothing() {
    let (mut bytes, items) = value_with(&[("count", Value::Integer(7)), ("name", text("before"))]);
    let before = bytes.clone();
    let wrong = table(&[("count", Value::Integer(8)), ("name", text("after")), ("pair", Value::Null)]);
    assert!(edit(&SAMPLE, &mut bytes, items, "", &wrong).is_err());
    assert!(
        edit(&SAMPLE, &mut bytes, items, "points/0/x", &Value::Float(1.0)).is_err(),
        "there is no such item"
    );
    assert_eq!(bytes, before);
}

#[test]
fn a_table_may_leave_fields_out() {
    let (mut bytes, items) = value_with(&[("count", Value::Integer(7)), ("point/x", Value::Float(2.0))]);
    edit(&SAMPLE, &mut bytes, items, "", &table(&[("point", table(&[("z", Value::Integer(1))]))])).unwrap();
    let json = json_of(&bytes, items);
    assert_eq!((&json["count"], &json["point"]), (&json!(7), &json!({"x": 2.0, "y": 0, "z": 1})));
}

#[test]
fn a_shorter_text_leaves_nothing_of_the_longer_one() {
    let long = value_with(&[("name", text("long text")), ("name", text("ab"))]);
    assert_eq!(long, value_with(&[("name", text("ab"))]));
}

#[test]
fn formatted_text_is_cut_at_a_character() {
    use std::fmt::Write;
    let mut text = Text::<8>::new("a");
    write!(text, "{}äö", 12).unwrap();
    assert_eq!(text.as_str(), "a12äö");
    write!(text, "ü").unwrap();
    assert_eq!(text.as_str(), "a12äö");
    write!(text, "b").unwrap();
    assert_eq!(text, Text::<8>::new("a12äöb"));
}

#[test]
fn too_few_bytes_make_no_view() {
    assert!(View::new(&SAMPLE, &[0; SIZE - 1], 0).is_none());
    assert!(View::new(&SAMPLE, &[0; SIZE + 3], 2).is_none());
    assert!(View::new(&SAMPLE, &[0; SIZE + 4], 2).is_some());
}

#[test]
fn the_shape_has_room_for_the_tail() {
    let shape = SAMPLE.shape(5);
    assert_eq!((shape.size, shape.item, shape.capacity), (SIZE, 2, 5));
    // Rounded up to the alignment.
    assert_eq!(shape.bytes(5), SIZE + 16);
    assert_eq!(POINT.shape(5).capacity, 0, "there is no tail");
}

#[test]
fn the_hash_tells_every_difference_but_documentation() {
    const fn field(
        name: &'static str,
        doc: &'static str,
        unit: &'static str,
        offset: usize,
        kind: Kind,
    ) -> Field {
        Field { name, doc, unit, offset, kind }
    }
    static OTHER_MODE: Enumeration = Enumeration {
        name: "Mode",
        carrier: Kind::U8,
        constants: &[Constant { name: "SLOW", value: 1, doc: "" }],
    };
    let hash = |field| schema_hash("A", &[field]);
    let hashes = [
        hash(field("x", "", "m", 0, Kind::F64)),
        schema_hash("B", &[field("x", "", "m", 0, Kind::F64)]),
        schema_hash("A", &[]),
        hash(field("y", "", "m", 0, Kind::F64)),
        hash(field("x", "", "s", 0, Kind::F64)),
        hash(field("x", "", "m", 8, Kind::F64)),
        hash(field("x", "", "m", 0, Kind::U64)),
        hash(field("x", "", "m", 0, Kind::Text(8))),
        hash(field("x", "", "m", 0, Kind::Text(12))),
        hash(field("x", "", "m", 0, Kind::Array(&Kind::F64, 1))),
        hash(field("x", "", "m", 0, Kind::Sequence(&Kind::F64, 1))),
        hash(field("x", "", "m", 0, Kind::Nested(&POINT))),
        hash(field("x", "", "m", 0, Kind::Enumeration(&MODE))),
        hash(field("x", "", "m", 0, Kind::Enumeration(&OTHER_MODE))),
    ];
    for (i, hash) in hashes.iter().enumerate() {
        assert!(!hashes[..i].contains(hash), "{i}");
    }
    assert_eq!(hashes[0], hash(field("x", "where it is", "m", 0, Kind::F64)));
}

#[test]
fn every_nan_gets_the_same_bits() {
    let (mut bytes, items) = value_with(&[("wide", Value::Float(1.0)), ("maybe", Value::Float(2.0))]);
    let floats = CanonicalForm::new(&SAMPLE);
    let before = bytes.clone();
    assert!(floats.canonicalize(&mut bytes, items));
    assert_eq!(bytes, before, "finite numbers stay");
    let mut other = bytes.clone();
    bytes[24..32].copy_from_slice(&0x7ff8_0000_0000_0001_u64.to_ne_bytes());
    other[24..32].copy_from_slice(&0xfff0_0000_0000_0001_u64.to_ne_bytes());
    // The first item's x.
    bytes[88..92].copy_from_slice(&0x7fc0_0001_u32.to_ne_bytes());
    other[88..92].copy_from_slice(&0xffc0_0000_u32.to_ne_bytes());
    assert!(!floats.canonicalize(&mut bytes, items) && !floats.canonicalize(&mut other, items));
    assert_eq!(bytes, other);
    other[24..32].copy_from_slice(&f64::INFINITY.to_ne_bytes());
    assert!(!floats.canonicalize(&mut other, items));
    assert_eq!(other[24..32], f64::INFINITY.to_ne_bytes(), "infinity is not finite, and stays");
}

#[test]
fn typed_fields_hold_what_fits() {
    assert_eq!(Text::<4>::new("abé").as_str(), "abé");
    assert_eq!(Text::<4>::new("abcé").as_str(), "abc", "cut at a character");
    assert_eq!(Sequence::<u32, 2>::new(&[1, 2, 3])[..], [1, 2]);
    assert_eq!(Optional::<u32>::none().get(), None);
    assert_eq!(Optional::some(4_u32).get(), Some(&4));
    assert_eq!(bool::from(Bool::from(true)), Bool::TRUE.get());
}

fn any_value() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::Bool),
        any::<i128>().prop_map(Value::Integer),
        (-300..300_i128).prop_map(Value::Integer),
        any::<f64>().prop_map(Value::Float),
        ".{0,5}".prop_map(Value::Text),
    ];
    leaf.prop_recursive(3, 20, 5, |inner| {
        let name = prop::sample::select(vec!["x", "y", "flag", "name", "points", "tail", "nothing"]);
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..5).prop_map(Value::List),
            prop::collection::vec((name.prop_map(String::from), inner), 0..4).prop_map(Value::Table),
        ]
    })
}

fn any_path() -> impl Strategy<Value = String> {
    let part = prop_oneof![
        4 => (0..FIELDS.len()).prop_map(|index| FIELDS[index].name.to_owned()),
        2 => prop::sample::select(vec!["x", "y", "z"]).prop_map(String::from),
        2 => (0..5_u32).prop_map(|index| index.to_string()),
        1 => "[a-z/0-9-]{0,4}",
    ];
    prop::collection::vec(part, 0..4).prop_map(|parts| parts.join("/"))
}

proptest! {
    /// Lengths, flags, text and enumerations may be anything in a value that came over a wire.
    #[test]
    fn damaged_bytes_are_read_without_panic(bytes in prop::collection::vec(any::<u8>(), SIZE + 8), items in 0..5_usize) {
        let view = View::new(&SAMPLE, &bytes, items).unwrap();
        prop_assert!(serde_json::to_string(&view).is_ok());
        // What was read can be written, and is read again, unless text grew by the marks of its damage.
        let mut copy = vec![0; SIZE + 8];
        let value = view.value();
        if let Ok(items) = edit(&SAMPLE, &mut copy, 0, "", &value) {
            let again = View::new(&SAMPLE, &copy, items).unwrap().value();
            prop_assert_eq!(format!("{value:?}"), format!("{again:?}"));
        } else {
            prop_assert!(value.to_string().contains(char::REPLACEMENT_CHARACTER), "{}", value);
        }
        let mut canonical = bytes.clone();
        CanonicalForm::new(&SAMPLE).canonicalize(&mut canonical, items);
        prop_assert_eq!(CanonicalForm::new(&SAMPLE).canonicalize(&mut canonical.clone(), items),
            CanonicalForm::new(&SAMPLE).canonicalize(&mut canonical, items));
    }

    #[test]
    fn any_edit_of_damaged_bytes_works_or_changes_nothing(
        bytes in prop::collection::vec(any::<u8>(), SIZE + 8),
        items in 0..5_usize,
        path in any_path(),
        value in any_value(),
    ) {
        let mut edited = bytes.clone();
        match edit(&SAMPLE, &mut edited, items, &path, &value) {
            Err(error) => {
                prop_assert_eq!(edited, bytes);
                prop_assert!(!error.to_string().is_empty());
            }
            Ok(items) => {
                let view = View::new(&SAMPLE, &edited, items).unwrap();
                prop_assert!(path.is_empty() || view.at(&find(&SAMPLE, &path).unwrap()).is_some());
            }
        }
    }
}
