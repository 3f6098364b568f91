//! Samples, queries and key texts of Zenoh programs.
//! A sample has content, encoding and attachment. A value of its interface is written as the same again, and a refusal
//! says why.

use crate::agents::{Blob, Number};
use crate::input::Input;
use crate::memory::within;
use slate_blackboard::interface::{Descriptor, Interface, Kind, View};
use slate_interfaces::{LaserScan, Pose2};
use slate_network::{Decoded, InputSource, Payload, SampleAttachment, alive_agent, alive_key, encoding};
use slate_ros_messages as ros;

/// The interfaces of a script, by number.
pub const INTERFACES: [&Descriptor; 4] =
    [Pose2::DESCRIPTOR, LaserScan::DESCRIPTOR, Number::DESCRIPTOR, Blob::DESCRIPTOR];

/// Encodings of a script, by number.
/// After them come the interface's own one, and one of the script.
pub const ENCODINGS: [&str; 5] = ["", "application/cdr", "application/json", "text/plain", "zenoh/bytes"];

/// Reads a script: interface, encoding, field, attachment, and content.
pub fn run(script: &[u8]) {
    let mut script = Input(script);
    let descriptor = INTERFACES[usize::from(script.byte()) % INTERFACES.len()];
    let number = usize::from(script.byte()) % (ENCODINGS.len() + 2);
    let texts = [script.counted(), script.counted()].map(String::from_utf8_lossy);
    let own = encoding(descriptor);
    let encoding = match number.checked_sub(ENCODINGS.len()) {
        None => ENCODINGS[number],
        Some(0) => &own,
        Some(_) => &texts[1],
    };
    let attachment = script.counted();
    let payload = Payload { encoding, bytes: script.0, attachment };
    // A list of numbers as text takes some bytes for each letter, and a value more than its message.
    let bound = (256 << 10) + 128 * script.0.len() + 8 * descriptor.size;
    let decoded = within(bound, || payload.decode(descriptor, &texts[0]));
    match decoded {
        Ok(Decoded::Bytes(bytes)) => check(descriptor, &bytes),
        Ok(Decoded::Value(value)) => drop(value.to_string()),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    if let Ok(attachment) = SampleAttachment::decode(attachment) {
        assert_eq!(SampleAttachment::decode(&attachment.encode()), Ok(attachment));
    }
    keys(&texts[1]);
}

/// A value has the size of its interface, and is what is decoded of its message.
fn check(descriptor: &'static Descriptor, bytes: &[u8]) {
    let item = descriptor.tail().map_or(0, Kind::size);
    let items = (bytes.len() - descriptor.size).checked_div(item).unwrap_or(0);
    let view = View::new(descriptor, bytes, items).expect("it is a value of its interface");
    drop(serde_json::to_string(&view.value()));
    let mut again = Vec::new();
    ros::encode(descriptor, bytes, &mut again).expect("it is a value of its interface");
    assert_eq!(ros::decode(descriptor, &again).ok().as_deref(), Some(bytes), "another value came out");
}

/// A key names one agent, and a source is parsed back as written.
fn keys(text: &str) {
    if let Some(agent) = alive_agent(text) {
        assert_eq!(alive_key(agent), text);
    }
    if let Ok(source) = InputSource::parse(text) {
        assert_eq!(InputSource::parse(&source.to_string()), Ok(source));
    }
}
