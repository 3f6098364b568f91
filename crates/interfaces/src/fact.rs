use slate_module::{Bool, Text, interface};

/// Head of a table of facts; see `FactTable` of slate-mapek.
#[interface]
#[derive(PartialEq)]
pub struct FactTableHead {
    /// Revision, which changes with the table.
    /// In a table of the team it is a hash of the rest, so it differs between runs and robots, too.
    pub revision: u64,
    /// Number of facts beyond the table's capacity.
    pub left_out: u32,
    /// Number of facts with values of another interface, which are left out.
    pub unfit: u32,
}

/// Head of a fact in a table.
#[interface]
#[derive(PartialEq)]
pub struct FactHead {
    /// Life of its origin in which it was stated.
    pub epoch: u64,
    /// Sequence number in this life; the time in a robot's own table.
    pub sequence: u64,
    /// Time of the statement.
    /// By the origin's clock since 1970, possibly hours off; by this agent's time in its own table.
    #[unit("ns")]
    pub time: u64,
    /// Order of statements; the largest is the newest.
    /// It is the time, but later than all that its origin knew of the key; the time in a robot's own table.
    #[unit("ns")]
    pub order: u64,
    /// Time of arrival at this robot, by this agent's time.
    #[unit("ns")]
    pub heard: u64,
    /// Certainty of its origin, 0 to 1.
    pub certainty: f64,
    /// Number of the robot that states it.
    pub origin: u32,
    /// Retraction: true if it is retracted; only in a robot's own table.
    pub retracted: Bool,
    /// Name of the robot that states it; empty in a robot's own table.
    pub robot: Text<60>,
    /// Key of the fact in its topic.
    pub key: Text<124>,
}
