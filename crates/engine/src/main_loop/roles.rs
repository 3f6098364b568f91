//! Callbacks of the main loop: policy, takeover, time source.

use std::sync::Arc;

use super::callback::{Callback, Role};
use super::{Core, LoopPolicy, Takeover};
use crate::clock::TimeSource;

/// Role of the program's policy, which selects the next stage.
pub(super) struct PolicyRole;

impl Role for PolicyRole {
    type Code = dyn LoopPolicy;

    fn callback(core: &mut Core) -> &mut Option<Callback<dyn LoopPolicy>> {
        &mut core.policy
    }
}

/// Module that may take the loop.
pub(super) struct TakeoverRole;

impl Role for TakeoverRole {
    type Code = Arc<Takeover>;

    fn callback(core: &mut Core) -> &mut Option<Callback<Arc<Takeover>>> {
        &mut core.takeover
    }

    /// Keeps the callback: while its module is late it is not called.
    /// That ends the module's takeover.
    fn remove_late(_: &mut Core) -> &'static str {
        TAKEOVER
    }
}

/// Role of the time source.
pub(super) struct TimeRole;

impl Role for TimeRole {
    type Code = dyn TimeSource;

    fn callback(core: &mut Core) -> &mut Option<Callback<dyn TimeSource>> {
        &mut core.time_source
    }
}

/// Names of the callbacks in the log.
pub(super) const POLICY: &str = "the policy of the main loop";
pub(super) const TAKEOVER: &str = "the policy of a module";
pub(super) const TIME_SOURCE: &str = "the time source";
