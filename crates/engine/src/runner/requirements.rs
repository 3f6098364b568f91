//! Required inputs of a module, which must have a value before it runs.

use slate_blackboard::channel::Latest;
use slate_blackboard::interface::Text;

pub use slate_composition::own::PortName;

use super::InputPort;

/// Required inputs of a module, with a flag that one of them may lack a value.
#[derive(Default)]
pub struct Requirements {
    /// By their slots, in the order of the description.
    ports: Box<[(u32, PortName)]>,
    /// True if a required value may be missing.
    /// It is false once all were found, until links change.
    is_open: bool,
}

impl Requirements {
    /// Returns the slots and names of a description's required inputs.
    pub fn new<'n>(ports: impl Iterator<Item = (usize, &'n str)>) -> Self {
        let ports = ports.map(|(slot, name)| (slot as u32, Text::new(name))).collect();
        Self { ports, is_open: true }
    }

    /// Links have changed, so that a value may be missing again.
    pub fn reopen(&mut self) {
        self.is_open = true;
    }

    /// Returns true if a required value may be missing.
    #[inline]
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Returns the first required input without a value.
    /// It takes no new values; that happens before the step.
    pub fn missing(&mut self, inputs: &[InputPort], readers: &[Latest]) -> Option<PortName> {
        let all = inputs.iter().zip(readers);
        let has_value = |slot: u32| {
            // A value pinned at the start of a cycle counts from then, and not from its write.
            all.clone().any(|(input, reader)| {
                input.slot == slot && (reader.value().is_some() || !input.is_previous && reader.has_news())
            })
        };
        let missing = self.ports.iter().find(|(slot, _)| !has_value(*slot)).map(|(_, name)| *name);
        self.is_open = missing.is_some();
        missing
    }
}
