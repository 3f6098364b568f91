use proptest::prelude::*;
use slate_module::blackboard::interface::{Value as Own, View};
use slate_ros_messages::{Described, Schema, Value, definition, encode};

use crate::ros::codec::any_interface;
use crate::ros::interfaces::value;

/// Whether a value of the blackboard is what the message holds.
fn is_same(message: &Value, own: &Own) -> bool {
    let whole = |number: i128| own.as_integer() == Some(number);
    match (message, own) {
        (Value::Map(map), Own::Table(fields)) => {
            let names: Vec<_> = map.iter().map(|(name, _)| name).collect();
            let own = |wanted: &str| fields.iter().find(|(name, _)| name.as_str() == wanted);
            let is_padding = |name: &str| name.starts_with("padding_");
            map.iter().all(|(name, value)| match own(name) {
                Some((_, own)) => is_same(value, own),
                // It takes no memory.
                None => matches!(value, Value::Map(map) if map.iter().next().is_none()) || is_empty(value),
            }) && fields.iter().all(|(name, _)| is_padding(name.as_str()) || names.contains(&name.as_str()))
        }
        (Value::Numbers(numbers), Own::List(items)) => {
            numbers.len() == items.len()
                && numbers.iter().zip(items).all(|(number, own)| is_same(&number, own))
        }
        (Value::List(list), Own::List(items)) => {
            list.len() == items.len() && list.iter().zip(items).all(|(value, own)| is_same(value, own))
        }
        (Value::Text(text), Own::Text(own)) => **text == **own,
        (Value::Bool(is), Own::Bool(own)) => is == own,
        (Value::Signed(number), _) => whole((*number).into()),
        (Value::Unsigned(number), _) => whole((*number).into()),
        (Value::Single(number), Own::Float(own)) => {
            number.is_nan() && own.is_nan() || f64::from(*number) == *own
        }
        (Value::Double(number), Own::Float(own)) => number.is_nan() && own.is_nan() || number == own,
        _ => false,
    }
}

fn is_empty(value: &Value) -> bool {
    match value {
        Value::Numbers(numbers) => numbers.is_empty(),
        Value::List(items) => items.is_empty(),
        _ => false,
    }
}

proptest! {
    /// A message can be read from its definition alone.
    #[test]
    fn defined_message_is_value_with_same_fields(
        descriptor in any_interface(), values in prop::collection::vec((0..4_usize, any::<u64>()), 1..4),
    ) {
        let definition = definition(descriptor);
        let schema = || Schema::parse(&definition.name, &definition.text).unwrap();
        let messages: Vec<_> = values.iter().map(|(tail, seed)| {
            let mut message = Vec::new();
            encode(descriptor, &value(descriptor, *tail, *seed), &mut message).unwrap();
            message
        }).collect();
        let mut described = Described::new(&definition.name, schema()).unwrap();
        for message in &messages {
            described.note(message).unwrap();
        }
        let (made, capacity) = described.interface().unwrap();
        prop_assert!(made.size.is_multiple_of(made.align));
        for message in &messages {
            let bytes = described.decode(message).unwrap();
            let item = made.tail().map_or(0, |kind| kind.size());
            let items = (bytes.len() - made.size).checked_div(item).unwrap_or(0);
            prop_assert!(items <= capacity);
            let own = View::new(made, &bytes, items).unwrap().value();
            let wanted = schema().decode(message).unwrap();
            prop_assert!(is_same(&wanted, &own), "{wanted} is not {own:?}");
        }
    }
}

fn definition_line() -> impl Strategy<Value = String> {
    let kinds = ["uint8", "float64", "string", "bool", "int16", "test/Other", "string<=3", "Header"];
    let counts = ["", "[]", "[0]", "[3]", "[<=2]", "[70000000]"];
    (prop::sample::select(kinds.to_vec()), prop::sample::select(counts.to_vec()), 0..4_u8)
        .prop_map(|(kind, count, name)| format!("{kind}{count} f{name}\n"))
}

proptest! {
    /// Definitions and messages come from anywhere.
    #[test]
    fn hostile_definitions_and_messages_are_refused_or_are_values(
        own in prop::collection::vec(definition_line(), 0..6), other in prop::collection::vec(definition_line(), 0..3),
        messages in prop::collection::vec(prop::collection::vec(0..4_u8, 0..60), 1..3),
    ) {
        let separator = "=".repeat(80);
        let text = format!("{}{separator}\nMSG: test/Other\n{}", own.concat(), other.concat().replace("test/Other", "int8"));
        let Ok(schema) = Schema::parse("test/msg/Own", &text) else { return Ok(()) };
        let mut described = Described::new("test/msg/Own", schema).unwrap();
        let messages: Vec<_> = messages.into_iter().map(|rest| [&[0, 1, 0, 0], &rest[..]].concat()).collect();
        let noted: Vec<_> = messages.iter().filter(|message| described.note(message).is_ok()).collect();
        let Ok((made, _)) = described.interface() else { return Ok(()) };
        for message in noted {
            let bytes = described.decode(message).unwrap();
            let item = made.tail().map_or(0, |kind| kind.size());
            let items = (bytes.len() - made.size).checked_div(item).unwrap_or(0);
            prop_assert!(View::new(made, &bytes, items).is_some());
        }
    }
}

#[test]
fn the_same_interface_is_made_once() {
    let text = "string name\nfloat64[] ranges\n";
    let make = || {
        let mut described =
            Described::new("test/msg/Same", Schema::parse("test/msg/Same", text).unwrap()).unwrap();
        described.interface().unwrap().0
    };
    assert!(std::ptr::eq(make(), make()));
}

#[test]
fn a_list_of_many_numbers_is_the_tail() {
    let text = "string name\nuint8[] pixels\nuint8 kind\n";
    let mut described =
        Described::new("test/msg/Picture", Schema::parse("test/msg/Picture", text).unwrap()).unwrap();
    let mut message = vec![0, 1, 0, 0, 2, 0, 0, 0, b'a', 0, 0, 0];
    message.extend(5000_u32.to_le_bytes());
    message.extend((0..5000).map(|pixel| pixel as u8));
    message.push(7);
    described.note(&message).unwrap();
    let (made, capacity) = described.interface().unwrap();
    assert_eq!((made.name, capacity), ("Picture", 5000));
    let bytes = described.decode(&message).unwrap();
    let view = View::new(made, &bytes, 5000).unwrap().value();
    assert_eq!(view.get("kind").and_then(Own::as_integer), Some(7));
    assert_eq!(&bytes[made.size..made.size + 3], [0, 1, 2]);
}

#[test]
fn a_message_with_more_fields_than_anybody_means_is_refused() {
    // Each message has the next one a hundred times.
    let mut text = String::new();
    for level in 0..8 {
        for field in 0..100 {
            text += &format!("test/M{} f{field}\n", level + 1);
        }
        text += &format!(
            "================================================================================\nMSG: test/M{}\n",
            level + 1
        );
    }
    text += "uint8 x\n";
    let schema = Schema::parse("test/msg/M0", &text).unwrap();
    assert!(Described::new("test/msg/M0", schema).unwrap_err().contains("fields"));
}
