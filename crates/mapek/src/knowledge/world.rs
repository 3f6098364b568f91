use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Fact, Facts, Merge};

/// What the robot knows of the world: facts by key, such as the positions of other robots by their numbers.
///
/// Keep it in the state of a [`Knowledge`](super::Knowledge), with a key and a value that fit the application.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    bound = "K: Ord + Serialize + serde::de::DeserializeOwned, T: Serialize + serde::de::DeserializeOwned"
)]
pub struct WorldModel<K, T> {
    // A list of pairs, as a map's keys must be text in some formats.
    #[serde(with = "pairs")]
    facts: BTreeMap<K, Facts<T>>,
}

impl<K: Ord, T> Default for WorldModel<K, T> {
    fn default() -> Self {
        Self { facts: BTreeMap::new() }
    }
}

impl<K: Ord, T> WorldModel<K, T> {
    /// Takes a statement about the key over if it is its origin's newest; says whether it was.
    pub fn tell(&mut self, key: K, fact: Fact<T>) -> bool {
        self.facts.entry(key).or_default().tell(fact)
    }

    /// What is known of the key.
    pub fn facts(&self, key: &K) -> Option<&Facts<T>> {
        self.facts.get(key)
    }

    /// All keys with what that view sees of them, in order.
    pub fn view<M: Merge>(&self) -> impl Iterator<Item = (&K, M::View<'_, T>)> {
        self.facts.iter().map(|(key, facts)| (key, facts.view::<M>()))
    }
}

mod pairs {
    use std::collections::BTreeMap;

    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::DeserializeOwned};

    pub fn serialize<K: Serialize, V: Serialize, S: Serializer>(
        map: &BTreeMap<K, V>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(map)
    }

    pub fn deserialize<'de, K: Ord + DeserializeOwned, V: DeserializeOwned, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<BTreeMap<K, V>, D::Error> {
        Ok(Vec::<(K, V)>::deserialize(deserializer)?.into_iter().collect())
    }
}
