//! Log, changes and drops of a recording, as messages of ROS 2.

use std::path::PathBuf;

use slate_module::Level;
use slate_runtime::log::Record as Line;
use slate_runtime::recording::Change;

use super::hub::FIRST_TOPIC_ID;
use slate_ros_messages::Schema;

/// A topic that is not a property.
pub struct Topic {
    /// Number among the channels of the rings.
    pub id: u32,
    pub name: &'static str,
    pub schema: &'static str,
    pub definition: &'static str,
}

/// The log.
pub const LOG_TOPIC: Topic = Topic {
    id: FIRST_TOPIC_ID,
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

/// Changes of the agent.
pub const CHANGE_TOPIC: Topic = Topic {
    id: FIRST_TOPIC_ID + 1,
    name: "/record/change",
    schema: "slate_msgs/msg/Change",
    definition: "\
# The agent's cycle after which it was made.
uint64 cycle
# The path of a setting, if it is one.
string setting
# Whether it was given a value; else it is as the files say it.
bool has_value
# As TOML; or why there was a stop, which actuator was armed, or what was done that can't be made again; or what a module asked for,
# or the modules of each stage, a line each.
string value
# A plugin that was reloaded, loaded or unloaded, the library, and a hash over that; or a module, what it was answered, and whether
# that was a refusal.
string plugin
string file
uint64 hash
# What was done if it is no setting and no reload: load, unload, stop, reset, arm; own (a setting that a module had changed), ask,
# order.
string action
",
};

/// Dropped values.
pub const DROPPED_TOPIC: Topic = Topic {
    id: FIRST_TOPIC_ID + 2,
    name: "/record/dropped",
    schema: "slate_msgs/msg/Dropped",
    definition: "\
# The property.
string url
# How many of its values are not in the file until now.
uint64 values
",
};

/// Topics of the recorder's own messages.
pub const TOPICS: [&Topic; 3] = [&LOG_TOPIC, &CHANGE_TOPIC, &DROPPED_TOPIC];

/// Encodes a line of the log with the time in the file.
pub(super) fn log(line: &Line, time: u64) -> Vec<u8> {
    let level: u8 = match line.level {
        Level::Error => 40,
        Level::Warn => 30,
        Level::Info => 20,
        Level::Debug | Level::Trace => 10,
    };
    let mut message = CdrMessage::new();
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
    let mut message = CdrMessage::new();
    message.number(&cycle.to_le_bytes());
    let mut fields = ChangeFields::default();
    let text = |file: &PathBuf| file.to_string_lossy().into_owned();
    match change {
        Change::Setting { path, value } => (fields.path, fields.value) = (path.clone(), value.clone()),
        Change::Reload { plugin, file, hash } => {
            (fields.plugin, fields.file, fields.hash) = (plugin.clone(), text(file), *hash);
        }
        Change::Load { name, file, hash } => {
            (fields.action, fields.plugin, fields.hash) = (LOAD, name.clone(), *hash);
            fields.file = file.as_ref().map(text).unwrap_or_default();
        }
        Change::Unload { name } => (fields.action, fields.plugin) = (UNLOAD, name.clone()),
        Change::Stop { reason } => (fields.action, fields.value) = (STOP, Some(reason.clone())),
        Change::Reset => fields.action = RESET,
        Change::Arm { actuator } => (fields.action, fields.value) = (ARM, actuator.clone()),
        Change::Own { module, path, value } => {
            (fields.action, fields.plugin) = (OWN, module.clone());
            (fields.path, fields.value) = (path.clone(), value.clone());
        }
        Change::Asked { module, lines, answer } => {
            (fields.action, fields.plugin, fields.value) = (ASK, module.clone(), Some(lines.clone()));
            (fields.hash, fields.file) = match answer {
                Ok(text) => (0, text.clone()),
                Err(reason) => (1, reason.clone()),
            };
        }
        Change::Order { stages } => {
            let line = |(stage, modules): &(String, Vec<String>)| format!("{stage} {}", modules.join(" "));
            let lines: Vec<_> = stages.iter().map(line).collect();
            (fields.action, fields.value) = (ORDER, Some(lines.join("\n")));
        }
        Change::Other { what } => fields.value = Some(what.clone()),
    }
    message.text(&fields.path);
    message.number(&[u8::from(fields.value.is_some())]);
    message.text(&fields.value.unwrap_or_default());
    message.text(&fields.plugin);
    message.text(&fields.file);
    message.number(&fields.hash.to_le_bytes());
    message.text(fields.action);
    message.0
}

/// The fields of a change.
#[derive(Default)]
struct ChangeFields {
    path: String,
    value: Option<String>,
    plugin: String,
    file: String,
    hash: u64,
    action: &'static str,
}

const LOAD: &str = "load";
const UNLOAD: &str = "unload";
const STOP: &str = "stop";
const RESET: &str = "reset";
const ARM: &str = "arm";
const OWN: &str = "own";
const ASK: &str = "ask";
const ORDER: &str = "order";

/// Returns the cycle and the change of a message.
pub fn read_change(message: &[u8]) -> Option<(u64, Change)> {
    let schema = Schema::parse(CHANGE_TOPIC.schema, CHANGE_TOPIC.definition).ok()?;
    let change = schema.decode(message).ok()?;
    let text = |name: &str| Some(change.get(name)?.as_str()?.to_owned());
    let number = |name: &str| u64::try_from(change.get(name)?.as_integer()?).ok();
    let value = if change.get("has_value")?.as_bool()? { Some(text("value")?) } else { None };
    let (path, plugin, file, hash) = (text("setting")?, text("plugin")?, text("file")?, number("hash")?);
    let own = match (text("action")?.as_str(), path.is_empty(), plugin.is_empty()) {
        (LOAD, ..) => {
            let file = Some(PathBuf::from(file)).filter(|file| !file.as_os_str().is_empty());
            Change::Load { name: plugin, file, hash }
        }
        (UNLOAD, ..) => Change::Unload { name: plugin },
        (STOP, ..) => Change::Stop { reason: value.unwrap_or_default() },
        (RESET, ..) => Change::Reset,
        (ARM, ..) => Change::Arm { actuator: value },
        (OWN, ..) => Change::Own { module: plugin, path, value },
        (ASK, ..) => {
            let answer = if hash == 0 { Ok(file) } else { Err(file) };
            Change::Asked { module: plugin, lines: value.unwrap_or_default(), answer }
        }
        (ORDER, ..) => {
            let value = value.unwrap_or_default();
            let stages = value.lines().map(|line| {
                let (stage, modules) = line.split_once(' ').unwrap_or((line, ""));
                (stage.to_owned(), modules.split_whitespace().map(str::to_owned).collect())
            });
            Change::Order { stages: stages.collect() }
        }
        ("", false, _) => Change::Setting { path, value },
        ("", _, false) => Change::Reload { plugin, file: file.into(), hash },
        ("", ..) => Change::Other { what: value.unwrap_or_default() },
        _ => return None,
    };
    Some((number("cycle")?, own))
}

pub(super) fn dropped(url: &str, values: u64) -> Vec<u8> {
    let mut message = CdrMessage::new();
    message.text(url);
    message.number(&values.to_le_bytes());
    message.0
}

/// A message in little-endian CDR.
struct CdrMessage(Vec<u8>);

/// Bytes before the message itself, which alignment does not count.
const HEADER: [u8; 4] = [0, 1, 0, 0];

impl CdrMessage {
    fn new() -> Self {
        Self(HEADER.to_vec())
    }

    /// Appends a number, whose size is its alignment.
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
