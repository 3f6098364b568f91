//! Conditions of missions.

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;
use slate_sorted::SortedMap;

use crate::activity_hash::ActivityHash;

/// Maximum number of conditions that a mission knows.
const MOST_CONDITIONS: usize = 256;

/// Name of a condition in guards, such as `obstacle`.
pub type ConditionName = Text<28>;

/// Condition and its value.
#[interface]
#[derive(PartialEq)]
pub struct ConditionValue {
    /// Name in guards, such as `obstacle`.
    pub name: ConditionName,
    /// Value of the condition: true if it holds.
    pub holds: Bool,
}

/// Conditions of a mission; one that is not named is unknown.
#[interface]
#[derive(PartialEq)]
pub struct ConditionValues {
    /// Conditions.
    pub conditions: Sequence<ConditionValue, 8>,
}

impl ConditionValues {
    /// Conditions by their names.
    pub fn new(conditions: &[(&str, bool)]) -> Self {
        let value =
            |(name, holds): &(&str, bool)| ConditionValue { name: Text::new(name), holds: (*holds).into() };
        let values: Vec<ConditionValue> = conditions.iter().map(value).collect();
        Self { conditions: Sequence::new(&values) }
    }
}

/// Newest value of each received condition.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KnownConditions(SortedMap<String, bool>);

impl KnownConditions {
    /// Sets new values.
    ///
    /// # Errors
    /// If they have more names than a mission may know.
    pub fn update(&mut self, values: &ConditionValues) -> Result<(), String> {
        values.conditions.iter().try_for_each(|value| self.set(value.name.as_str(), value.holds.get()))
    }

    /// Sets a new value of a condition.
    ///
    /// # Errors
    /// If there are more than a mission may know.
    pub fn set(&mut self, name: &str, holds: bool) -> Result<(), String> {
        if let Some(known) = self.0.get_mut(name) {
            *known = holds;
        } else if self.0.len() < MOST_CONDITIONS {
            self.0.insert(name.into(), holds);
        } else {
            return Err(format!(
                "expected at most {MOST_CONDITIONS} conditions, found `{name}` beyond them: look what writes them"
            ));
        }
        Ok(())
    }

    /// Iterates over the known conditions, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, bool)> {
        self.0.iter().map(|(name, holds)| (name.as_str(), *holds))
    }

    /// Hashes the values.
    pub fn hash_into(&self, hash: &mut ActivityHash) {
        for (name, holds) in self.iter() {
            hash.text(name);
            hash.number(holds.into());
        }
    }

    /// Returns whether a condition holds; `None` while it is unknown.
    pub fn get(&self, name: &str) -> Option<bool> {
        self.0.get(name).copied()
    }
}
