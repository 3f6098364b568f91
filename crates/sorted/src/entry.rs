use std::mem;

use crate::map::{EntryPosition, SortedMap};

/// The place of a key in a map.
pub enum MapEntry<'m, K, V> {
    /// The key has a value.
    Occupied(OccupiedEntry<'m, K, V>),
    /// The key has none.
    Vacant(VacantEntry<'m, K, V>),
}

/// The place of a key with a value.
pub struct OccupiedEntry<'m, K, V> {
    pub(crate) map: &'m mut SortedMap<K, V>,
    pub(crate) at: EntryPosition,
    pub(crate) key: K,
}

/// The place of a key without a value.
pub struct VacantEntry<'m, K, V> {
    pub(crate) map: &'m mut SortedMap<K, V>,
    pub(crate) at: EntryPosition,
    pub(crate) key: K,
}

impl<K: Ord, V> SortedMap<K, V> {
    /// The place of a key, with or without a value.
    pub fn entry(&mut self, key: K) -> MapEntry<'_, K, V> {
        match self.find(&key) {
            Ok(at) => MapEntry::Occupied(OccupiedEntry { map: self, at, key }),
            Err(at) => MapEntry::Vacant(VacantEntry { map: self, at, key }),
        }
    }
}

impl<'m, K, V> MapEntry<'m, K, V> {
    /// The value, after it has become `value` if there was none.
    pub fn or_insert(self, value: V) -> &'m mut V {
        match self {
            Self::Occupied(entry) => entry.into_mut(),
            Self::Vacant(entry) => entry.insert(value),
        }
    }

    /// The value, after it has become what `value` gives if there was none.
    pub fn or_insert_with(self, value: impl FnOnce() -> V) -> &'m mut V {
        match self {
            Self::Occupied(entry) => entry.into_mut(),
            Self::Vacant(entry) => entry.insert(value()),
        }
    }

    /// The value, after it has become the default of its type if there was none.
    pub fn or_default(self) -> &'m mut V
    where
        V: Default,
    {
        match self {
            Self::Occupied(entry) => entry.into_mut(),
            Self::Vacant(entry) => entry.insert(V::default()),
        }
    }

    /// Changes the value, if there is one.
    pub fn and_modify(mut self, change: impl FnOnce(&mut V)) -> Self {
        if let Self::Occupied(entry) = &mut self {
            change(entry.get_mut());
        }
        self
    }

    /// The key that was asked for.
    pub const fn key(&self) -> &K {
        match self {
            Self::Occupied(OccupiedEntry { key, .. }) | Self::Vacant(VacantEntry { key, .. }) => key,
        }
    }
}

impl<'m, K, V> OccupiedEntry<'m, K, V> {
    /// The key that was asked for.
    pub const fn key(&self) -> &K {
        &self.key
    }

    /// The value.
    pub fn get(&self) -> &V {
        &self.map.chunks[self.at.chunk][self.at.index].1
    }

    /// The value, which can be changed.
    pub fn get_mut(&mut self) -> &mut V {
        self.map.value_mut(self.at)
    }

    /// The value, for as long as the map.
    pub fn into_mut(self) -> &'m mut V {
        self.map.value_mut(self.at)
    }

    /// Another value, for the one that there was.
    pub fn insert(&mut self, value: V) -> V {
        mem::replace(self.get_mut(), value)
    }

    /// Removes the key, and returns its value.
    pub fn remove(self) -> V {
        self.map.remove_at(self.at).1
    }
}

impl<'m, K, V> VacantEntry<'m, K, V> {
    /// The key that was asked for.
    pub const fn key(&self) -> &K {
        &self.key
    }

    /// The key that was asked for, without a change to the map.
    pub fn into_key(self) -> K {
        self.key
    }

    /// Gives the key a value.
    pub fn insert(self, value: V) -> &'m mut V {
        let at = self.map.insert_at(self.at, self.key, value);
        self.map.value_mut(at)
    }
}
