use super::Version;

/// Statement of a robot about a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statement<'a> {
    /// The schema hash of the value's interface.
    pub schema: u64,
    /// Certainty of the robot, 0 to 1.
    pub certainty: f64,
    /// Value in the layout of its interface.
    pub value: &'a [u8],
}

/// Fact in a replica: the statement of one origin about one key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fact<'a> {
    /// Subject of the statement.
    pub key: &'a [u8],
    /// Robot that states it.
    pub origin: u32,
    /// Version of the statement in the order of its origin's.
    pub version: Version,
    /// Time of the statement by the origin's clock, ns.
    /// Clocks of robots may be hours apart.
    pub time: u64,
    /// Causal order of the statement, ns.
    /// It is the time, but later than the order of any fact about the key that the origin knew. So a statement made in
    /// knowledge of another one follows it, regardless of the clocks.
    pub order: u64,
    /// The statement.
    pub statement: Statement<'a>,
}

/// Selection among facts of several origins about one key.
/// Each reader chooses; the stored facts are the same for all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// Fact with the latest [`Fact::order`]; of equal ones that of the lowest origin.
    Newest,
    /// Fact with the highest certainty; of equal ones the newest.
    MostCertain,
    /// All facts, by origin.
    Union,
}

impl View {
    /// Selects facts about one key; the input is ordered by origin.
    pub fn of<'a>(self, facts: impl Iterator<Item = Fact<'a>>) -> Vec<Fact<'a>> {
        let best = |after: fn(&Fact<'_>, &Fact<'_>) -> bool, facts: &mut dyn Iterator<Item = Fact<'a>>| {
            facts.reduce(|best, fact| if after(&fact, &best) { fact } else { best }).into_iter().collect()
        };
        let mut facts = facts;
        match self {
            Self::Newest => best(|fact, other| fact.order > other.order, &mut facts),
            Self::MostCertain => best(
                |fact, other| {
                    let (fact, other) =
                        ((fact.statement.certainty, fact.order), (other.statement.certainty, other.order));
                    fact > other
                },
                &mut facts,
            ),
            Self::Union => facts.collect(),
        }
    }
}
