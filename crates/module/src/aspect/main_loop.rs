use slate_blackboard::interface::Descriptor;

use super::{Service, service};
use crate::table::Bytes;

/// The main loop: a module says which stage comes next, and so replaces the loop's order while the agent runs. It never
/// owns the loop's thread. One module of an agent has it; when that fails, is switched off or unloaded, the stages
/// follow one another again.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct MainLoop {
    /// Given back to each call.
    pub context: *mut (),
    /// Takes the loop with a policy, which is ended when another one or none takes its place.
    pub take: unsafe extern "C" fn(*mut (), PolicyTable),
    /// Gives the loop back.
    pub give_back: unsafe extern "C" fn(*mut ()),
    /// Whether this module has the loop.
    pub has: unsafe extern "C" fn(*mut ()) -> i32,
}

/// A policy as the host calls it, between two stages and in one thread at a time.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PolicyTable {
    /// Given back to each call.
    pub owner: *mut (),
    /// The number of the next stage; -1 at the end of the cycle, -2 after a panic.
    pub next: unsafe extern "C" fn(*mut (), *const LoopPlace) -> i32,
    /// Ends the policy.
    pub end: unsafe extern "C" fn(*mut ()),
}

/// Where the main loop stands, as a policy sees it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LoopPlace {
    /// The names of the stages, in their order.
    pub stages: *const Bytes,
    /// How many stages there are.
    pub stage_count: usize,
    /// The stage that has ended; -1 at the beginning of a cycle.
    pub after: i32,
    /// Not used.
    pub reserved: u32,
    /// The agent's time, nanoseconds.
    pub now: u64,
    /// Counts cycles from 1.
    pub cycle: u64,
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for MainLoop {
    const DESCRIPTOR: &'static Descriptor = &service("main_loop 1", "Says which stage comes next.");
}

impl LoopPlace {
    /// The number of the stage of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        (0..self.stage_count).find(|index| {
            // SAFETY: the host points to so many names, which live during the call.
            unsafe { (*self.stages.add(*index)).as_slice() == name.as_bytes() }
        })
    }

    /// The stage that has ended; none at the beginning of a cycle.
    pub fn after(&self) -> Option<usize> {
        usize::try_from(self.after).ok()
    }
}

/// Says which stage of the main loop comes next.
///
/// ```
/// use slate_module::aspect::{LoopPlace, Policy};
///
/// /// Senses in every cycle, and acts in every second one.
/// struct Patient;
///
/// impl Policy for Patient {
///     fn next(&mut self, place: &LoopPlace) -> Option<usize> {
///         match place.after() {
///             None => place.find("Sense"),
///             after if after == place.find("Sense") && place.cycle % 2 == 0 => place.find("Act"),
///             _ => None,
///         }
///     }
/// }
/// ```
pub trait Policy: Send + 'static {
    /// The number of the stage that comes next, or none when the cycle is at its end. A stage may be left out or come
    /// again. After a panic the policy is ended.
    fn next(&mut self, place: &LoopPlace) -> Option<usize>;
}

impl MainLoop {
    /// Takes the loop: from the next cycle on, `policy` says which stage comes next.
    pub fn take<P: Policy>(&self, policy: P) {
        unsafe extern "C" fn next<P: Policy>(owner: *mut (), place: *const LoopPlace) -> i32 {
            // SAFETY: made from a box below, and the host calls it in one thread at a time.
            let ask = || unsafe { (*owner.cast::<P>()).next(&*place) };
            match std::panic::catch_unwind(std::panic::AssertUnwindSafe(ask)) {
                Ok(next) => next.and_then(|next| i32::try_from(next).ok()).unwrap_or(-1),
                Err(payload) => {
                    // Dropping what was thrown may itself panic.
                    let _ = std::panic::catch_unwind(std::panic::AssertUnwindSafe(move || drop(payload)));
                    -2
                }
            }
        }
        unsafe extern "C" fn end<P>(owner: *mut ()) {
            // SAFETY: made from a box below, and dropped once.
            let owner = unsafe { Box::from_raw(owner.cast::<P>()) };
            // A panic in it must not leave this library.
            let _ = std::panic::catch_unwind(std::panic::AssertUnwindSafe(move || drop(owner)));
        }
        let owner = Box::into_raw(Box::new(policy)).cast();
        // SAFETY: the host's table lives as long as the module, and ends the policy once.
        unsafe { (self.take)(self.context, PolicyTable { owner, next: next::<P>, end: end::<P> }) }
    }

    /// Gives the loop back: its stages follow one another again.
    pub fn give_back(&self) {
        // SAFETY: the host's table lives as long as the module.
        unsafe { (self.give_back)(self.context) }
    }

    /// Whether this module has the loop.
    pub fn has(&self) -> bool {
        // SAFETY: as above.
        unsafe { (self.has)(self.context) != 0 }
    }
}
