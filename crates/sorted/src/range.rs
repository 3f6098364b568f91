//! Parts of a map.

use std::borrow::Borrow;
use std::mem;
use std::ops::{Bound, RangeBounds};

use crate::iterators::{EntryRange, EntryRangeMut};
use crate::map::{EntryPosition, SortedMap};

impl<K: Ord, V> SortedMap<K, V> {
    /// Entries whose keys are in a range, in their order.
    /// There are none if the range ends before it starts.
    pub fn range<Q: Ord + ?Sized, R: RangeBounds<Q>>(&self, range: R) -> EntryRange<'_, K, V>
    where
        K: Borrow<Q>,
    {
        let (start, end) = (self.start(range.start_bound()), self.end(range.end_bound()));
        if start >= end {
            return EntryRange::of(&[]);
        }
        let first = &self.chunks[start.chunk];
        if start.chunk == end.chunk {
            return EntryRange { front: first[start.index..end.index].iter(), ..EntryRange::of(&[]) };
        }
        let last = self.chunks.get(end.chunk).map_or(&[][..], |last| &last[..end.index]);
        EntryRange {
            front: first[start.index..].iter(),
            chunks: self.chunks[start.chunk + 1..end.chunk].iter(),
            back: last.iter(),
        }
    }

    /// As [`range`](Self::range), with values that can be changed.
    pub fn range_mut<Q: Ord + ?Sized, R: RangeBounds<Q>>(&mut self, range: R) -> EntryRangeMut<'_, K, V>
    where
        K: Borrow<Q>,
    {
        let (start, end) = (self.start(range.start_bound()), self.end(range.end_bound()));
        let mut part = EntryRangeMut::of(&mut []);
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
        if at == (EntryPosition { chunk: 0, index: 0 }) {
            return mem::take(self);
        }
        if self
            .chunks
            .get(at.chunk)
            .is_none_or(|chunk| at.chunk + 1 == self.chunks.len() && at.index == chunk.len())
        {
            return Self::new();
        }
        let mut upper = Self { chunks: self.chunks.split_off(at.chunk + 1), ..Self::new() };
        let first = self.chunks[at.chunk].split_off(at.index);
        upper.chunks.insert(0, first);
        upper.recount();
        self.recount();
        upper
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
