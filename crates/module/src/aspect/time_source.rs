use slate_blackboard::interface::Descriptor;

use super::{Service, service};

/// The agent's clock, for the module that `[time] source` names: it says in each tick what time the next cycle has.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TimeSource {
    /// Given back to each call.
    pub context: *mut (),
    /// Sets the time of the next cycle, nanoseconds; false when it lies before the present one.
    pub next: unsafe extern "C" fn(*mut (), u64) -> i32,
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for TimeSource {
    const DESCRIPTOR: &'static Descriptor = &service("time_source 1", "Says what time the next cycle has.");
}

impl TimeSource {
    /// Sets the time of the next cycle, nanoseconds of the agent's time; without a call it is a period later than this
    /// one. False when it lies before the present time, which then stands.
    pub fn set_next(&self, time: u64) -> bool {
        // SAFETY: the host's table lives as long as the module.
        unsafe { (self.next)(self.context, time) != 0 }
    }
}
