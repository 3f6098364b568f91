//! Handle of a running agent, for all that read or change it.

mod overview;
mod recorder;

use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError, Weak};

use slate_blackboard::Board;
use slate_module::Level;

use super::composition::{Composition, LinkRetry};
use crate::recording::Recording;
use overview::Overview;
pub use overview::{ModuleStatus, PluginStatus};
pub(super) use recorder::{ChangeRecorder, by_module};
use slate_engine::main_loop::SharedLoop;

/// Running agent with its composition and its recorder.
/// It is for operations that lock the composition. What works on a locked composition takes that and the loop instead, so
/// it can't lock it twice; what follows the agent from outside takes a narrow trait, such as `SharingAgent`.
#[derive(Clone)]
pub(super) struct AgentHandle {
    pub shared: Arc<SharedLoop>,
    composition: Arc<Mutex<Composition>>,
    overview: Arc<Mutex<Overview>>,
    pub recorder: ChangeRecorder,
}

/// Handle that does not keep the agent alive.
#[derive(Clone, Default)]
pub(super) struct WeakHandle {
    shared: Weak<SharedLoop>,
    composition: Weak<Mutex<Composition>>,
    overview: Weak<Mutex<Overview>>,
    recording: Option<Weak<dyn Recording>>,
}

/// Guard of the composition.
pub(super) struct HeldComposition<'c> {
    composition: MutexGuard<'c, Composition>,
    overview: &'c Mutex<Overview>,
    /// True if it may have been changed.
    is_changed: bool,
}

impl<'c> HeldComposition<'c> {
    fn new(composition: MutexGuard<'c, Composition>, overview: &'c Mutex<Overview>) -> Self {
        Self { composition, overview, is_changed: false }
    }
}

impl Deref for HeldComposition<'_> {
    type Target = Composition;

    fn deref(&self) -> &Composition {
        &self.composition
    }
}

impl DerefMut for HeldComposition<'_> {
    fn deref_mut(&mut self) -> &mut Composition {
        self.is_changed = true;
        &mut self.composition
    }
}

impl Drop for HeldComposition<'_> {
    fn drop(&mut self) {
        if !self.is_changed {
            return;
        }
        let overview = Overview::of(&self.composition);
        *self.overview.lock().unwrap_or_else(PoisonError::into_inner) = overview;
    }
}

impl WeakHandle {
    /// Returns the handle, while the agent exists.
    pub fn upgrade(&self) -> Option<AgentHandle> {
        let shared = self.shared.upgrade()?;
        let recording = match &self.recording {
            Some(recording) => Some(recording.upgrade()?),
            None => None,
        };
        Some(AgentHandle {
            composition: self.composition.upgrade()?,
            overview: self.overview.upgrade()?,
            recorder: ChangeRecorder::new(Arc::clone(&shared), recording),
            shared,
        })
    }
}

impl LinkRetry for WeakHandle {
    fn retry(&self) -> bool {
        let Some(agent) = self.upgrade() else { return false };
        let mut composition = agent.composition();
        let Some(modules) = composition.retry_links(&agent.shared) else { return false };
        agent.record_links(&modules);
        true
    }
}

impl AgentHandle {
    pub fn new(
        shared: Arc<SharedLoop>,
        composition: Composition,
        recording: Option<Arc<dyn Recording>>,
    ) -> Self {
        let agent = Self {
            overview: Arc::new(Mutex::new(Overview::of(&composition))),
            composition: Arc::new(Mutex::new(composition)),
            recorder: ChangeRecorder::new(Arc::clone(&shared), recording),
            shared,
        };
        agent.composition().waiting.retry = Some(Arc::new(agent.downgrade()));
        agent
    }

    /// Returns a handle that does not keep the agent alive.
    pub fn downgrade(&self) -> WeakHandle {
        WeakHandle {
            shared: Arc::downgrade(&self.shared),
            composition: Arc::downgrade(&self.composition),
            overview: Arc::downgrade(&self.overview),
            recording: self.recorder.recording.as_ref().map(Arc::downgrade),
        }
    }

    /// Locks the composition for one change.
    /// The overview is updated when the lock is released.
    pub fn composition(&self) -> HeldComposition<'_> {
        let composition = self.composition.lock().unwrap_or_else(PoisonError::into_inner);
        HeldComposition::new(composition, &self.overview)
    }

    /// Locks the composition; `None` if another thread has it.
    pub fn try_composition(&self) -> Option<HeldComposition<'_>> {
        let composition = match self.composition.try_lock() {
            Ok(composition) => composition,
            Err(TryLockError::Poisoned(error)) => error.into_inner(),
            Err(TryLockError::WouldBlock) => return None,
        };
        Some(HeldComposition::new(composition, &self.overview))
    }

    /// Returns the lists of plugins and modules after the last change.
    pub fn overview(&self) -> MutexGuard<'_, Overview> {
        self.overview.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The agent's board, with all properties.
    pub fn board(&self) -> &Arc<Board> {
        &self.shared.board
    }

    /// The agent's time, nanoseconds.
    pub fn now(&self) -> u64 {
        self.shared.clock.now()
    }

    /// Writes a line into the log.
    pub fn say(&self, text: &str) {
        self.log(Level::Info, text);
    }

    /// Writes a line of that level into the log.
    pub fn log(&self, level: Level, text: &str) {
        self.shared.logger.log(self.now(), level, text);
    }

    /// Logs the modules whose links have changed.
    pub fn record_links(&self, modules: &[String]) {
        if !modules.is_empty() {
            self.log(Level::Info, &format!("links changed, of these modules: {}", modules.join(", ")));
        }
    }
}
