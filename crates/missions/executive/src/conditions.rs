//! Conditions of missions.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;

use crate::activity_hash::ActivityHash;

/// Name of a condition in guards, such as `obstacle`.
pub type ConditionName = Text<28>;

/// A condition and whether it holds.
#[interface]
#[derive(PartialEq)]
pub struct ConditionValue {
    /// Name in guards, such as `obstacle`.
    pub name: ConditionName,
    /// Whether it holds.
    pub holds: Bool,
}

/// Conditions of a mission; one that is not named is unknown.
#[interface]
#[derive(PartialEq)]
pub struct ConditionValues {
    /// The conditions.
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
pub struct KnownConditions(BTreeMap<String, bool>);

impl KnownConditions {
    /// Takes new values.
    pub fn update(&mut self, values: &ConditionValues) {
        for ConditionValue { name, holds } in values.conditions.iter() {
            match self.0.get_mut(name.as_str()) {
                Some(known) => *known = holds.get(),
                None => {
                    self.0.insert(name.as_str().into(), holds.get());
                }
            }
        }
    }

    /// Takes the value of one condition.
    pub fn set(&mut self, name: &str, holds: bool) {
        self.0.insert(name.into(), holds);
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
