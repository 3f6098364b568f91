use std::collections::BTreeSet;
use std::sync::Arc;

/// Keys about which something may have changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Changed {
    /// These, in order.
    Keys(BTreeSet<Arc<[u8]>>),
    /// More than are remembered: look at all, also at those that were there before.
    All,
}

impl Default for Changed {
    fn default() -> Self {
        Self::Keys(BTreeSet::new())
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
