//! Iterators over chunks.
//! Each has the rest of the first one, whole ones, and the rest of the last one.

use std::iter::FusedIterator;
use std::{slice, vec};

/// Entries of a map in the order of their keys.
#[derive(Debug)]
pub struct Entries<'m, K, V> {
    pub(crate) front: slice::Iter<'m, (K, V)>,
    pub(crate) chunks: slice::Iter<'m, Vec<(K, V)>>,
    pub(crate) back: slice::Iter<'m, (K, V)>,
    pub(crate) left: usize,
}

/// Entries of a map in the order of their keys, with values that can be changed.
#[derive(Debug)]
pub struct EntriesMut<'m, K, V> {
    pub(crate) front: slice::IterMut<'m, (K, V)>,
    pub(crate) chunks: slice::IterMut<'m, Vec<(K, V)>>,
    pub(crate) back: slice::IterMut<'m, (K, V)>,
    pub(crate) left: usize,
}

/// Entries that were a map, in the order of their keys.
#[derive(Debug)]
pub struct IntoEntries<K, V> {
    pub(crate) front: vec::IntoIter<(K, V)>,
    pub(crate) chunks: vec::IntoIter<Vec<(K, V)>>,
    pub(crate) back: vec::IntoIter<(K, V)>,
    pub(crate) left: usize,
}

impl<K, V> Clone for Entries<'_, K, V> {
    fn clone(&self) -> Self {
        Self {
            front: self.front.clone(),
            chunks: self.chunks.clone(),
            back: self.back.clone(),
            left: self.left,
        }
    }
}

macro_rules! over_chunks {
    ($name:ident<$($lifetime:lifetime)?>: $item:ty, $entries:ident, |$entry:pat_param| $value:expr) => {
        impl<$($lifetime,)? K, V> Iterator for $name<$($lifetime,)? K, V> {
            type Item = $item;

            fn next(&mut self) -> Option<$item> {
                loop {
                    if let Some($entry) = self.front.next() {
                        self.left -= 1;
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
                (self.left, Some(self.left))
            }
        }

        impl<$($lifetime,)? K, V> DoubleEndedIterator for $name<$($lifetime,)? K, V> {
            fn next_back(&mut self) -> Option<$item> {
                loop {
                    if let Some($entry) = self.back.next_back() {
                        self.left -= 1;
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

        impl<$($lifetime,)? K, V> ExactSizeIterator for $name<$($lifetime,)? K, V> {}
        impl<$($lifetime,)? K, V> FusedIterator for $name<$($lifetime,)? K, V> {}
    };
}

over_chunks!(Entries<'m>: (&'m K, &'m V), iter, |(key, value)| (key, value));
over_chunks!(EntriesMut<'m>: (&'m K, &'m mut V), iter_mut, |(key, value)| (&*key, value));
over_chunks!(IntoEntries<>: (K, V), into_iter, |entry| entry);
