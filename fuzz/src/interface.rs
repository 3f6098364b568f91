//! The interface of another agent's property, and a value of it.

use crate::agents::Blob;
use crate::input::Input;
use slate_blackboard::interface::{Interface, View, difference};
use slate_module::{decode_interface, encode_interface};

/// A session has no larger values.
const LARGEST: usize = 64 << 10;

/// Reads a script: an interface, and a value of it.
pub fn run(script: &[u8]) {
    let mut script = Input(script);
    let descriptor = match decode_interface(script.counted()) {
        Ok(descriptor) => descriptor,
        Err(refusal) => return drop(refusal.to_string()),
    };
    let again = encode_interface(descriptor).expect("it came so");
    assert_eq!(decode_interface(&again).expect("it came so").hash, descriptor.hash);
    assert_eq!(difference(descriptor, descriptor, ("here", "there")), None);
    let _ = difference(Blob::DESCRIPTOR, descriptor, ("here", "there"));
    let items = usize::from(script.short());
    let _ = descriptor.shape(usize::MAX).bytes(usize::MAX);
    if descriptor.shape(items).bytes(items) > LARGEST {
        return;
    }
    if let Some(view) = View::new(descriptor, script.0, items) {
        let _ = serde_json::to_string(&view.value());
    }
}
