use std::sync::{Arc, OnceLock};

use super::{Flow, SharedLoop};

/// What is called between two cycles with the agent's time; [`Flow::Lost`] when it lost the token.
pub type AfterCycle = Box<dyn Fn(&SharedLoop, u64) -> Flow + Send + Sync>;

/// What the loop waits for in lockstep at the end of each cycle. It gets the agent's time, ns, and whether the run goes on, and
/// returns when it does not. A reason in words ends the run.
pub type CycleWait = Box<dyn FnMut(u64, &dyn Fn() -> bool) -> Result<(), String> + Send>;

/// What sends to other agents what was written; it is called after each tick that wrote something.
pub type AfterTick = Box<dyn Fn() + Send + Sync>;

/// How many listeners an agent has room for.
const LISTENERS: usize = 4;

/// What is called after each tick that wrote something. A listener stays as long as the agent.
#[derive(Default)]
pub struct WriteListeners([OnceLock<AfterTick>; LISTENERS]);

impl WriteListeners {
    /// Adds a listener, which must not wait; returns false when there is no room left.
    pub fn add(&self, call: AfterTick) -> bool {
        let mut call = Some(call);
        self.0.iter().any(|place| {
            if let Some(next) = call.take() {
                call = place.set(next).err();
            }
            call.is_none()
        })
    }

    /// Calls all of them.
    fn call(&self) {
        self.0.iter().map_while(OnceLock::get).for_each(|call| call());
    }
}

/// Changes of the configuration that modules ask for in their ticks.
pub trait AskedChanges: Send + Sync {
    /// Whether something is to be changed; a look costs a load.
    fn is_asked(&self) -> bool;

    /// Makes the changes that were asked for. The loop's token must be free.
    fn carry_out(&self);
}

/// What others have called at certain moments; the first one of each stays, but for listeners.
#[derive(Default)]
pub struct Hooks {
    /// Looks at the end of each cycle whether there is something to do between two of them.
    after_cycle: OnceLock<AfterCycle>,
    /// What changes the configuration for modules.
    changes: OnceLock<Arc<dyn AskedChanges>>,
    /// What sends to other agents what was written.
    pub after_tick: Arc<WriteListeners>,
}

impl Hooks {
    /// Has this called at the end of each cycle with the agent's time, by who has the token.
    pub fn watch_cycles(&self, look: AfterCycle) {
        // An agent sets it when it is loaded.
        let _ = self.after_cycle.set(look);
    }

    /// Has the changes made here that modules ask for.
    pub fn change_with(&self, changes: Arc<dyn AskedChanges>) {
        // An agent sets it when it is loaded.
        let _ = self.changes.set(changes);
    }

    /// Says that values were written.
    pub fn wrote(&self) {
        self.after_tick.call();
    }

    /// What modules have asked for, if there is something to be changed.
    pub(super) fn asked(&self) -> Option<&dyn AskedChanges> {
        self.changes.get().map(|changes| &**changes).filter(|changes| changes.is_asked())
    }

    /// What looks at the end of each cycle.
    pub(super) fn after_cycle(&self) -> Option<&AfterCycle> {
        self.after_cycle.get()
    }
}
