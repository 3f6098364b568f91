//! The target of a change, and its result.

use std::collections::BTreeMap;
use std::sync::Arc;

use slate_composition::{Catalogue, OwnSetup};
use slate_module::{Description, ModuleKind};

use slate_configuration::Configuration;

/// What an agent is to be made of.
pub(in crate::agent) struct CompositionTarget {
    pub configuration: Arc<Configuration>,
    pub catalogue: Catalogue,
    /// Whether the states of modules that leave are wanted; a save may take its time.
    pub keep: bool,
}

/// A module that fits.
pub(in crate::agent) struct Fitting {
    pub kind: ModuleKind,
    pub description: Description,
    pub setup: OwnSetup,
    /// Its parameters as in the configuration.
    pub params: Vec<u8>,
}

/// What a change came to.
#[derive(Debug, Default)]
pub(in crate::agent) struct CompositionChange {
    pub arrived: Vec<String>,
    /// With the states that they left, or why they could not be saved.
    pub left: BTreeMap<String, Result<Vec<u8>, String>>,
    /// Modules that took over a state, or why it did not fit.
    pub restored: BTreeMap<String, Result<(), String>>,
}
