//! `LoopInt`, `LoopDouble`, `LoopString` and `LoopBool`.

use super::attributes::Attributes;
use crate::error::TreeError;
use crate::ports::PortBinding;
use crate::queue::ItemKind;
use crate::tree::{LoopQueue, NodeOperation, NodeStatus, TreeLoop};

pub(super) fn item_loop(
    kind: ItemKind,
    attributes: &mut Attributes<'_, '_>,
) -> Result<NodeOperation, TreeError> {
    let text = attributes.required("queue")?;
    let queue = match attributes.bind("queue", text) {
        // The builder adds the other entry.
        PortBinding::Entry(entry) => LoopQueue::Entry { entry, kept: entry },
        PortBinding::Literal(_) => LoopQueue::Items(
            kind.items(text)
                .collect::<Result<Vec<_>, String>>()
                .map_err(|reason| attributes.error(format!("port `queue`: {reason}")))?,
        ),
    };
    let value = match attributes.take("value") {
        None => None,
        Some(text) => match attributes.bind("value", text) {
            PortBinding::Entry(entry) => Some(entry),
            PortBinding::Literal(_) => {
                return Err(attributes.error(format!(
                    "expected an entry such as `{{value}}` in the output port `value`, found `{text}`"
                )));
            }
        },
    };
    let if_empty = attributes.status("if_empty", NodeStatus::Succeeded)?;
    Ok(NodeOperation::Loop(TreeLoop { kind, queue, value, if_empty }))
}
