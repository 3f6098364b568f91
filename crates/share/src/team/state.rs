use slate_module::{Bool, Text, interface};

/// How a robot takes part in its team's knowledge: the property `share/knowledge`.
#[interface]
#[derive(PartialEq)]
pub struct TeamState {
    /// Facts that are known, of all topics and robots.
    pub facts: u64,
    /// Memory of what is known.
    #[unit("byte")]
    pub bytes: u64,
    /// Messages to other robots.
    pub sent: u64,
    /// Messages of other robots.
    pub received: u64,
    /// Messages that were lost here, as too much waited to be sent; later ones make them good.
    pub dropped: u64,
    /// Messages that made no sense, and parts that exceed the limits.
    pub refused: u64,
    /// Facts with values of another interface than the one that is read here; they are passed on all the same.
    pub unfit: u64,
    /// Facts of topics that do not show on the board: their name can't be one, or nobody here uses them and there are too many
    /// such topics, or it is not known what they look like. They are passed on all the same.
    pub unshown: u64,
    /// Robots that are within reach and take part.
    pub neighbours: u32,
    /// The number of this robot.
    pub robot: u32,
    /// Whether another robot has this one's number, so that the team does not agree on its facts.
    pub contested: Bool,
    /// What is wrong, if something is.
    pub trouble: Text<252>,
}
