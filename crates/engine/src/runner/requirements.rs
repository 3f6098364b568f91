//! The inputs without whose value a module does not run.

use slate_blackboard::channel::Latest;
use slate_blackboard::interface::Text;

pub use slate_composition::own::PortName;

use super::InputPort;

/// The required inputs of a module, and whether one of them may be without a value.
#[derive(Default)]
pub struct Requirements {
    /// By their slots, in the order of the description.
    ports: Box<[(u32, PortName)]>,
    /// Whether a value may be missing; settled when all were found, until links change.
    is_open: bool,
}

impl Requirements {
    /// Those of a description: the slots and names of its required inputs.
    pub fn new<'n>(ports: impl Iterator<Item = (usize, &'n str)>) -> Self {
        let ports = ports.map(|(slot, name)| (slot as u32, Text::new(name))).collect();
        Self { ports, is_open: true }
    }

    /// Links have changed, so that a value may be missing again.
    pub fn reopen(&mut self) {
        self.is_open = true;
    }

    /// Whether a value may be missing.
    #[inline]
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// The first required input without a value. Only looks: what is new is taken before the step.
    pub fn missing(&mut self, inputs: &[InputPort], readers: &[Latest]) -> Option<PortName> {
        let all = inputs.iter().zip(readers);
        let has_value = |slot: u32| {
            // What is pinned when a cycle begins becomes a value then, and not when it is written.
            all.clone().any(|(input, reader)| {
                input.slot == slot && (reader.value().is_some() || !input.is_early && reader.has_news())
            })
        };
        let missing = self.ports.iter().find(|(slot, _)| !has_value(*slot)).map(|(_, name)| *name);
        self.is_open = missing.is_some();
        missing
    }
}
