use std::borrow::Borrow;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::mem;
use std::ops::{Bound, Index, RangeBounds};

use crate::iterators::{Entries, EntriesMut, IntoEntries};

/// Maximum number of entries of a chunk.
/// They are few enough to be moved in no time, and enough that few chunks are moved.
const CHUNK: usize = 128;

/// Values by key, in the order of their keys.
#[derive(Clone)]
pub struct SortedMap<K, V> {
    /// None is empty, and keys ascend from one to the next.
    pub(crate) chunks: Vec<Vec<(K, V)>>,
    length: usize,
}

/// Position of an entry, or of one to be.
/// An index at the end of a chunk occurs in the last one alone.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct EntryPosition {
    pub chunk: usize,
    pub index: usize,
}

impl<K, V> SortedMap<K, V> {
    /// A map without entries, which allocates nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { chunks: Vec::new(), length: 0 }
    }

    /// Number of entries.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.length
    }

    /// Returns true if there are no entries.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Removes all entries.
    pub fn clear(&mut self) {
        self.chunks.clear();
        self.length = 0;
    }

    /// Entries in the order of their keys.
    #[must_use]
    pub fn iter(&self) -> Entries<'_, K, V> {
        Entries { front: [].iter(), chunks: self.chunks.iter(), back: [].iter(), left: self.length }
    }

    /// Entries in the order of their keys, with values that can be changed.
    pub fn iter_mut(&mut self) -> EntriesMut<'_, K, V> {
        EntriesMut {
            front: [].iter_mut(),
            chunks: self.chunks.iter_mut(),
            back: [].iter_mut(),
            left: self.length,
        }
    }

    /// Keys in their order.
    pub fn keys(&self) -> impl DoubleEndedIterator<Item = &K> + ExactSizeIterator + Clone {
        self.iter().map(|(key, _)| key)
    }

    /// Values in the order of their keys.
    pub fn values(&self) -> impl DoubleEndedIterator<Item = &V> + ExactSizeIterator + Clone {
        self.iter().map(|(_, value)| value)
    }

    /// Values in the order of their keys, which can be changed.
    pub fn values_mut(&mut self) -> impl DoubleEndedIterator<Item = &mut V> + ExactSizeIterator {
        self.iter_mut().map(|(_, value)| value)
    }

    /// The keys alone, in their order.
    pub fn into_keys(self) -> impl DoubleEndedIterator<Item = K> + ExactSizeIterator {
        self.into_iter().map(|(key, _)| key)
    }

    /// The values alone, in the order of their keys.
    pub fn into_values(self) -> impl DoubleEndedIterator<Item = V> + ExactSizeIterator {
        self.into_iter().map(|(_, value)| value)
    }

    /// The entry with the least key.
    #[must_use]
    pub fn first_key_value(&self) -> Option<(&K, &V)> {
        self.chunks.first()?.first().map(|(key, value)| (key, value))
    }

    /// The entry with the greatest key.
    #[must_use]
    pub fn last_key_value(&self) -> Option<(&K, &V)> {
        self.chunks.last()?.last().map(|(key, value)| (key, value))
    }

    /// Removes the entry with the least key.
    pub fn pop_first(&mut self) -> Option<(K, V)> {
        (self.length > 0).then(|| self.remove_at(EntryPosition { chunk: 0, index: 0 }))
    }

    /// Removes the entry with the greatest key.
    pub fn pop_last(&mut self) -> Option<(K, V)> {
        let chunk = self.chunks.len().checked_sub(1)?;
        Some(self.remove_at(EntryPosition { chunk, index: self.chunks[chunk].len() - 1 }))
    }

    /// Keeps the entries that `keep` wants, and asks for each in the order of the keys.
    pub fn retain(&mut self, mut keep: impl FnMut(&K, &mut V) -> bool) {
        self.length = 0;
        for chunk in &mut self.chunks {
            chunk.retain_mut(|(key, value)| keep(key, value));
            self.length += chunk.len();
        }
        self.chunks.retain(|chunk| !chunk.is_empty());
    }

    /// Takes out the entries for which `is_wanted` returns true.
    /// It is asked for each, in the order of the keys.
    pub fn extract_if(&mut self, mut is_wanted: impl FnMut(&K, &mut V) -> bool) -> Vec<(K, V)> {
        let mut found = Vec::new();
        for chunk in &mut self.chunks {
            found.extend(chunk.extract_if(.., |(key, value)| is_wanted(key, value)));
        }
        self.chunks.retain(|chunk| !chunk.is_empty());
        self.length -= found.len();
        found
    }

    pub(crate) fn value_mut(&mut self, at: EntryPosition) -> &mut V {
        &mut self.chunks[at.chunk][at.index].1
    }

    pub(crate) fn remove_at(&mut self, at: EntryPosition) -> (K, V) {
        let chunk = &mut self.chunks[at.chunk];
        let entry = chunk.remove(at.index);
        if chunk.is_empty() {
            self.chunks.remove(at.chunk);
        }
        self.length -= 1;
        entry
    }

    /// EntryPosition of a new entry, which goes where its key belongs.
    pub(crate) fn insert_at(&mut self, mut at: EntryPosition, key: K, value: V) -> EntryPosition {
        if self.chunks.is_empty() {
            self.chunks.push(Vec::new());
        }
        if self.chunks[at.chunk].len() == CHUNK {
            at = self.split(at);
        }
        self.chunks[at.chunk].insert(at.index, (key, value));
        self.length += 1;
        at
    }

    /// Makes room in a full chunk. Maps that are filled in order keep full chunks.
    fn split(&mut self, at: EntryPosition) -> EntryPosition {
        let kept = if at.index == CHUNK { CHUNK } else { CHUNK / 2 };
        let upper = self.chunks[at.chunk].split_off(kept);
        self.chunks.insert(at.chunk + 1, upper);
        if at.index > kept || kept == CHUNK {
            EntryPosition { chunk: at.chunk + 1, index: at.index - kept }
        } else {
            at
        }
    }

    /// The part between two positions.
    fn between(&self, start: EntryPosition, end: EntryPosition) -> Entries<'_, K, V> {
        let mut part = Entries { front: [].iter(), chunks: [].iter(), back: [].iter(), left: 0 };
        if start >= end {
            return part;
        }
        let first = &self.chunks[start.chunk];
        if start.chunk == end.chunk {
            part.front = first[start.index..end.index].iter();
        } else {
            part.front = first[start.index..].iter();
            part.chunks = self.chunks[start.chunk + 1..end.chunk].iter();
            part.back = self.chunks.get(end.chunk).map_or(&[][..], |last| &last[..end.index]).iter();
        }
        part.left = part.front.len() + part.back.len() + part.chunks.clone().map(Vec::len).sum::<usize>();
        part
    }
}

impl<K: Ord, V> SortedMap<K, V> {
    /// The value of a key.
    #[must_use]
    pub fn get<Q: Ord + ?Sized>(&self, key: &Q) -> Option<&V>
    where
        K: Borrow<Q>,
    {
        let at = self.find(key).ok()?;
        Some(&self.chunks[at.chunk][at.index].1)
    }

    /// The value of a key, which can be changed.
    pub fn get_mut<Q: Ord + ?Sized>(&mut self, key: &Q) -> Option<&mut V>
    where
        K: Borrow<Q>,
    {
        let at = self.find(key).ok()?;
        Some(self.value_mut(at))
    }

    /// The value of a key, with the key as it is in the map.
    #[must_use]
    pub fn get_key_value<Q: Ord + ?Sized>(&self, key: &Q) -> Option<(&K, &V)>
    where
        K: Borrow<Q>,
    {
        let at = self.find(key).ok()?;
        let (key, value) = &self.chunks[at.chunk][at.index];
        Some((key, value))
    }

    /// Returns true if a key has a value.
    #[must_use]
    pub fn contains_key<Q: Ord + ?Sized>(&self, key: &Q) -> bool
    where
        K: Borrow<Q>,
    {
        self.find(key).is_ok()
    }

    /// Gives a key a value, and returns the one that it had.
    /// The key stays the one that it was.
    pub fn insert(&mut self, key: K, value: V) -> Option<V> {
        match self.find(&key) {
            Ok(at) => Some(mem::replace(self.value_mut(at), value)),
            Err(at) => {
                self.insert_at(at, key, value);
                None
            }
        }
    }

    /// Removes a key, and returns its value.
    pub fn remove<Q: Ord + ?Sized>(&mut self, key: &Q) -> Option<V>
    where
        K: Borrow<Q>,
    {
        self.remove_entry(key).map(|(_, value)| value)
    }

    /// Removes a key, and returns it with its value.
    pub fn remove_entry<Q: Ord + ?Sized>(&mut self, key: &Q) -> Option<(K, V)>
    where
        K: Borrow<Q>,
    {
        let at = self.find(key).ok()?;
        Some(self.remove_at(at))
    }

    /// Entries whose keys are in a range, in their order.
    /// There are none if the range ends before it starts.
    pub fn range<Q: Ord + ?Sized, R: RangeBounds<Q>>(&self, range: R) -> Entries<'_, K, V>
    where
        K: Borrow<Q>,
    {
        self.between(self.start(range.start_bound()), self.end(range.end_bound()))
    }

    /// As [`range`](Self::range), with values that can be changed.
    pub fn range_mut<Q: Ord + ?Sized, R: RangeBounds<Q>>(&mut self, range: R) -> EntriesMut<'_, K, V>
    where
        K: Borrow<Q>,
    {
        let (start, end) = (self.start(range.start_bound()), self.end(range.end_bound()));
        let left = self.between(start, end).left;
        let mut part = EntriesMut { front: [].iter_mut(), chunks: [].iter_mut(), back: [].iter_mut(), left };
        if start >= end {
            return part;
        }
        if start.chunk == end.chunk {
            part.front = self.chunks[start.chunk][start.index..end.index].iter_mut();
            return part;
        }
        let (below, rest) = self.chunks.split_at_mut(end.chunk);
        if let Some((first, whole)) = below[start.chunk..].split_first_mut() {
            part.front = first[start.index..].iter_mut();
            part.chunks = whole.iter_mut();
        }
        if let Some(last) = rest.first_mut() {
            part.back = last[..end.index].iter_mut();
        }
        part
    }

    /// Takes out the entries from `key` on.
    #[must_use]
    pub fn split_off<Q: Ord + ?Sized>(&mut self, key: &Q) -> Self
    where
        K: Borrow<Q>,
    {
        let at = self.start(Bound::Included(key));
        let mut chunks = Vec::new();
        if at.chunk < self.chunks.len() {
            chunks = self.chunks.split_off(at.chunk + 1);
            chunks.insert(0, self.chunks[at.chunk].split_off(at.index));
            chunks.retain(|chunk| !chunk.is_empty());
            self.chunks.retain(|chunk| !chunk.is_empty());
        }
        let length = chunks.iter().map(Vec::len).sum();
        self.length -= length;
        Self { chunks, length }
    }

    /// Moves all entries of another map here. Its value stays where both have a key.
    pub fn append(&mut self, other: &mut Self) {
        self.extend(mem::take(other));
    }

    /// Position of a key, or else where it belongs.
    pub(crate) fn find<Q: Ord + ?Sized>(&self, key: &Q) -> Result<EntryPosition, EntryPosition>
    where
        K: Borrow<Q>,
    {
        // The first chunk that ends at the key or after it, or else the last one.
        let (mut chunk, mut last) = (0, self.chunks.len().saturating_sub(1));
        while chunk < last {
            let middle = usize::midpoint(chunk, last);
            let entries = &self.chunks[middle];
            if entries[entries.len() - 1].0.borrow() < key {
                chunk = middle + 1;
            } else {
                last = middle;
            }
        }
        let entries = self.chunks.get(chunk).map_or(&[][..], Vec::as_slice);
        match entries.binary_search_by(|(own, _)| own.borrow().cmp(key)) {
            Ok(index) => Ok(EntryPosition { chunk, index }),
            Err(index) => Err(EntryPosition { chunk, index }),
        }
    }

    fn start<Q: Ord + ?Sized>(&self, bound: Bound<&Q>) -> EntryPosition
    where
        K: Borrow<Q>,
    {
        match bound {
            Bound::Included(key) => self.find(key).unwrap_or_else(|at| at),
            Bound::Excluded(key) => self.after(key),
            Bound::Unbounded => EntryPosition { chunk: 0, index: 0 },
        }
    }

    fn end<Q: Ord + ?Sized>(&self, bound: Bound<&Q>) -> EntryPosition
    where
        K: Borrow<Q>,
    {
        match bound {
            Bound::Included(key) => self.after(key),
            Bound::Excluded(key) => self.find(key).unwrap_or_else(|at| at),
            Bound::Unbounded => EntryPosition { chunk: self.chunks.len(), index: 0 },
        }
    }

    /// The first position whose key is above `key`.
    fn after<Q: Ord + ?Sized>(&self, key: &Q) -> EntryPosition
    where
        K: Borrow<Q>,
    {
        match self.find(key) {
            Ok(at) => EntryPosition { index: at.index + 1, ..at },
            Err(at) => at,
        }
    }
}

impl<K, V> Default for SortedMap<K, V> {
    fn default() -> Self {
        Self::new()
    }
}

impl<K: fmt::Debug, V: fmt::Debug> fmt::Debug for SortedMap<K, V> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_map().entries(self).finish()
    }
}

impl<K: PartialEq, V: PartialEq> PartialEq for SortedMap<K, V> {
    fn eq(&self, other: &Self) -> bool {
        self.length == other.length && self.iter().eq(other)
    }
}

impl<K: Eq, V: Eq> Eq for SortedMap<K, V> {}

impl<K: PartialOrd, V: PartialOrd> PartialOrd for SortedMap<K, V> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        self.iter().partial_cmp(other)
    }
}

impl<K: Ord, V: Ord> Ord for SortedMap<K, V> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.iter().cmp(other)
    }
}

impl<K: Hash, V: Hash> Hash for SortedMap<K, V> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.length.hash(state);
        self.iter().for_each(|entry| entry.hash(state));
    }
}

impl<K: Borrow<Q> + Ord, Q: Ord + ?Sized, V> Index<&Q> for SortedMap<K, V> {
    type Output = V;

    /// # Panics
    ///
    /// If the key has no value.
    #[expect(clippy::expect_used, reason = "as the maps of the standard library; `get` does not panic")]
    fn index(&self, key: &Q) -> &V {
        self.get(key).expect("no entry found for key")
    }
}

impl<K: Ord, V> Extend<(K, V)> for SortedMap<K, V> {
    fn extend<I: IntoIterator<Item = (K, V)>>(&mut self, entries: I) {
        for (key, value) in entries {
            self.insert(key, value);
        }
    }
}

impl<K: Ord, V> FromIterator<(K, V)> for SortedMap<K, V> {
    fn from_iter<I: IntoIterator<Item = (K, V)>>(entries: I) -> Self {
        let mut map = Self::new();
        map.extend(entries);
        map
    }
}

impl<K: Ord, V, const N: usize> From<[(K, V); N]> for SortedMap<K, V> {
    fn from(entries: [(K, V); N]) -> Self {
        entries.into_iter().collect()
    }
}

impl<K, V> IntoIterator for SortedMap<K, V> {
    type Item = (K, V);
    type IntoIter = IntoEntries<K, V>;

    fn into_iter(self) -> IntoEntries<K, V> {
        IntoEntries {
            front: Vec::new().into_iter(),
            chunks: self.chunks.into_iter(),
            back: Vec::new().into_iter(),
            left: self.length,
        }
    }
}

impl<'m, K, V> IntoIterator for &'m SortedMap<K, V> {
    type Item = (&'m K, &'m V);
    type IntoIter = Entries<'m, K, V>;

    fn into_iter(self) -> Entries<'m, K, V> {
        self.iter()
    }
}

impl<'m, K, V> IntoIterator for &'m mut SortedMap<K, V> {
    type Item = (&'m K, &'m mut V);
    type IntoIter = EntriesMut<'m, K, V>;

    fn into_iter(self) -> EntriesMut<'m, K, V> {
        self.iter_mut()
    }
}
