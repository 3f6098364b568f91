//! What a recording has beside values of properties, as messages of ROS 2.

use slate_module::Level;
use slate_runtime::log::Record as Line;
use slate_runtime::recording::Change;

use super::lines::OTHERS;

/// A topic that is no property.
pub(crate) struct Topic {
    /// Its number among what comes from the lines.
    pub id: u32,
    pub name: &'static str,
    pub schema: &'static str,
    pub definition: &'static str,
}

/// The log.
pub(crate) const LOG: Topic = Topic {
    id: OTHERS,
    name: "/log",
    schema: "rcl_interfaces/msg/Log",
    definition: "\
byte DEBUG=10
byte INFO=20
byte WARN=30
byte ERROR=40
byte FATAL=50
builtin_interfaces/Time stamp
uint8 level
string name
string msg
string file
string function
uint32 line
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
",
};

/// What was changed from outside of the agent.
pub(crate) const CHANGE: Topic = Topic {
    id: OTHERS + 1,
    name: "/record/change",
    schema: "slate_msgs/msg/Change",
    definition: "\
# The agent's cycle after which it was made.
uint64 cycle
# The path of a setting; empty for what can't be made again.
string setting
# Whether it was given a value; else it is as the files say it.
bool has_value
# As TOML, or what was done, in words.
string value
",
};

/// What is missing.
pub(crate) const DROPPED: Topic = Topic {
    id: OTHERS + 2,
    name: "/record/dropped",
    schema: "slate_msgs/msg/Dropped",
    definition: "\
# The property.
string url
# How many of its values are not in the file until now.
uint64 values
",
};

pub(crate) const TOPICS: [&Topic; 3] = [&LOG, &CHANGE, &DROPPED];

/// A line of the log; its time is that which the file gives it.
pub(super) fn log(line: &Line, time: u64) -> Vec<u8> {
    let level: u8 = match line.level {
        Level::Error => 40,
        Level::Warn => 30,
        Level::Info => 20,
        Level::Debug | Level::Trace => 10,
    };
    let mut message = Message::new();
    // ROS 2 counts seconds in 32 bits.
    message.number(&((time / SECOND) as i32).to_le_bytes());
    message.number(&((time % SECOND) as u32).to_le_bytes());
    message.number(&[level]);
    message.text(&line.module);
    message.text(&line.message());
    message.text("");
    message.text("");
    message.number(&0_u32.to_le_bytes());
    message.0
}

const SECOND: u64 = 1_000_000_000;

pub(super) fn change(cycle: u64, change: &Change) -> Vec<u8> {
    let mut message = Message::new();
    message.number(&cycle.to_le_bytes());
    let (path, has_value, value) = match change {
        Change::Setting { path, value } => (path.as_str(), value.is_some(), value.as_deref().unwrap_or("")),
        Change::Other { what } => ("", true, what.as_str()),
    };
    message.text(path);
    message.number(&[u8::from(has_value)]);
    message.text(value);
    message.0
}

pub(super) fn dropped(url: &str, values: u64) -> Vec<u8> {
    let mut message = Message::new();
    message.text(url);
    message.number(&values.to_le_bytes());
    message.0
}

/// A message in little-endian CDR.
struct Message(Vec<u8>);

/// Bytes before the message itself, which alignment does not count.
const HEADER: [u8; 4] = [0, 1, 0, 0];

impl Message {
    fn new() -> Self {
        Self(HEADER.to_vec())
    }

    /// A number, whose bytes are its alignment.
    fn number(&mut self, bytes: &[u8]) {
        let at = (self.0.len() - HEADER.len()).next_multiple_of(bytes.len());
        self.0.resize(at + HEADER.len(), 0);
        self.0.extend_from_slice(bytes);
    }

    fn text(&mut self, text: &str) {
        // It ends with a zero, so it has none inside.
        let text = text.replace('\0', " ");
        self.number(&(text.len() as u32 + 1).to_le_bytes());
        self.0.extend_from_slice(text.as_bytes());
        self.0.push(0);
    }
}
