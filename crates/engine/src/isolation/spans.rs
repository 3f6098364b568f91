use slate_sorted::SortedMap;

/// Free spans of an arena: offset to length, bytes; adjacent ones are merged.
#[derive(Debug)]
pub(super) struct Spans(SortedMap<usize, usize>);

/// Granularity of allocation, bytes: a cache line, against false sharing.
/// So one process does not slow another down.
pub(super) const GRANULARITY: usize = 64;

fn round_up(size: usize) -> Option<usize> {
    size.max(1).checked_next_multiple_of(GRANULARITY)
}

impl Spans {
    /// Returns spans with `length` free bytes.
    pub fn new(length: usize) -> Self {
        Self(SortedMap::from([(0, length)]))
    }

    /// Allocates the first span that fits; `align` is a power of two.
    pub fn allocate(&mut self, size: usize, align: usize) -> Option<usize> {
        let (size, align) = (round_up(size)?, align.max(GRANULARITY));
        let (start, length, at) = self.0.iter().find_map(|(&start, &length)| {
            let at = start.checked_next_multiple_of(align)?;
            (at.checked_add(size)? <= start + length).then_some((start, length, at))
        })?;
        self.0.remove(&start);
        if at > start {
            self.0.insert(start, at - start);
        }
        let rest = start + length - (at + size);
        if rest > 0 {
            self.0.insert(at + size, rest);
        }
        Some(at)
    }

    /// Frees a span that [`allocate`](Spans::allocate) returned for that size.
    pub fn free(&mut self, at: usize, size: usize) {
        let Some(mut size) = round_up(size) else { return };
        let mut start = at;
        if let Some(next) = self.0.remove(&(at + size)) {
            size += next;
        }
        if let Some((&before, &length)) = self.0.range(..at).next_back()
            && before + length == at
        {
            start = before;
            size += length;
        }
        self.0.insert(start, size);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{GRANULARITY, Spans};

    const LENGTH: usize = 64 * GRANULARITY;

    proptest! {
        #[test]
        fn allocations_are_aligned_disjoint_and_freed(
            steps in prop::collection::vec((any::<bool>(), 0..9 * GRANULARITY, 0..9_u32), 1..200),
        ) {
            let mut spans = Spans::new(LENGTH);
            let mut taken: Vec<(usize, usize)> = Vec::new();
            for (give, size, align) in steps {
                if give && !taken.is_empty() {
                    let (at, size) = taken.swap_remove(size % taken.len());
                    spans.free(at, size);
                } else if let Some(at) = spans.allocate(size, 1 << align) {
                    prop_assert_eq!(at % (1 << align), 0);
                    prop_assert!(at + size <= LENGTH);
                    for (other, length) in &taken {
                        prop_assert!(at + size.max(1) <= *other || other + (*length).max(1) <= at);
                    }
                    taken.push((at, size));
                }
            }
            for (at, size) in taken {
                spans.free(at, size);
            }
            prop_assert_eq!(spans.allocate(LENGTH, 1), Some(0), "all of it is one span again");
        }
    }

    #[test]
    fn mismatch_is_refused() {
        let mut spans = Spans::new(LENGTH);
        assert_eq!(spans.allocate(LENGTH + 1, 1), None);
        assert_eq!(spans.allocate(usize::MAX, 1), None);
        assert_eq!(spans.allocate(LENGTH, 1), Some(0));
        assert_eq!(spans.allocate(1, 1), None);
    }
}
