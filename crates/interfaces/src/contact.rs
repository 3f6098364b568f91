use slate_module::{Bool, Sequence, Text, interface};

/// Two bodies that began to touch.
#[interface]
pub struct Contact {
    /// Virtual time.
    #[unit("ns")]
    pub time: u64,
    /// The robot.
    pub robot: Text<24>,
    /// What it touched.
    pub other: Text<24>,
    /// Whether the robot moved in.
    pub caused: Bool,
    /// Whether the other moved in.
    pub caused_by_other: Bool,
    /// Not used.
    pub reserved: [u8; 6],
}

/// The contacts that began in a cycle.
#[interface]
pub struct Contacts {
    /// One after the other.
    pub list: Sequence<Contact, 8>,
}

/// What a robot's bumpers feel now.
#[interface]
#[derive(PartialEq)]
pub struct Bumper {
    /// Whether something presses on the front half.
    pub front: Bool,
    /// Whether something presses on the back half.
    pub back: Bool,
}

impl Bumper {
    /// Whether anything presses anywhere.
    pub fn pressed(&self) -> bool {
        self.front.get() || self.back.get()
    }
}
