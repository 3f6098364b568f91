use proptest::prelude::*;
use serde_json::{Value as Json, json};
use slate_ros_messages::{Primitive, Schema, Value, encode_json};

fn parsed(text: &str) -> Schema {
    Schema::parse("a_package/msg/Thing", text).unwrap()
}

fn refused(text: &str) -> String {
    Schema::parse("a_package/msg/Thing", text).unwrap_err().to_string()
}

/// Header, then what is said, each number aligned.
fn message(parts: &[&[u8]]) -> Vec<u8> {
    let mut message = vec![0, 1, 0, 0];
    for part in parts {
        let size = part.len().clamp(1, 8);
        if part.len().is_power_of_two() && part.len() <= 8 {
            message.resize(4 + (message.len() - 4).next_multiple_of(size), 0);
        }
        message.extend_from_slice(part);
    }
    message
}

/// All that a definition can say.
const TEXT: &str = "\
# A comment.
int32 LEVEL=3   # a constant
string NAME = a # b = c
string<=5 name \"a # default\"
float64[] weights [1.0, 2.0]

bool[2] flags\t# two
Part part
other/Part[<=3] parts
Header header
builtin_interfaces/Duration[1] waits
byte first
char second
string[] words
other/msg/Empty nothing
uint64 last
================================================================================
MSG: a_package/Part
int16 x
================================================================================
MSG: other/Part
float32 y -1.5
uint8[] image
===
MSG: other/msg/Empty
int8 ONLY=1
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
";

#[test]
fn a_message_from_elsewhere_is_read() {
    let message = message(&[
        &3_u32.to_le_bytes(),
        b"ab\0",
        &2_u32.to_le_bytes(),
        &1.5_f64.to_le_bytes(),
        &f64::INFINITY.to_le_bytes(),
        &[1],
        &[0],
        &(-3_i16).to_le_bytes(),
        &1_u32.to_le_bytes(),
        &0.5_f32.to_le_bytes(),
        &3_u32.to_le_bytes(),
        &[7],
        &[8],
        &[9],
        &(-1_i32).to_le_bytes(),
        &5_u32.to_le_bytes(),
        &1_u32.to_le_bytes(),
        &[0],
        &2_i32.to_le_bytes(),
        &6_u32.to_le_bytes(),
        &[200],
        &[201],
        &2_u32.to_le_bytes(),
        &0_u32.to_le_bytes(),
        &2_u32.to_le_bytes(),
        b"x",
        b"\0",
        &[0],
        &u64::MAX.to_le_bytes(),
    ]);
    let value = parsed(TEXT).decode(&message).unwrap();
    assert_eq!(
        value.to_string(),
        "{ name = \"ab\", weights = [1.5, inf], flags = [true, false], part = { x = -3 }, \
         parts = [{ y = 0.5, image = [7, 8, 9] }], \
         header = { stamp = { sec = -1, nanosec = 5 }, frame_id = \"\" }, \
         waits = [{ sec = 2, nanosec = 6 }], first = 200, second = 201, words = [\"\", \"x\"], \
         nothing = { }, last = 18446744073709551615 }"
    );
    let Some(Value::Numbers(image)) = value.at("parts/0/image") else { panic!("{value}") };
    assert_eq!((image.kind(), image.bytes()), (Primitive::U8, &[7_u8, 8, 9][..]));
    assert_eq!(value.at("weights/1").unwrap().as_f64(), Some(f64::INFINITY));
    assert_eq!(value.at("header/stamp/sec").unwrap().as_integer(), Some(-1));
    assert_eq!(value.at("words/1").unwrap().as_str(), Some("x"));
    assert_eq!(value.at("words/2"), None);
    assert_eq!(value.at("weights/1/2"), None);
    let json = serde_json::to_string(value.get("parts").unwrap()).unwrap();
    assert_eq!(json, r#"[{"y":0.5,"image":[7,8,9]}]"#);
}

#[test]
fn a_definition_may_begin_with_its_own_name() {
    let schema = parsed("MSG: a_package/Thing\nint8 x\n");
    assert_eq!(schema.decode(&[0, 1, 0, 0, 0xff]).unwrap().to_string(), "{ x = -1 }");
}

#[test]
fn definitions_that_can_not_be_read_are_refused_in_words() {
    let line = |number: usize| format!("line {number} of the definition of a_package/msg/Thing: ");
    assert_eq!(
        refused("int8 x\nwstring name"),
        line(2) + "a `wstring` can't be read: implementations of ROS disagree how it lies in a message"
    );
    assert!(refused("wstring<=3[] name").contains("a `wstring` can't be read"));
    assert_eq!(refused("other/Part x"), line(1) + "`other/Part` is not defined in the text");
    assert_eq!(refused("int8"), line(1) + "expected a type and a name, not `int8`");
    assert_eq!(refused("int8 a-b"), line(1) + "expected a type and a name, not `int8 a-b`");
    assert_eq!(refused("int8[0] x"), line(1) + "`0` is not a number of items");
    assert_eq!(refused("int8[-1] x"), line(1) + "`-1` is not a number of items");
    assert_eq!(refused("int8[<=x] x"), line(1) + "`x` is not a number of items");
    assert_eq!(refused("int8<=3 x"), line(1) + "unknown type `int8<=3`");
    assert_eq!(refused("int8 x\n===\nint8 y"), line(3) + "expected `MSG: package/Name`, not `int8 y`");
    assert_eq!(refused("int8 x\nMSG: a/B"), line(2) + "`MSG:` stands without a line of `=` before it");
    let own = line(1) + "messages stand in themselves, or more than 32 deep";
    assert_eq!(refused("Thing[] x"), own);
    assert_eq!(refused("B x\n===\nMSG: a_package/B\nThing y"), own);
}

/// A message that stands so many messages deep, each with two of the next.
fn deep(levels: usize) -> String {
    let mut text = String::from("L0 a\n");
    for i in 0..levels {
        text += &format!("===\nMSG: a_package/L{i}\nL{} a\nL{} b\n", i + 1, i + 1);
    }
    text + &format!("===\nMSG: a_package/L{levels}\nbool x\n")
}

#[test]
fn messages_may_be_deep_but_not_endless() {
    let schema = parsed(&deep(30));
    // 2^30 values would be in it.
    let error = schema.decode(&message(&[&[1; 1000]])).unwrap_err().to_string();
    assert!(error.contains("more values than bytes") || error.contains("should follow"), "{error}");
    assert!(refused(&deep(40)).contains("more than 32 deep"));
    assert!(refused(&deep(20_000)).contains("more than 32 deep"));
}

#[test]
fn lengths_that_a_message_only_claims_take_no_memory() {
    for text in [
        "float64[] x",
        "string[] x",
        "string x",
        "uint8[4000000000] x",
        "string[4000000000] x",
        "Part[] x\n===\nMSG: a_package/Part\nint8 y",
    ] {
        let error = parsed(text).decode(&message(&[&[0xff; 4], &[0xff; 64]])).unwrap_err();
        assert!(
            error.to_string().contains("should follow") || error.to_string().contains("more values"),
            "{text}: {error}"
        );
    }
}

/// How many values a value is made of; a list of numbers is one.
fn count(value: &Value) -> usize {
    match value {
        Value::List(items) => 1 + items.iter().map(count).sum::<usize>(),
        Value::Map(map) => 1 + map.iter().map(|(_, value)| count(value)).sum::<usize>(),
        _ => 1,
    }
}

/// Definitions, most of which can be read.
pub fn any_text() -> impl Strategy<Value = String> {
    let of = prop::sample::select(vec![
        "bool",
        "uint8",
        "int16",
        "float32",
        "float64",
        "string",
        "string<=4",
        "A",
        "B",
        "other/C",
        "Header",
        "wstring",
        "builtin_interfaces/Time",
    ]);
    let suffix = prop::sample::select(vec!["", "[]", "[3]", "[<=2]", "[0]"]);
    let rest = prop::sample::select(vec!["", "", "", " 1", "=5", " # x", "["]);
    let field = (of, suffix, "[a-z]{1,3}", rest)
        .prop_map(|(of, suffix, name, rest)| format!("{of}{suffix} {name}{rest}\n"));
    let fields = || prop::collection::vec(field.clone(), 0..4).prop_map(|fields| fields.concat());
    (fields(), fields(), fields(), fields()).prop_map(|(own, a, b, c)| {
        format!("{own}===\nMSG: a_package/A\n{a}===\nMSG: a_package/B\n{b}===\nMSG: other/C\n{c}")
    })
}

proptest! {
    #[test]
    fn any_text_is_a_definition_or_refused(text: String) {
        let _ = Schema::parse("a/msg/B", &text);
    }

    #[test]
    fn any_message_of_any_definition_is_read_or_refused(
        text in any_text(), big: bool, rest in prop::collection::vec(prop_oneof![Just(0), Just(1), any::<u8>()], 0..200),
    ) {
        if let Ok(schema) = Schema::parse("a_package/msg/Thing", &text) {
            let message = [&[0, u8::from(!big), 0, 0], &rest[..]].concat();
            if let Ok(value) = schema.decode(&message) {
                prop_assert!(count(&value) <= message.len());
                let _ = value.to_string();
            }
        }
    }
}

#[test]
fn a_message_is_made_of_a_value_without_types() {
    let text = "bool on\nint8 small\nuint64 large\nfloat32 ratio\nfloat64 number\nstring name\nint16[] list\nfloat64[2] pair\n\
                Inner inner\nInner[] all\nEmpty nothing\n===\nMSG: a/Inner\nstring[] words\nbuiltin_interfaces/Time stamp\n\
                ===\nMSG: a/Empty\n";
    let schema = Schema::parse("a/msg/Outer", text).unwrap();
    let names: Vec<_> = schema.field_names().collect();
    assert_eq!(names[..3], ["on", "small", "large"]);
    let again = |value: &Json| {
        let message = encode_json(&schema, value).unwrap();
        serde_json::to_value(schema.decode(&message).unwrap()).unwrap()
    };
    let full = json!({
        "on": true, "small": -128, "large": u64::MAX, "ratio": 0.5, "number": -1e300, "name": "größer",
        "list": [1, -2, 3], "pair": [1.5, 2.5],
        "inner": { "words": ["", "b"], "stamp": { "sec": -1, "nanosec": 5 } },
        "all": [{ "words": [], "stamp": { "sec": 1, "nanosec": 2 } }], "nothing": {},
    });
    assert_eq!(again(&full), full);
    let empty = again(&json!({}));
    assert_eq!((&empty["name"], &empty["pair"], &empty["all"]), (&json!(""), &json!([0.0, 0.0]), &json!([])));
    // What is not a number stays none.
    assert_eq!(again(&json!({ "number": null }))["number"], Json::Null);
    let wrong = [
        (json!({ "of": 1 }), "`of` of the message does not exist; a/Outer has on, small"),
        (json!({ "inner": { "word": 1 } }), "`inner.word` of the message does not exist"),
        (json!({ "small": 128 }), "`small` of the message is a int8, found 128"),
        (json!({ "large": -1 }), "`large` of the message is a uint64, found -1"),
        (json!({ "on": 1 }), "`on` of the message is true or false, found 1"),
        (json!({ "name": 1 }), "`name` of the message is a text"),
        (json!({ "list": 1 }), "`list` of the message is a list"),
        (json!({ "pair": [1.0] }), "`pair` of the message has 2 items, found 1"),
        (json!({ "inner": 1 }), "`inner` of the message is a message, found 1"),
        (json!(1), "is a message, found 1"),
    ];
    for (value, words) in wrong {
        let error = encode_json(&schema, &value).unwrap_err().to_string();
        assert!(error.contains(words), "{value}: {error}");
    }
}
