//! Outlines of ports, which the compiler writes into a library.

use slate_blackboard::interface::Descriptor;

use crate::Direction;

/// Ports in their order.
#[derive(Debug)]
pub enum PortList {
    /// List of ports.
    Ports(&'static [PortOutline]),
    /// Two lists, one after the other.
    Both(&'static PortList, &'static PortList),
}

/// Outline of a port, read without opening its library.
#[derive(Debug)]
pub struct PortOutline {
    /// Name.
    pub name: &'static str,
    /// Direction, and the interface of its values.
    pub carries: (Direction, &'static Descriptor),
}
