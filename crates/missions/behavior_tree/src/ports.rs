//! Ports of leaves while a tree runs.

use crate::entries::EntryValues;
use crate::model::PortDirection;
use crate::value::BoardValue;

/// Value or entry that a port leads to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PortBinding {
    /// Value in the file.
    Literal(BoardValue),
    /// Entry of a blackboard.
    Entry(usize),
}

impl PortBinding {
    pub fn read<'a>(&'a self, values: &'a EntryValues) -> Option<&'a BoardValue> {
        match self {
            Self::Literal(value) => Some(value),
            Self::Entry(slot) => values.get(*slot),
        }
    }
}

/// Port of a leaf in a tree.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BoundPort {
    pub name: String,
    pub direction: PortDirection,
    pub binding: PortBinding,
}

impl BoundPort {
    pub fn is_read(&self) -> bool {
        self.direction != PortDirection::Output
    }

    pub fn is_written(&self) -> bool {
        self.direction != PortDirection::Input
    }
}

/// Ports of a leaf with their values.
#[derive(Debug)]
pub struct LeafPorts<'a> {
    pub(crate) ports: &'a [BoundPort],
    pub(crate) values: &'a mut EntryValues,
}

impl LeafPorts<'_> {
    /// Returns the names of the ports, in the order of the model.
    ///
    /// Without a model, in the order of the file.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.ports.iter().map(|port| port.name.as_str())
    }

    /// Returns the names of the ports that the leaf reads, in that order.
    ///
    /// Without a model it may read any.
    pub fn inputs(&self) -> impl Iterator<Item = &str> {
        self.ports.iter().filter(|port| port.is_read()).map(|port| port.name.as_str())
    }

    /// Returns the value of a port, if it has one.
    pub fn get(&self, name: &str) -> Option<&BoardValue> {
        self.binding(name)?.read(self.values)
    }

    /// Returns the number in a port, also of a text that is one.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.get(name)?.number()
    }

    /// Writes the entry that a port leads to.
    ///
    /// Returns `false` if the port is missing or has a literal value.
    pub fn set(&mut self, name: &str, value: BoardValue) -> bool {
        match self.binding(name) {
            Some(PortBinding::Entry(slot)) => {
                let slot = *slot;
                self.values.set(slot, value);
                true
            }
            _ => false,
        }
    }

    fn binding(&self, name: &str) -> Option<&PortBinding> {
        self.ports.iter().find(|port| port.name == name).map(|port| &port.binding)
    }
}
