//! What all parts of an agent's network use.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_blackboard::wake::Wake;
use slate_blackboard::{Board, Property};
use slate_control::ControlSurface;
use slate_module::Level;
use zenoh::Session;

use crate::error::NetworkError;
use crate::options::StreamName;
use crate::settings::NetworkSettings;

pub struct NetworkShared {
    pub surface: Arc<ControlSurface>,
    pub settings: NetworkSettings,
    pub session: Session,
    /// Wakes the network's thread.
    pub wake: Arc<Wake>,
    pub ended: AtomicBool,
    /// Streams that were asked for since the network's thread looked, and how many are open.
    pub wanted: Mutex<BTreeSet<StreamName>>,
    pub streams: Mutex<usize>,
    /// Agents that are there.
    pub agents: Mutex<BTreeSet<String>>,
    /// Those with certificates that the settings do not name, as they were told.
    pub strangers: Mutex<BTreeSet<String>>,
    /// Rejections that were logged, each with its time, ns.
    pub rejections: Mutex<BTreeMap<String, u64>>,
}

impl NetworkShared {
    pub fn board(&self) -> &Arc<Board> {
        self.surface.board()
    }

    pub fn log(&self, level: Level, text: &str) {
        self.surface.log(level, &format!("network: {text}"));
    }

    /// The properties with values that others may read, in the order of their paths.
    pub fn published(&self) -> impl Iterator<Item = Arc<Property>> {
        let properties = self.board().properties().into_iter();
        properties.filter(|property| property.channel().is_some() && self.is_published(property))
    }

    /// Whether others may read a property. A command leaves after its gate.
    pub fn is_published(&self, property: &Property) -> bool {
        self.settings.is_published(property.path()) && !self.surface.is_ungated(property.path())
    }
}

/// What Zenoh says of a refusal.
pub fn refused(error: zenoh::Error) -> NetworkError {
    NetworkError::Session(error.to_string())
}

/// What stays intact when another thread panicked while it held the lock.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
