use slate_module::{Bool, Text, interface};

/// What a table of facts begins with; see `FactTable` of slate-mapek.
#[interface]
#[derive(PartialEq)]
pub struct FactTableHead {
    /// Another number whenever the table has changed. In what the team states it is a hash of all else, and so another one
    /// for the tables of other runs and robots, too.
    pub revision: u64,
    /// Facts that have no room in the table.
    pub left_out: u32,
    /// Facts of the topic with values of another interface than this table's, which are kept out of it.
    pub unfit: u32,
}

/// What stands before the value of a fact in a table.
#[interface]
#[derive(PartialEq)]
pub struct FactHead {
    /// Which life of its origin stated it.
    pub epoch: u64,
    /// Counts the statements of that life; in a robot's own table it is the time instead.
    pub sequence: u64,
    /// When it was stated: since 1970 by its origin's clock in what the team states, which may be hours off, and by this
    /// agent's time in what it states itself.
    #[unit("ns")]
    pub time: u64,
    /// By what "newest" goes: the time, but later than all that its origin knew about the key; in a robot's own table the
    /// time alone.
    #[unit("ns")]
    pub order: u64,
    /// When this robot came to know it, by this agent's time.
    #[unit("ns")]
    pub heard: u64,
    /// How sure its origin is, 0 to 1.
    pub certainty: f64,
    /// The number of the robot that states it.
    pub origin: u32,
    /// Whether it is taken back, which only a table of a robot's own statements says.
    pub retracted: Bool,
    /// Not used.
    pub reserved: [u8; 3],
    /// The name of the robot that states it; empty in a table of a robot's own statements.
    pub robot: Text<60>,
    /// What it is about, in its topic.
    pub key: Text<124>,
}
