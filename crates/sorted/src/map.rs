use std::borrow::Borrow;
use std::mem;

use crate::iterators::{Entries, EntriesMut};

/// Maximum number of entries of a chunk, up to 2048 chunks.
/// They are few enough to be moved in no time, and enough that few chunks are moved.
const CHUNK: usize = 128;

/// Values by key, in the order of their keys.
#[derive(Clone)]
pub struct SortedMap<K, V> {
    /// Parts of the map, whose keys ascend from one to the next.
    /// None is empty, but the only one, whose room serves the next entry.
    pub(crate) chunks: Vec<Vec<(K, V)>>,
    pub(crate) length: usize,
}

/// Position of an entry, or of one to be.
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
        // Empty, also when the end of an entry panics.
        let mut chunks = mem::take(&mut self.chunks);
        self.length = 0;
        chunks.truncate(1);
        chunks.iter_mut().for_each(Vec::clear);
        self.chunks = chunks;
    }

    /// Entries in the order of their keys.
    #[must_use]
    pub fn iter(&self) -> Entries<'_, K, V> {
        Entries::new(&self.chunks, self.length)
    }

    /// Entries in the order of their keys, with values that can be changed.
    pub fn iter_mut(&mut self) -> EntriesMut<'_, K, V> {
        EntriesMut::new(&mut self.chunks, self.length)
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
        let index = self.chunks[chunk].len().checked_sub(1)?;
        Some(self.remove_at(EntryPosition { chunk, index }))
    }

    /// Keeps the entries that `keep` wants, and asks for each in the order of the keys.
    pub fn retain(&mut self, mut keep: impl FnMut(&K, &mut V) -> bool) {
        let map = Recounted(self);
        for chunk in &mut map.0.chunks {
            chunk.retain_mut(|(key, value)| keep(key, value));
        }
    }

    /// Takes out the entries for which `is_wanted` returns true.
    /// It is asked for each, in the order of the keys.
    pub fn extract_if(&mut self, mut is_wanted: impl FnMut(&K, &mut V) -> bool) -> Vec<(K, V)> {
        let map = Recounted(self);
        let mut found = Vec::new();
        for chunk in &mut map.0.chunks {
            found.extend(chunk.extract_if(.., |(key, value)| is_wanted(key, value)));
        }
        found
    }

    pub(crate) fn value_mut(&mut self, at: EntryPosition) -> &mut V {
        &mut self.chunks[at.chunk][at.index].1
    }

    pub(crate) fn remove_at(&mut self, at: EntryPosition) -> (K, V) {
        let chunk = &mut self.chunks[at.chunk];
        let entry = chunk.remove(at.index);
        self.length -= 1;
        if chunk.len() < CHUNK / 4 && self.chunks.len() > 1 {
            self.join(at.chunk);
        }
        entry
    }

    /// Moves the entries of a small chunk to a neighbor with room.
    /// Without one it gives the rest of its own room back.
    fn join(&mut self, small: usize) {
        let length = self.chunks[small].len();
        let has_room = |chunk: Option<&Vec<_>>| chunk.is_some_and(|chunk| chunk.len() + length <= CHUNK / 2);
        let lower = match small.checked_sub(1) {
            Some(below) if has_room(self.chunks.get(below)) => below,
            _ if has_room(self.chunks.get(small + 1)) => small,
            _ if length == 0 => {
                self.chunks.remove(small);
                return;
            }
            _ => return self.chunks[small].shrink_to(CHUNK / 2),
        };
        let mut upper = self.chunks.remove(lower + 1);
        self.chunks[lower].append(&mut upper);
    }

    /// Restores what holds for chunks, after entries were taken out of any of them.
    pub(crate) fn recount(&mut self) {
        let mut joined: Vec<Vec<_>> = Vec::new();
        for mut chunk in mem::take(&mut self.chunks) {
            match joined.last_mut() {
                Some(last) if last.len() + chunk.len() <= CHUNK / 2 || chunk.is_empty() => {
                    last.append(&mut chunk)
                }
                _ => joined.push(chunk),
            }
        }
        if joined.len() > 1 && joined[0].is_empty() {
            joined.remove(0);
        }
        self.length = joined.iter().map(Vec::len).sum();
        self.chunks = joined;
    }

    /// Adds an entry where its key belongs, and returns its position.
    pub(crate) fn insert_at(&mut self, mut at: EntryPosition, key: K, value: V) -> EntryPosition {
        if self.chunks.is_empty() {
            self.chunks.reserve_exact(1);
            self.chunks.push(Vec::new());
        }
        // More in each of very many, so that neither the chunks nor their list are long.
        let limit = CHUNK.max(self.chunks.len() / 16);
        if self.chunks[at.chunk].len() >= limit {
            at = self.split(at);
        }
        self.chunks[at.chunk].insert(at.index, (key, value));
        self.length += 1;
        at
    }

    /// Makes room in a full chunk.
    /// Maps that are filled in order keep full chunks.
    fn split(&mut self, at: EntryPosition) -> EntryPosition {
        let length = self.chunks[at.chunk].len();
        let kept = if at.index == length { length } else { length / 2 };
        let upper = self.chunks[at.chunk].split_off(kept);
        self.chunks.insert(at.chunk + 1, upper);
        if at.index > kept || kept == length {
            EntryPosition { chunk: at.chunk + 1, index: at.index - kept }
        } else {
            at
        }
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
}

/// Map of which a call takes entries out.
/// It is whole again at the end, also after a panic of the call.
struct Recounted<'m, K, V>(&'m mut SortedMap<K, V>);

impl<K, V> Drop for Recounted<'_, K, V> {
    fn drop(&mut self) {
        self.0.recount();
    }
}
