use std::sync::{Arc, OnceLock};

use super::{Flow, SharedLoop};

/// Callback between two cycles, with the agent's time, ns.
/// Returns [`Flow::Lost`] if it lost the token.
pub type AfterCycle = Box<dyn Fn(&SharedLoop, u64) -> Flow + Send + Sync>;

/// Wait of the loop in lockstep at the end of each cycle.
/// It receives the agent's time, ns, and a check whether the run continues, and returns once it does not. An error ends
/// the run with its reason.
pub type CycleWait = Box<dyn FnMut(u64, &dyn Fn() -> bool) -> Result<(), String> + Send>;

/// Callback after each tick that wrote, which sends the values to other agents.
pub type AfterTick = Box<dyn Fn() + Send + Sync>;

/// Maximum number of listeners of an agent.
const LISTENER_LIMIT: usize = 4;

/// Callbacks after each tick that wrote.
/// A listener stays as long as the agent.
#[derive(Default)]
pub struct WriteListeners([OnceLock<AfterTick>; LISTENER_LIMIT]);

impl WriteListeners {
    /// Adds a listener, which must not wait; returns false when there is no room left.
    pub fn add(&self, call: AfterTick) -> bool {
        let mut call = Some(call);
        self.0.iter().any(|slot| {
            if let Some(next) = call.take() {
                call = slot.set(next).err();
            }
            call.is_none()
        })
    }

    /// Calls all of them.
    fn call(&self) {
        self.0.iter().map_while(OnceLock::get).for_each(|call| call());
    }
}

/// Changes of the configuration that modules request in their ticks.
pub trait RequestedChanges: Send + Sync {
    /// Returns true if changes are pending; the check costs a load.
    fn is_pending(&self) -> bool;

    /// Applies the requested changes, and calls `before` before each request.
    /// The loop's token must be free.
    fn apply(&self, before: &mut dyn FnMut());
}

/// Callbacks of others at certain moments.
/// The first one of each stays, except for listeners, of which there may be several.
#[derive(Default)]
pub struct Hooks {
    /// Callback at the end of each cycle, which checks for work between two cycles.
    after_cycle: OnceLock<AfterCycle>,
    /// Executor of the configuration changes that modules request.
    changes: OnceLock<Arc<dyn RequestedChanges>>,
    /// Senders of written values to other agents.
    pub after_tick: Arc<WriteListeners>,
}

impl Hooks {
    /// Sets the callback at the end of each cycle, with the agent's time, ns.
    /// The holder of the token calls it.
    pub fn set_after_cycle(&self, call: AfterCycle) {
        // An agent sets it when it is loaded.
        let _ = self.after_cycle.set(call);
    }

    /// Sets the executor of the changes that modules request.
    pub fn set_requested_changes(&self, changes: Arc<dyn RequestedChanges>) {
        // An agent sets it when it is loaded.
        let _ = self.changes.set(changes);
    }

    /// Calls the listeners after a write.
    pub fn notify_write(&self) {
        self.after_tick.call();
    }

    /// Returns the executor of requested changes, if any are pending.
    pub(super) fn pending_changes(&self) -> Option<&dyn RequestedChanges> {
        self.changes.get().map(|changes| &**changes).filter(|changes| changes.is_pending())
    }

    /// Returns the callback at the end of each cycle.
    pub(super) fn after_cycle(&self) -> Option<&AfterCycle> {
        self.after_cycle.get()
    }
}
