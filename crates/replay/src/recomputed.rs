//! Comparison of modules' outputs on a recording with their recorded outputs.

use serde::Serialize;
use slate_blackboard::is_within;
use slate_sorted::{SortedMap, SortedSet};

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

    /// Returns true if a module computed any of the values.
    /// A module's state does not count: the host writes it.
    fn is_computed(&self) -> bool {
        self.has_values() && !self.url.ends_with("/state")
    }

    /// Returns true if nothing differs.
    pub fn is_same(&self) -> bool {
        self.different + self.only_recorded + self.only_recomputed == 0
    }
}

/// Comparison of a run on a recording with it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recomputation {
    /// Comparisons by property.
    pub properties: Vec<Recomputed>,
    /// The earliest difference.
    pub first: Option<Difference>,
    /// Modules without comparable outputs.
    /// They only send messages, or none of their outputs is recorded.
    pub unseen: Vec<String>,
    /// Modules that never wrote, neither then nor now.
    pub silent: Vec<String>,
    /// Outboxes whose messages were not compared, each with its mailbox.
    /// Another sender of that mailbox did not run.
    pub unheard: SortedMap<String, String>,
    /// Set if modules of the recorded run had threads of their own.
    /// The values that their ticks saw, and the number of ticks per cycle here, are then unknown, which may be the only
    /// cause of a difference.
    pub has_threads: bool,
    /// Events of the recorded run that can't be repeated, in words.
    /// An example is a restore from a snapshot. They may be the only cause of a difference.
    pub unrepeated: Vec<String>,
    /// Time at which the modules began with fresh state.
    /// Nanoseconds after the first value. The recorded modules may have had memory then. `None` if it was the
    /// beginning.
    pub fresh_from: Option<u64>,
}

impl Recomputation {
    /// Returns true if any value that the modules themselves write was compared.
    pub fn has_compared(&self) -> bool {
        self.properties.iter().any(Recomputed::is_computed) || !self.silent.is_empty()
    }

    /// Adds a comparison that is not a property's, and its first difference.
    pub(super) fn add(&mut self, own: Recomputed, first: Option<Difference>) {
        let index = self.properties.partition_point(|other| other.url < own.url);
        self.properties.insert(index, own);
        if let Some(first) = first
            && self.first.as_ref().is_none_or(|other| first.time < other.time)
        {
            self.first = Some(first);
        }
    }

    /// Notes the modules of which nothing was compared.
    ///
    /// If all was recorded and compared, these modules never wrote.
    pub(super) fn note_unseen(&mut self, modules: &SortedSet<String>, written: &Written, is_whole: bool) {
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
