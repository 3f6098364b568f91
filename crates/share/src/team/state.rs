use slate_module::{Bool, Text, interface};

/// State of a robot in its team's knowledge: the property `share/knowledge`.
#[interface]
#[derive(PartialEq)]
pub struct TeamState {
    /// Known facts of all topics and robots.
    pub facts: u64,
    /// Memory of the known facts.
    #[unit("byte")]
    pub bytes: u64,
    /// Messages to other robots.
    pub sent: u64,
    /// Messages of other robots.
    pub received: u64,
    /// Messages dropped here because too many waited; later ones make up for them.
    pub dropped: u64,
    /// Invalid messages, and parts that exceed the limits.
    pub refused: u64,
    /// Facts with values of another interface than the one read here.
    /// They are passed on nevertheless.
    pub unfit: u64,
    /// Facts of topics that are not on the board.
    /// Their name is invalid, no module here uses them and the limit of such topics is reached, or their layout is
    /// unknown. They are passed on nevertheless.
    pub unshown: u64,
    /// Robots in reach that take part.
    pub neighbours: u32,
    /// Number of this robot.
    pub robot: u32,
    /// Conflict of robot numbers: another robot has this one's.
    /// The team then does not agree on its facts.
    pub contested: Bool,
    /// Current problem; empty without one.
    pub trouble: Text<252>,
}
