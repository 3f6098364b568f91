//! Features of a node beside its topics and services.

use slate_runtime::configuration::{Span, Table};

use crate::table_reader::TableReader;

/// Access of other nodes to a feature of the node.
/// Such as the parameters of modules.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NodeAccess {
    /// No access: the node has no services for it.
    None,
    /// List and read.
    #[default]
    Read,
    /// Set, too, with the checks that tools have.
    Set,
}

/// Input that reads the transform of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameInput {
    /// Path of the input.
    pub input: String,
    /// Child frame, such as `laser`.
    pub frame: String,
    /// Place in the configuration.
    pub place: Option<Span>,
}

/// Features of a node beside its topics and services.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeOptions {
    /// Access of other nodes to parameters.
    pub parameters: NodeAccess,
    /// Publication of the simulation's time at `/clock`.
    pub clock: bool,
    /// Publication of the log at `/rosout`.
    pub log: bool,
    /// Publication of the robots' frames at `/tf` and `/tf_static`.
    pub transforms: bool,
    /// Inputs that read `/tf` and `/tf_static`.
    pub frames: Vec<FrameInput>,
}

impl Default for NodeOptions {
    /// Returns the defaults of ROS nodes: readable parameters, and a log.
    fn default() -> Self {
        Self {
            parameters: NodeAccess::default(),
            clock: false,
            log: true,
            transforms: false,
            frames: Vec::new(),
        }
    }
}

/// Keys of [`NodeOptions`] in the table of a bridge.
pub const OPTION_KEYS: [&str; 5] = ["parameters", "clock", "rosout", "tf", "frames"];

const FRAMES_HELP: &str = "write frames.\"laser_frame/transform\" = \"laser\"";

impl NodeOptions {
    /// Returns whether a table has any of the options.
    pub fn has_any(table: &Table) -> bool {
        OPTION_KEYS.iter().any(|key| table.get(key).is_some())
    }

    /// Reads them from a table.
    pub fn read(reader: &mut TableReader<'_>, table: &Table) -> Self {
        Self {
            parameters: NodeAccess::read(reader, table, "parameters", NodeAccess::default()),
            clock: reader.flag(table, "clock"),
            log: table.get("rosout").is_none() || reader.flag(table, "rosout"),
            transforms: reader.flag(table, "tf"),
            frames: frames(reader, table),
        }
    }
}

fn frames(reader: &mut TableReader<'_>, table: &Table) -> Vec<FrameInput> {
    let mut frames: Vec<FrameInput> = Vec::new();
    for (input, span, entry) in reader.entries(table, "frames", FRAMES_HELP) {
        let input = reader.path(&input, span, FRAMES_HELP);
        let Some(frame) = entry.as_str().filter(|frame| !frame.is_empty()) else {
            reader.add(entry.span, format!("a frame is a text, found {}", entry.value), FRAMES_HELP);
            continue;
        };
        let Some(input) = input else { continue };
        frames.push(FrameInput { input, frame: frame.to_owned(), place: Some(entry.span) });
    }
    frames
}

impl NodeAccess {
    /// Reads the access of a key.
    pub fn read(reader: &mut TableReader<'_>, table: &Table, key: &str, default: Self) -> Self {
        let help = format!("write {key} = \"none\", \"read\" or \"set\"");
        let Some((text, span)) = reader.text(table, key, &help) else { return default };
        match text.as_str() {
            "none" => Self::None,
            "read" => Self::Read,
            "set" => Self::Set,
            other => {
                let message = format!("expected `{key}` to be none, read or set, found {other:?}");
                reader.add(span, message, &help);
                default
            }
        }
    }
}
