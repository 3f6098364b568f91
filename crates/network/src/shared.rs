//! Shared state of all parts of an agent's network.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_blackboard::wake::Wake;
use slate_blackboard::{Board, Property};
use slate_control::ControlSurface;
use slate_module::Level;
use slate_sorted::{SortedMap, SortedSet};
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
    /// Streams requested since the network thread's last pass, and the number open.
    pub wanted: Mutex<SortedSet<StreamName>>,
    pub streams: Mutex<usize>,
    /// Agents on the network.
    pub agents: Mutex<SortedSet<String>>,
    /// Agents with certificates that the settings do not name, already logged.
    pub strangers: Mutex<SortedSet<String>>,
    /// Rejections that were logged, each with its time, ns.
    pub rejections: Mutex<SortedMap<String, u64>>,
}

impl NetworkShared {
    pub fn board(&self) -> &Arc<Board> {
        self.surface.board()
    }

    pub fn log(&self, level: Level, text: &str) {
        self.surface.log(level, &format!("network: {text}"));
    }

    /// Returns the properties with values that others may read, sorted by path.
    pub fn published(&self) -> impl Iterator<Item = Arc<Property>> {
        let properties = self.board().properties().into_iter();
        properties.filter(|property| property.channel().is_some() && self.is_published(property))
    }

    /// Returns whether others may read a property; a command leaves after its gate.
    pub fn is_published(&self, property: &Property) -> bool {
        self.settings.is_published(property.path()) && !self.surface.is_ungated(property.path())
    }
}

/// Converts a Zenoh error to a refusal.
pub fn refused(error: zenoh::Error) -> NetworkError {
    NetworkError::Session(error.to_string())
}

/// Locks a mutex whose content stays intact when another holder panics.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
