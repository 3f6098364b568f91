//! Ports of leaves while a tree runs.

use crate::value::BoardValue;

/// What a port leads to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PortBinding {
    /// A value in the file.
    Literal(BoardValue),
    /// An entry of a blackboard.
    Entry(usize),
}

impl PortBinding {
    pub fn read<'a>(&'a self, values: &'a [Option<BoardValue>]) -> Option<&'a BoardValue> {
        match self {
            Self::Literal(value) => Some(value),
            Self::Entry(slot) => values[*slot].as_ref(),
        }
    }
}

/// Ports of a leaf with their values.
#[derive(Debug)]
pub struct LeafPorts<'a> {
    pub(crate) bindings: &'a [(String, PortBinding)],
    pub(crate) values: &'a mut [Option<BoardValue>],
}

impl LeafPorts<'_> {
    /// Returns the names of the ports, in the order of the file.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.bindings.iter().map(|(name, _)| name.as_str())
    }

    /// Returns the value of a port, if it has one.
    pub fn get(&self, name: &str) -> Option<&BoardValue> {
        self.binding(name)?.read(self.values)
    }

    /// Returns the number in a port, also of a text that is one.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.get(name)?.number()
    }

    /// Writes the entry that a port leads to; `false` if the port is missing or has a literal value.
    pub fn set(&mut self, name: &str, value: BoardValue) -> bool {
        match self.binding(name) {
            Some(PortBinding::Entry(slot)) => {
                let slot = *slot;
                self.values[slot] = Some(value);
                true
            }
            _ => false,
        }
    }

    fn binding(&self, name: &str) -> Option<&PortBinding> {
        self.bindings.iter().find(|(own, _)| own == name).map(|(_, binding)| binding)
    }
}
