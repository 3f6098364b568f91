use super::Version;

/// What a robot states about a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statement<'a> {
    /// The schema hash of the value's interface.
    pub schema: u64,
    /// How sure the robot is, 0 to 1.
    pub certainty: f64,
    /// The value, as its interface lays it out.
    pub value: &'a [u8],
}

/// A fact as a replica holds it: what one origin states about one key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fact<'a> {
    /// What it is about.
    pub key: &'a [u8],
    /// The robot that states it.
    pub origin: u32,
    /// Which of its statements this is.
    pub version: Version,
    /// When it was stated by the origin's clock, nanoseconds. Clocks of robots may be hours apart.
    pub time: u64,
    /// The time, but later than the order of any fact about the key that the origin knew when it stated this: what was
    /// stated in knowledge of another statement comes after it, however far the clocks are apart.
    pub order: u64,
    /// What is stated.
    pub statement: Statement<'a>,
}

/// How readers see what several origins state about one key. A reader chooses; what is kept is the same for all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// The fact that comes last by [`Fact::order`]; of equal ones that of the lowest origin.
    Newest,
    /// The fact whose origin is surest; of equal ones the newest.
    MostCertain,
    /// All facts, by origin.
    Union,
}

impl View {
    /// Of facts about one key, ordered by origin, those that the view shows.
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
