//! Iterators over chunks.
//! Each has the rest of the first one, whole ones, and the rest of the last one.

use std::iter::FusedIterator;
use std::{slice, vec};

/// Entries of a part of a map in the order of their keys.
#[derive(Debug)]
pub struct EntryRange<'m, K, V> {
    pub(crate) front: slice::Iter<'m, (K, V)>,
    pub(crate) chunks: slice::Iter<'m, Vec<(K, V)>>,
    pub(crate) back: slice::Iter<'m, (K, V)>,
}

/// Entries of a part of a map in the order of their keys.
/// Their values can be changed.
#[derive(Debug)]
pub struct EntryRangeMut<'m, K, V> {
    pub(crate) front: slice::IterMut<'m, (K, V)>,
    pub(crate) chunks: slice::IterMut<'m, Vec<(K, V)>>,
    pub(crate) back: slice::IterMut<'m, (K, V)>,
}

#[derive(Debug)]
struct IntoChunks<K, V> {
    front: vec::IntoIter<(K, V)>,
    chunks: vec::IntoIter<Vec<(K, V)>>,
    back: vec::IntoIter<(K, V)>,
}

/// Entries of a map in the order of their keys.
#[derive(Debug)]
pub struct Entries<'m, K, V> {
    part: EntryRange<'m, K, V>,
    left: usize,
}

/// Entries of a map in the order of their keys, with values that can be changed.
#[derive(Debug)]
pub struct EntriesMut<'m, K, V> {
    part: EntryRangeMut<'m, K, V>,
    left: usize,
}

/// Entries that were a map, in the order of their keys.
#[derive(Debug)]
pub struct IntoEntries<K, V> {
    part: IntoChunks<K, V>,
    left: usize,
}

impl<'m, K, V> EntryRange<'m, K, V> {
    pub(crate) fn of(chunks: &'m [Vec<(K, V)>]) -> Self {
        Self { front: [].iter(), chunks: chunks.iter(), back: [].iter() }
    }
}

impl<'m, K, V> EntryRangeMut<'m, K, V> {
    pub(crate) fn of(chunks: &'m mut [Vec<(K, V)>]) -> Self {
        Self { front: [].iter_mut(), chunks: chunks.iter_mut(), back: [].iter_mut() }
    }
}

impl<'m, K, V> Entries<'m, K, V> {
    pub(crate) fn new(chunks: &'m [Vec<(K, V)>], left: usize) -> Self {
        Self { part: EntryRange::of(chunks), left }
    }
}

impl<'m, K, V> EntriesMut<'m, K, V> {
    pub(crate) fn new(chunks: &'m mut [Vec<(K, V)>], left: usize) -> Self {
        Self { part: EntryRangeMut::of(chunks), left }
    }
}

impl<K, V> IntoEntries<K, V> {
    pub(crate) fn new(chunks: Vec<Vec<(K, V)>>, left: usize) -> Self {
        let (front, back) = (Vec::new().into_iter(), Vec::new().into_iter());
        Self { part: IntoChunks { front, chunks: chunks.into_iter(), back }, left }
    }
}

impl<K, V> Clone for EntryRange<'_, K, V> {
    fn clone(&self) -> Self {
        Self { front: self.front.clone(), chunks: self.chunks.clone(), back: self.back.clone() }
    }
}

impl<K, V> Clone for Entries<'_, K, V> {
    fn clone(&self) -> Self {
        Self { part: self.part.clone(), left: self.left }
    }
}

macro_rules! over_chunks {
    ($name:ident<$($lifetime:lifetime)?>: $item:ty, $entries:ident, |$entry:pat_param| $value:expr) => {
        impl<$($lifetime,)? K, V> Iterator for $name<$($lifetime,)? K, V> {
            type Item = $item;

            fn next(&mut self) -> Option<$item> {
                loop {
                    if let Some($entry) = self.front.next() {
                        return Some($value);
                    }
                    match self.chunks.next() {
                        Some(chunk) => self.front = chunk.$entries(),
                        None if self.back.len() == 0 => return None,
                        None => std::mem::swap(&mut self.front, &mut self.back),
                    }
                }
            }

            fn size_hint(&self) -> (usize, Option<usize>) {
                (self.front.len() + self.back.len(), None)
            }
        }

        impl<$($lifetime,)? K, V> DoubleEndedIterator for $name<$($lifetime,)? K, V> {
            fn next_back(&mut self) -> Option<$item> {
                loop {
                    if let Some($entry) = self.back.next_back() {
                        return Some($value);
                    }
                    match self.chunks.next_back() {
                        Some(chunk) => self.back = chunk.$entries(),
                        None if self.front.len() == 0 => return None,
                        None => std::mem::swap(&mut self.front, &mut self.back),
                    }
                }
            }
        }

        impl<$($lifetime,)? K, V> FusedIterator for $name<$($lifetime,)? K, V> {}
    };
}

over_chunks!(EntryRange<'m>: (&'m K, &'m V), iter, |(key, value)| (key, value));
over_chunks!(EntryRangeMut<'m>: (&'m K, &'m mut V), iter_mut, |(key, value)| (&*key, value));
over_chunks!(IntoChunks<>: (K, V), into_iter, |entry| entry);

macro_rules! counted {
    ($name:ident<$($lifetime:lifetime)?>: $item:ty) => {
        impl<$($lifetime,)? K, V> Iterator for $name<$($lifetime,)? K, V> {
            type Item = $item;

            fn next(&mut self) -> Option<$item> {
                self.left = self.left.saturating_sub(1);
                self.part.next()
            }

            fn size_hint(&self) -> (usize, Option<usize>) {
                (self.left, Some(self.left))
            }
        }

        impl<$($lifetime,)? K, V> DoubleEndedIterator for $name<$($lifetime,)? K, V> {
            fn next_back(&mut self) -> Option<$item> {
                self.left = self.left.saturating_sub(1);
                self.part.next_back()
            }
        }

        impl<$($lifetime,)? K, V> ExactSizeIterator for $name<$($lifetime,)? K, V> {}
        impl<$($lifetime,)? K, V> FusedIterator for $name<$($lifetime,)? K, V> {}
    };
}

counted!(Entries<'m>: (&'m K, &'m V));
counted!(EntriesMut<'m>: (&'m K, &'m mut V));
counted!(IntoEntries<>: (K, V));
