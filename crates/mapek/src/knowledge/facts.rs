use serde::{Deserialize, Serialize};

/// Version of a statement.
/// The epoch rises with each restart of its origin, the number with each statement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Version {
    /// Life of the origin.
    pub epoch: u64,
    /// Number of the statement in this life.
    pub sequence: u64,
}

/// Statement of an origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fact<T> {
    /// Origin of the statement.
    pub origin: u32,
    /// Version of the statement.
    pub version: Version,
    /// Time of the statement, nanoseconds.
    pub time: u64,
    /// Certainty of the origin, 0 to 1.
    pub certainty: f64,
    /// Stated value; `None` if retracted.
    pub value: Option<T>,
}

/// Facts about one key: the newest statement of each origin.
///
/// Merging is idempotent and commutative: an older statement never replaces a newer one, nor a retraction. Allocates only for a new origin.
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
    /// Adds a statement if it is its origin's newest; returns whether it was.
    pub fn insert(&mut self, fact: Fact<T>) -> bool {
        match self.facts.binary_search_by_key(&fact.origin, |known| known.origin) {
            Ok(at) if self.facts[at].version < fact.version => self.facts[at] = fact,
            Ok(_) => return false,
            Err(at) => self.facts.insert(at, fact),
        }
        true
    }

    /// Returns a view: [`Newest`], [`MostCertain`], [`Union`] or your own.
    pub fn view<M: Merge>(&self) -> M::View<'_, T> {
        M::merge(&self.facts)
    }

    /// Iterates over all statements, also retracted ones, by origin.
    pub fn all(&self) -> &[Fact<T>] {
        &self.facts
    }
}

/// View of the statements of several origins.
pub trait Merge {
    /// Type of the view.
    type View<'a, T: 'a>;

    /// Merges statements, ordered by origin, into the view.
    fn merge<T>(facts: &[Fact<T>]) -> Self::View<'_, T>;
}

/// Newest fact; of equal ones that of the lowest origin.
#[derive(Clone, Copy, Debug)]
pub struct Newest;

/// Most certain fact; of equal ones the newest.
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

/// Iterates over facts that are not retracted, by origin.
#[derive(Clone, Debug)]
pub struct Live<'a, T>(std::slice::Iter<'a, Fact<T>>);

impl<'a, T> Iterator for Live<'a, T> {
    type Item = &'a Fact<T>;

    fn next(&mut self) -> Option<&'a Fact<T>> {
        self.0.find(|fact| fact.value.is_some())
    }
}
