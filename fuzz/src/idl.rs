//! Files of IDL, and messages of their structs.

use crate::input::Input;
use crate::memory::within;
use slate_blackboard::interface::Interface;
use slate_dds::{IdlFile, IdlMessage, Representation};
use slate_interfaces::{Image, Pose2, Sightings};

/// Reads a script: a file, and then messages of each struct in it.
pub fn run(script: &[u8]) {
    let mut script = Input(script);
    let Ok(text) = std::str::from_utf8(script.counted()) else { return };
    let file = match IdlFile::parse("fuzz.idl", text) {
        Ok(file) => file,
        Err(error) => {
            let lines = text.lines().count().max(1);
            return assert!((1..=lines).contains(&error.line), "{error} is in no line of {lines}");
        }
    };
    let mut messages = Vec::new();
    while !script.is_empty() {
        messages.push(script.counted());
    }
    for structure in file.structures().take(8).filter_map(|name| file.structure(name)) {
        for descriptor in [Image::DESCRIPTOR, Pose2::DESCRIPTOR, Sightings::DESCRIPTOR] {
            for representation in [Representation::Xcdr1, Representation::Xcdr2] {
                let Ok(own) = IdlMessage::of(descriptor, &structure, representation) else { continue };
                messages.iter().for_each(|message| check(&own, message));
            }
        }
    }
}

/// Checks that a value that was read is written and read as the same.
/// Unless the struct has no room for it.
fn check(own: &IdlMessage, message: &[u8]) {
    let read = within((64 << 10) + 128 * message.len(), || own.decode(message));
    let Ok(value) = read else { return };
    let mut again = Vec::new();
    if own.encode(&value, &mut again).is_ok() {
        let read = own.decode(&again).expect("it was written here");
        assert_eq!(read.len(), value.len(), "another value came out");
    }
}
