//! Ports of a Plan for monitors of behavior trees.

use std::borrow::Cow;
use std::fmt::Write;

use slate_behavior_tree::{BoardValue, NodeStatus, TreeExecutor};
use slate_plugin::prelude::*;

/// Port with the XML of the tree; `_uid` is the number of a node, from 1.
pub const TREE: &str = "tree_xml";
/// Port with the status of each node, a byte each, by its number.
///
/// 0 is idle, 1 running, 2 succeeded, 3 failed; 10 more is a node that was reset after that status.
pub const NODES: &str = "tree_nodes";
/// Port with the entries of blackboards that have a value, as JSON.
/// Path of the sub-tree, name and value of each.
///
/// The blackboard of the main tree has the name of the tree.
pub const BLACKBOARDS: &str = "tree_blackboards";

/// Length above which blackboards are not shown, bytes.
const MOST_JSON: usize = 64 << 10;

/// Behavior tree as a monitor shows it.
#[interface]
pub struct TreeView {
    /// Number that changes with the file of the tree.
    pub fingerprint: u64,
    /// Size of the content, bytes.
    /// A lower bound where it is left out because it is too large.
    #[unit("byte")]
    pub size: u64,
    /// Content, which depends on the port.
    pub content: [u8],
}

impl TreeView {
    /// Writes the tree, if a viewer subscribes.
    pub fn write_tree(port: &Debug<Self>, executor: &TreeExecutor) {
        write(port, executor, |executor| {
            executor.tree().monitor_xml().map(|xml| Cow::Borrowed(xml.as_bytes()))
        });
    }

    /// Writes the statuses of the nodes, if a viewer subscribes.
    pub fn write_nodes(port: &Debug<Self>, executor: &TreeExecutor) {
        write(port, executor, |executor| {
            let status = |node| match (executor.status(node), executor.last_status(node)) {
                (NodeStatus::Idle, NodeStatus::Idle) => 0,
                (NodeStatus::Idle, last) => 10 + status_number(last),
                (status, _) => status_number(status),
            };
            Ok(Cow::Owned((0..executor.tree().nodes().len()).map(status).collect()))
        });
    }

    /// Writes the values of the blackboards, if a viewer subscribes.
    pub fn write_blackboards(port: &Debug<Self>, executor: &TreeExecutor) {
        write(port, executor, |executor| {
            let mut json = String::from("[");
            for (path, name, value) in executor.board() {
                json.push_str(if json.len() == 1 { "[" } else { ",[" });
                write_text(if path.is_empty() { executor.tree().name() } else { path }, &mut json);
                json.push(',');
                write_text(name, &mut json);
                json.push(',');
                match value {
                    BoardValue::Number(_) => json.push_str(&value.to_string()),
                    BoardValue::Text(text) => write_text(text, &mut json),
                }
                json.push(']');
                if json.len() > MOST_JSON {
                    return Err(json.len());
                }
            }
            json.push(']');
            Ok(Cow::Owned(json.into_bytes()))
        });
    }
}

/// Writes a content, or the lower bound of its size if it is too large.
fn write(
    port: &Debug<TreeView>,
    executor: &TreeExecutor,
    content: impl Fn(&TreeExecutor) -> Result<Cow<'_, [u8]>, usize>,
) {
    let fingerprint = executor.tree().fingerprint();
    // True if a monitor is connected.
    if !port.write(0, |_| ()) {
        return;
    }
    let content = content(executor);
    let size = content.as_ref().map_or_else(|size| *size, |content| content.len());
    let head = |view: &mut TreeView| (view.fingerprint, view.size) = (fingerprint, size as u64);
    let is_written = content.is_ok_and(|content| {
        port.write(size, |view| {
            head(view);
            view.content.copy_from_slice(&content);
        })
    });
    if !is_written {
        port.write(0, head);
    }
}

fn status_number(status: NodeStatus) -> u8 {
    match status {
        NodeStatus::Idle => 0,
        NodeStatus::Running => 1,
        NodeStatus::Succeeded => 2,
        NodeStatus::Failed => 3,
        NodeStatus::Skipped => 4,
    }
}

/// Writes a text as JSON.
fn write_text(text: &str, json: &mut String) {
    json.push('"');
    for sign in text.chars() {
        match sign {
            '"' | '\\' => json.extend(['\\', sign]),
            sign if sign.is_control() => {
                // All of them have 16 bits.
                let _ = write!(json, "\\u{:04x}", u32::from(sign));
            }
            sign => json.push(sign),
        }
    }
    json.push('"');
}
