use serde::{Deserialize, Serialize};
use slate_sorted::SortedMap;

use slate_module::blackboard::interface::Plain;

use super::{Fact, FactTable, Facts, Merge, Version};

/// World model: facts by key.
/// Examples are the positions of other robots by their numbers.
///
/// Keep it in the state of a [`Knowledge`](super::Knowledge), with a key and a value that fit the application.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    bound = "K: Ord + Serialize + serde::de::DeserializeOwned, T: Serialize + serde::de::DeserializeOwned"
)]
pub struct WorldModel<K, T> {
    // A list of pairs, as a map's keys must be text in some formats.
    #[serde(with = "pairs")]
    facts: SortedMap<K, Facts<T>>,
    /// Revision of the newest table.
    #[serde(default)]
    revision: u64,
}

impl<K: Ord, T> Default for WorldModel<K, T> {
    fn default() -> Self {
        Self { facts: SortedMap::new(), revision: 0 }
    }
}

impl<K: Ord, T> WorldModel<K, T> {
    /// Adds a statement about the key; false if its origin has made a newer one.
    pub fn insert(&mut self, key: K, fact: Fact<T>) -> bool {
        self.facts.entry(key).or_default().insert(fact)
    }

    /// Returns the facts of a key.
    pub fn facts(&self, key: &K) -> Option<&Facts<T>> {
        self.facts.get(key)
    }

    /// Replaces all facts by those of a table, such as the team's.
    ///
    /// Returns the keys with new, changed or retracted facts, in order; none, at once, for the same table.
    ///
    /// [`Newest`](super::Newest) uses the order of the table: a statement made in knowledge of another is newer, whatever the robots' clocks
    /// say.
    pub fn replace(&mut self, table: &FactTable<T>) -> Vec<K>
    where
        K: Clone + for<'k> From<&'k str>,
        T: Plain,
    {
        if table.head.revision == self.revision && self.revision > 0 {
            return Vec::new();
        }
        self.revision = table.head.revision;
        let mut facts: SortedMap<K, Facts<T>> = SortedMap::new();
        let versions = |facts: &Facts<T>| -> Vec<(u32, Version)> {
            facts.all().iter().map(|fact| (fact.origin, fact.version)).collect()
        };
        for stated in table.iter().filter(|stated| !stated.head.retracted.get()) {
            let head = &stated.head;
            let version = Version { epoch: head.epoch, sequence: head.sequence };
            let (origin, certainty, value) = (head.origin, head.certainty, Some(stated.value));
            let fact = Fact { origin, version, time: head.order, certainty, value };
            facts.entry(head.key.as_str().into()).or_default().insert(fact);
        }
        let before = std::mem::replace(&mut self.facts, facts);
        let gone = before.keys().filter(|key| !self.facts.contains_key(*key));
        let new = self
            .facts
            .iter()
            .filter(|(key, facts)| before.get(*key).is_none_or(|known| versions(known) != versions(facts)));
        let mut changed: Vec<K> = gone.chain(new.map(|(key, _)| key)).cloned().collect();
        changed.sort();
        changed
    }

    /// Iterates over all keys with their view, in order.
    pub fn view<M: Merge>(&self) -> impl Iterator<Item = (&K, M::View<'_, T>)> {
        self.facts.iter().map(|(key, facts)| (key, facts.view::<M>()))
    }
}

mod pairs {
    use slate_sorted::SortedMap;

    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::DeserializeOwned};

    pub fn serialize<K: Serialize, V: Serialize, S: Serializer>(
        map: &SortedMap<K, V>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(map)
    }

    pub fn deserialize<'de, K: Ord + DeserializeOwned, V: DeserializeOwned, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<SortedMap<K, V>, D::Error> {
        Ok(Vec::<(K, V)>::deserialize(deserializer)?.into_iter().collect())
    }
}
