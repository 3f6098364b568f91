//! A definition of ROS 2 messages as a file has it, and messages of it: what becomes of a recording of somebody else.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::input::Input;
use crate::memory::within;
use slate_blackboard::interface::View;
use slate_record::ros::{Described, Schema};

/// Interfaces are kept for ever, so a process makes no more than so many.
const MOST: usize = 20_000;

/// Reads a script: a definition, and messages of it.
pub fn run(script: &[u8]) {
    static MADE: AtomicUsize = AtomicUsize::new(0);
    let mut script = Input(script);
    let Ok(text) = std::str::from_utf8(script.counted()) else { return };
    let parse = || Schema::parse("fuzz_msgs/msg/Own", text);
    let schema = match within((1 << 20) + 512 * text.len(), parse) {
        Ok(schema) => schema,
        Err(refusal) => return assert!(!refusal.to_string().is_empty(), "refused without a word"),
    };
    let mut described = match Described::new("fuzz_msgs/msg/Own", schema) {
        Ok(described) => described,
        Err(refusal) => return assert!(!refusal.is_empty(), "refused without a word"),
    };
    let mut messages = Vec::new();
    while !script.is_empty() {
        let message = script.counted();
        // A message of nothing may have as many parts as it likes to say.
        if within((16 << 20) + 4096 * message.len(), || described.note(message)).is_ok() {
            messages.push(message);
        }
    }
    if MADE.fetch_add(1, Ordering::Relaxed) >= MOST {
        return;
    }
    let Ok((descriptor, capacity)) = described.interface() else { return };
    for message in messages {
        let bytes = described.decode(message).expect("it was noted");
        let tail = bytes.len() - descriptor.size;
        let items = descriptor.tail().map_or(0, |kind| tail / kind.size().max(1));
        assert!(items <= capacity, "{items} items, and there is room for {capacity}");
        let view = View::new(descriptor, &bytes, items).expect("it has the bytes of its interface");
        let _ = serde_json::to_string(&view.value());
    }
}

/// Definitions with something of each kind, each with a message.
pub fn samples() -> Vec<(&'static str, &'static str, Vec<u8>)> {
    let header = [0, 1, 0, 0];
    let flat = [&header[..], &3_u32.to_le_bytes(), b"ab\0", &[7], &0.5_f64.to_le_bytes()].concat();
    let list = [&header[..], &2_u32.to_le_bytes(), &[0; 4], &1.5_f64.to_le_bytes(), &2.5_f64.to_le_bytes()].concat();
    let nested = [
        &header[..],
        &5_i32.to_le_bytes(),
        &6_u32.to_le_bytes(),
        &4_u32.to_le_bytes(),
        b"map\0",
        &1_u32.to_le_bytes(),
        &[1, 2, 3],
    ]
    .concat();
    vec![
        ("flat", "string frame\nuint8 kind\nfloat64 range\n", flat),
        ("list", "# Numbers.\nfloat64[] ranges\nbool NEVER=false\n", list),
        (
            "nested",
            "Header header\nPart[] parts\n================================================================================\n\
             MSG: fuzz_msgs/Part\nuint8[3] color\n\
             ================================================================================\n\
             MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
             ================================================================================\n\
             MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
            nested,
        ),
        ("bounded", "string<=5[<=3] names\nfloat32[4] quaternion\nwstring no\n", header.to_vec()),
        ("itself", "Own[] own\n", header.to_vec()),
        ("huge", "float64[1000000000] many\nfloat64[1000000000][] more\n", header.to_vec()),
    ]
}
