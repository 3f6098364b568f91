use serde::{Deserialize, Serialize};

/// Which of an origin's statements came later: a restarted origin has a higher epoch, each statement a higher number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Version {
    /// Which life of the origin.
    pub epoch: u64,
    /// Counts the statements of that life.
    pub sequence: u64,
}

/// What one origin states.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fact<T> {
    /// Who states it.
    pub origin: u32,
    /// Which of its statements this is.
    pub version: Version,
    /// When it was stated, nanoseconds.
    pub time: u64,
    /// How sure the origin is, 0 to 1.
    pub certainty: f64,
    /// What it states; nothing when it took its statement back.
    pub value: Option<T>,
}

/// What several origins state about one thing: the latest statement of each.
///
/// An older statement never replaces a newer one, and what was taken back stays so until its origin states something
/// newer, so facts may arrive twice and in any order. Allocates when a new origin appears and never else.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Facts<T> {
    /// Ordered by origin.
    facts: Vec<Fact<T>>,
}

impl<T> Default for Facts<T> {
    fn default() -> Self {
        Self { facts: Vec::new() }
    }
}

impl<T> Facts<T> {
    /// Takes a statement over if it is its origin's newest; says whether it was.
    pub fn tell(&mut self, fact: Fact<T>) -> bool {
        match self.facts.binary_search_by_key(&fact.origin, |known| known.origin) {
            Ok(at) if self.facts[at].version < fact.version => self.facts[at] = fact,
            Ok(_) => return false,
            Err(at) => self.facts.insert(at, fact),
        }
        true
    }

    /// The facts as that view sees them: [`Newest`], [`MostCertain`], [`Union`] or one of your own.
    pub fn view<M: Merge>(&self) -> M::View<'_, T> {
        M::merge(&self.facts)
    }

    /// Every statement, also those taken back, ordered by origin; for passing on to other robots.
    pub fn all(&self) -> &[Fact<T>] {
        &self.facts
    }
}

/// How readers see what several origins state.
pub trait Merge {
    /// What they see.
    type View<'a, T: 'a>;

    /// Makes it of the statements, which are ordered by origin.
    fn merge<T>(facts: &[Fact<T>]) -> Self::View<'_, T>;
}

/// The fact stated last; of equal ones that of the lowest origin.
#[derive(Clone, Copy, Debug)]
pub struct Newest;

/// The fact whose origin is surest; of equal ones the newest.
#[derive(Clone, Copy, Debug)]
pub struct MostCertain;

/// All facts.
#[derive(Clone, Copy, Debug)]
pub struct Union;

impl Merge for Newest {
    type View<'a, T: 'a> = Option<&'a Fact<T>>;

    fn merge<T>(facts: &[Fact<T>]) -> Option<&Fact<T>> {
        Live(facts.iter()).reduce(|best, fact| if fact.time > best.time { fact } else { best })
    }
}

impl Merge for MostCertain {
    type View<'a, T: 'a> = Option<&'a Fact<T>>;

    fn merge<T>(facts: &[Fact<T>]) -> Option<&Fact<T>> {
        let better = |fact: &Fact<T>, best: &Fact<T>| {
            fact.certainty > best.certainty || (fact.certainty == best.certainty && fact.time > best.time)
        };
        Live(facts.iter()).reduce(|best, fact| if better(fact, best) { fact } else { best })
    }
}

impl Merge for Union {
    type View<'a, T: 'a> = Live<'a, T>;

    fn merge<T>(facts: &[Fact<T>]) -> Live<'_, T> {
        Live(facts.iter())
    }
}

/// The facts that were not taken back, ordered by origin.
#[derive(Clone, Debug)]
pub struct Live<'a, T>(std::slice::Iter<'a, Fact<T>>);

impl<'a, T> Iterator for Live<'a, T> {
    type Item = &'a Fact<T>;

    fn next(&mut self) -> Option<&'a Fact<T>> {
        self.0.find(|fact| fact.value.is_some())
    }
}
