use slate_module::{Bool, interface};

/// State of a door.
#[interface]
#[derive(PartialEq)]
pub struct DoorState {
    /// Open part of the doorway, from 0 for closed to 1 for open.
    pub opening: f64,
    /// Door state: true if completely open.
    pub is_open: Bool,
}
