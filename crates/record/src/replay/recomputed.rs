//! Comparison of what modules compute on a recording with their recorded outputs.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use slate_blackboard::is_within;

use super::difference::Difference;
use super::run::Written;

/// Comparison of a property with its recorded values.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Recomputed {
    /// The property.
    pub url: String,
    /// Number of equal values.
    pub same: u64,
    /// Number of different values.
    pub different: u64,
    /// Number of recorded values that were not written.
    pub only_recorded: u64,
    /// Number of written values that are not recorded.
    pub only_recomputed: u64,
}

impl Recomputed {
    pub(super) fn has_values(&self) -> bool {
        self.same + self.different + self.only_recorded + self.only_recomputed > 0
    }

    /// Whether there was a value that a module computes; its state is what the host says of it.
    fn is_computed(&self) -> bool {
        self.has_values() && !self.url.ends_with("/state")
    }

    /// Whether nothing differs.
    pub fn is_same(&self) -> bool {
        self.different + self.only_recorded + self.only_recomputed == 0
    }
}

/// Comparison of a run on a recording with it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recomputation {
    /// By property.
    pub properties: Vec<Recomputed>,
    /// The earliest difference.
    pub first: Option<Difference>,
    /// Modules without comparable outputs: they only send messages, or none of their outputs is recorded.
    pub unseen: Vec<String>,
    /// Modules that never wrote, neither then nor now.
    pub silent: Vec<String>,
    /// Outboxes whose messages were not compared, as another sender of their mailbox did not run; each with that mailbox.
    pub unheard: BTreeMap<String, String>,
    /// Whether modules of the recorded run had threads of their own: nothing says which values their ticks saw, nor how many there
    /// were in what is one cycle here, so that what differs may be only that.
    pub has_threads: bool,
    /// What was done while it was recorded and can't be made again, such as going on from a snapshot, in words: what differs may
    /// be only that.
    pub unrepeated: Vec<String>,
    /// Where the modules began with fresh state, whatever they remembered then: nanoseconds after the first value. Nothing when that
    /// was the beginning.
    pub fresh_from: Option<u64>,
}

impl Recomputation {
    /// Whether anything was compared that the modules themselves write.
    pub fn has_compared(&self) -> bool {
        self.properties.iter().any(Recomputed::is_computed) || !self.silent.is_empty()
    }

    /// Takes in what compares beside properties, and where that differs first.
    pub(super) fn add(&mut self, own: Recomputed, first: Option<Difference>) {
        let place = self.properties.partition_point(|other| other.url < own.url);
        self.properties.insert(place, own);
        if let Some(first) = first
            && self.first.as_ref().is_none_or(|other| first.time < other.time)
        {
            self.first = Some(first);
        }
    }

    /// Those of the modules of which nothing was compared.
    ///
    /// Where all was recorded and compared, of those there is nothing.
    pub(super) fn note_unseen(&mut self, modules: &BTreeSet<String>, written: &Written, is_whole: bool) {
        let is_seen = |module: &&String| {
            let writes = |own: &Recomputed| {
                let path = own.url.trim_start_matches('/');
                let writers = written.get(path);
                writers.map_or_else(|| is_within(path, module), |writers| writers.contains(*module))
            };
            self.properties.iter().any(|own| own.is_computed() && writes(own))
        };
        let unseen = modules.iter().filter(|module| !is_seen(module)).cloned();
        let is_silent =
            |module: &String| is_whole && !self.unheard.keys().any(|from| is_within(from, module));
        (self.silent, self.unseen) = unseen.partition(is_silent);
    }
}
