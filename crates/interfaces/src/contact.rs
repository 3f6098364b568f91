use slate_module::{Bool, Sequence, Text, interface};

/// Begin of a contact between two bodies.
#[interface]
pub struct Contact {
    /// Virtual time.
    #[unit("ns")]
    pub time: u64,
    /// Name of the robot.
    pub robot: Text<24>,
    /// Name of the other body.
    pub other: Text<24>,
    /// True if the robot's motion caused the contact.
    pub caused: Bool,
    /// True if the other body's motion caused the contact.
    pub caused_by_other: Bool,
}

/// Contacts that began in a cycle.
#[interface]
pub struct Contacts {
    /// Contacts in their order.
    pub list: Sequence<Contact, 8>,
}

/// State of the bumpers.
#[interface]
#[derive(PartialEq)]
pub struct Bumper {
    /// Front contact: true if pressed.
    pub front: Bool,
    /// Rear contact: true if pressed.
    pub back: Bool,
}

impl Bumper {
    /// Returns whether any bumper is pressed.
    pub fn pressed(&self) -> bool {
        self.front.get() || self.back.get()
    }
}
