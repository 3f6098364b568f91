use std::sync::Arc;

use slate_sorted::SortedSet;

/// Keys whose facts may have changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Changed {
    /// Changed keys, in order.
    Keys(SortedSet<Arc<[u8]>>),
    /// Overflow: any key may have changed, including removed ones.
    All,
}

impl Default for Changed {
    fn default() -> Self {
        Self::Keys(SortedSet::new())
    }
}

impl Changed {
    /// Adds keys, as long as there is room for them.
    pub(super) fn extend(&mut self, keys: impl IntoIterator<Item = Arc<[u8]>>, limit: usize) {
        if let Self::Keys(known) = self {
            known.extend(keys);
            if known.len() > limit {
                *self = Self::All;
            }
        }
    }

    pub(super) fn len(&self) -> usize {
        match self {
            Self::Keys(keys) => keys.len(),
            Self::All => 0,
        }
    }
}
