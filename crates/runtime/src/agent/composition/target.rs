//! The target of a change, and its result.

use std::sync::Arc;

use slate_composition::{Catalogue, OwnSetup};
use slate_module::{Description, ModuleKind};
use slate_sorted::SortedMap;

use slate_configuration::Configuration;

/// Target composition of a change.
pub(in crate::agent) struct CompositionTarget {
    pub configuration: Arc<Configuration>,
    pub catalogue: Catalogue,
    /// True if the states of modules that leave are kept; a save may take long.
    pub keep: bool,
}

/// Module that fits.
pub(in crate::agent) struct Fitting {
    pub kind: ModuleKind,
    pub description: Description,
    pub setup: OwnSetup,
    /// Parameters as in the configuration.
    pub params: Vec<u8>,
}

/// Result of a change.
#[derive(Debug, Default)]
pub(in crate::agent) struct CompositionChange {
    pub arrived: Vec<String>,
    /// Removed modules with their states, or errors of saving them.
    pub left: SortedMap<String, Result<Vec<u8>, String>>,
    /// Modules that received a state, or the reason for which it did not fit.
    pub restored: SortedMap<String, Result<(), String>>,
}
