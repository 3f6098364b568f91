use slate_blackboard::interface::Descriptor;

use super::{Effect, HostedService, Service, call_table, service};

call_table! {
    /// Clock of the agent, set by the module that `[time] source` names.
    /// In each tick it sets the time of the next cycle.
    pub struct TimeSource {
        /// Sets the time of the next cycle, ns; false if it is before the present one.
        fn next(u64) -> i32;
    }
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for TimeSource {
    const DESCRIPTOR: &'static Descriptor =
        &service::<Self>("time_source 1", "Sets the time of the next cycle.");
}

impl HostedService for TimeSource {
    const EFFECT: Effect = Effect::None;
}

impl TimeSource {
    /// Sets the time of the next cycle, ns of the agent's time.
    /// Without a call it is a period later than this one. False if it is before the present time, which then stays.
    pub fn set_next(&self, time: u64) -> bool {
        // SAFETY: the host's table lives as long as the module.
        unsafe { (self.next)(self.context, time) != 0 }
    }
}
