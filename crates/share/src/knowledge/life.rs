use std::ops::Bound;
use std::sync::Arc;

use slate_sorted::SortedMap;

use super::Limits;
use super::limits::FACT_BYTES;

/// State of one life of an origin after its statement number `version`.
/// It equals the state of the origin itself at that version, so two replicas with the same version of a life have the
/// same bytes.
#[derive(Clone, Debug)]
pub(crate) struct Life {
    pub epoch: u64,
    pub version: u64,
    /// Number up to which retractions are forgotten.
    /// A replica that knows less must take the whole life, not the changes.
    pub floor: u64,
    /// Invalidation of all earlier lives of the origin.
    pub closes: bool,
    entries: SortedMap<u64, LifeEntry>,
    keys: SortedMap<Arc<[u8]>, u64>,
    bytes: usize,
    retractions: usize,
}

/// Last statement of a life about a key.
#[derive(Clone, Debug)]
pub(crate) struct LifeEntry {
    pub key: Arc<[u8]>,
    pub time: u64,
    pub order: u64,
    /// Content of the statement; `None` for a retraction.
    pub body: Option<StatementBody>,
}

#[derive(Clone, Debug)]
pub(crate) struct StatementBody {
    pub schema: u64,
    pub certainty: f64,
    pub value: Box<[u8]>,
}

impl LifeEntry {
    /// Returns the memory of the entry, bytes, by the measure of [`Limits::bytes`].
    pub fn bytes(&self) -> usize {
        FACT_BYTES + self.key.len() + self.body.as_ref().map_or(0, |body| body.value.len())
    }
}

impl Life {
    pub fn new(epoch: u64) -> Self {
        Self {
            epoch,
            version: 0,
            floor: 0,
            closes: false,
            entries: SortedMap::new(),
            keys: SortedMap::new(),
            bytes: 0,
            retractions: 0,
        }
    }

    pub fn len(&self) -> usize {
        self.entries.len()
    }

    pub fn bytes(&self) -> usize {
        self.bytes
    }

    pub fn retractions(&self) -> usize {
        self.retractions
    }

    pub fn keys(&self) -> impl Iterator<Item = &Arc<[u8]>> {
        self.keys.keys()
    }

    /// Returns the last statement about the key, with its number.
    pub fn entry(&self, key: &[u8]) -> Option<(u64, &LifeEntry)> {
        let sequence = *self.keys.get(key)?;
        self.entries.get(&sequence).map(|entry| (sequence, entry))
    }

    /// Returns the entries after that number, in order.
    pub fn after(&self, sequence: u64) -> impl Iterator<Item = (u64, &LifeEntry)> {
        let range = (Bound::Excluded(sequence), Bound::Unbounded);
        self.entries.range(range).map(|(sequence, entry)| (*sequence, entry))
    }

    /// Takes a statement in the place of an earlier one about the same key.
    pub fn insert(&mut self, sequence: u64, entry: LifeEntry) {
        match self.keys.get_mut(&*entry.key) {
            Some(known) if *known >= sequence => return,
            Some(known) => {
                let earlier = std::mem::replace(known, sequence);
                self.forget_entry(earlier);
            }
            None => {
                self.keys.insert(entry.key.clone(), sequence);
            }
        }
        self.bytes += entry.bytes();
        self.retractions += usize::from(entry.body.is_none());
        self.entries.insert(sequence, entry);
    }

    fn forget_entry(&mut self, sequence: u64) -> Option<LifeEntry> {
        let entry = self.entries.remove(&sequence)?;
        self.bytes -= entry.bytes();
        self.retractions -= usize::from(entry.body.is_none());
        Some(entry)
    }

    /// Forgets retractions up to that number.
    pub fn raise_floor(&mut self, floor: u64) {
        if floor <= self.floor {
            return;
        }
        self.floor = floor;
        if self.retractions == 0 {
            return;
        }
        let forgotten: Vec<u64> = (self.entries.range(..=floor))
            .filter(|(_, entry)| entry.body.is_none())
            .map(|(sequence, _)| *sequence)
            .collect();
        for sequence in forgotten {
            if let Some(entry) = self.forget_entry(sequence) {
                self.keys.remove(&entry.key);
            }
        }
    }

    /// Returns whether the life has room for the entry.
    pub fn has_room(&self, entry: &LifeEntry, limits: &Limits) -> bool {
        let earlier = self.entry(&entry.key).map(|(_, earlier)| earlier.bytes());
        let facts = self.len() + usize::from(earlier.is_none());
        let bytes = self.bytes + entry.bytes() - earlier.unwrap_or_default();
        facts <= limits.facts && bytes <= limits.bytes
    }

    /// Returns whether the life exceeds the limits.
    pub fn exceeds(&self, limits: &Limits) -> bool {
        self.len() > limits.facts || self.bytes > limits.bytes
    }
}
