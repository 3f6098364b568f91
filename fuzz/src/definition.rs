//! Definitions of messages and interfaces.
//! Those of anybody's recordings, with messages, and the interfaces of a source file.

use crate::input::Input;
use crate::memory::within;
use slate_blackboard::interface::{Descriptor, Kind, View};
use slate_module::{decode_interface, encode_interface};
use slate_ros_messages as ros;
use slate_ros_messages::{Definition, Described, Schema, Shown, definition};

#[path = "../../crates/cli/src/interface/parse.rs"]
mod parse;
#[path = "../../crates/cli/src/interface/syntax_error.rs"]
mod syntax_error;
#[path = "../../crates/cli/src/interface/token.rs"]
mod token;
#[path = "../../crates/cli/src/interface/word.rs"]
mod word;

/// Name of the messages of a script.
pub const NAME: &str = "fuzz_msgs/msg/Thing";

/// A script with a definition and messages of it.
pub const MESSAGES: u8 = 0;

/// A script that is a source file.
pub const SOURCE: u8 = 1;

/// A larger value is not made, bytes: its interface says how much it would take.
const LARGEST: usize = 1 << 20;

/// Reads a script: its kind, then a definition with messages, or a source.
pub fn run(script: &[u8]) {
    let mut script = Input(script);
    match script.byte() % 2 {
        MESSAGES => messages(script),
        _ => sources(script.0),
    }
}

fn messages(mut script: Input) {
    let Ok(text) = std::str::from_utf8(script.counted()) else { return };
    let schema = match Schema::parse(NAME, text) {
        Ok(schema) => schema,
        Err(error) => return assert!(error.to_string().contains(NAME), "{error} names no definition"),
    };
    let mut messages = Vec::new();
    while !script.is_empty() {
        messages.push(script.counted());
    }
    for message in &messages {
        // A value takes some more than its bytes, as numbers in lists do not.
        let read = within((256 << 10) + 128 * message.len(), || schema.decode(message));
        assert_eq!(schema.check(message).is_ok(), read.is_ok(), "what is checked is not what is read");
        drop(read.map(|value| value.to_string()));
    }
    shown(text, &messages);
    let Ok(mut described) = Described::new(NAME, schema) else { return };
    messages.retain(|message| described.note(message).is_ok());
    let Ok((descriptor, capacity)) = described.interface() else { return };
    if descriptor.size > LARGEST {
        return;
    }
    check(descriptor);
    for message in messages {
        let bytes = described.decode(message).expect("it was noted");
        let item = descriptor.tail().map_or(0, Kind::size);
        let items = (bytes.len() - descriptor.size).checked_div(item).unwrap_or(0);
        assert!(items <= capacity, "{items} items are more than {capacity}");
        let view = View::new(descriptor, &bytes, items).expect("it is a value of its interface");
        drop(serde_json::to_string(&view.value()));
        let mut again = Vec::new();
        ros::encode(descriptor, &bytes, &mut again).expect("it is a value of its interface");
        assert_eq!(ros::decode(descriptor, &again).ok(), Some(bytes), "another value came out");
    }
}

/// Checks the same under one of Slate's names, without fields of padding.
fn shown(text: &str, messages: &[&[u8]]) {
    let own = Definition { name: "slate_msgs/msg/Thing".into(), text: text.into() };
    let Ok(Some(shown)) = Shown::of(&own) else { return };
    let left = Schema::parse(&own.name, &shown.definition().text).expect("what is left of it can be read");
    for message in messages {
        let mut out = Vec::new();
        if shown.encode(message, &mut out).is_ok() {
            let read = left.decode(&out);
            assert!(read.is_ok(), "what is left of a message can't be read: {read:?}");
        }
    }
}

fn sources(source: &[u8]) {
    let Ok(text) = std::str::from_utf8(source) else { return };
    match parse::interfaces(text) {
        Ok(found) => found.iter().for_each(|found| {
            assert!(found.line <= text.lines().count(), "line {} is not there", found.line);
            check(found.descriptor);
        }),
        Err(wrong) => assert!(
            !wrong.message.is_empty() && wrong.line <= text.lines().count().max(1),
            "line {}: {} says nothing of the file",
            wrong.line,
            wrong.message
        ),
    }
}

/// Checks that the definition can be written in the other formats.
fn check(descriptor: &'static Descriptor) {
    let own = definition(descriptor);
    Schema::parse(&own.name, &own.text).expect("what is written here can be read");
    if let Ok(bytes) = encode_interface(descriptor)
        && let Ok(again) = decode_interface(&bytes)
    {
        assert_eq!(again.hash, descriptor.hash, "another interface came out");
    }
}
