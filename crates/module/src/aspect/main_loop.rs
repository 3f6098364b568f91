use std::time::Duration;

use slate_blackboard::interface::Descriptor;

use super::blackboard::call_with_sink;
use super::{Effect, HostedService, Service, call_table, service};
use crate::table::{Bytes, DONE, Sink};
use crate::{Refusal, Stage};

call_table! {
    /// Main loop of the agent, whose stages or order a module may take over.
    /// It replaces the loop while the agent runs, but never owns the loop's thread.
    ///
    /// One module of an agent has it. When that gives it back, fails, hangs, is switched off, reloaded or unloaded, the
    /// stages of before follow one another again from the next cycle on.
    pub struct MainLoop {
        /// Takes the loop with that many stages and a policy; the sink gets a refusal.
        /// In any case the policy is the host's from then on, which ends it when it is no longer needed.
        fn take(*const StageTable, usize, PolicyTable, *const Sink) -> i32;
        /// Takes the loop with a policy over the stages that the agent has.
        fn take_with_policy(PolicyTable);
        /// Gives the loop back.
        fn give_back();
        /// Returns 1 if this module has the loop, or has requested it.
        fn is_held() -> i32;
    }
}

/// Stage of the loop, as the host reads it during a call.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct StageTable {
    /// Name.
    pub name: Bytes,
    /// Stages of modules that it runs, in order: their numbers among the ten, from 0.
    pub members: *const u32,
    /// Number of members.
    pub member_count: usize,
    /// Timeout, ns of the wall clock; 0 for none.
    pub timeout: u64,
}

/// Stage of the loop that a module defines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoopStage<'a> {
    /// Name: up to 32 letters, digits and `_`.
    pub name: &'a str,
    /// Stages of modules that it runs, in order.
    pub members: &'a [Stage],
    /// Timeout on the wall clock; `None` for none.
    /// After it the running module counts as late, and those that have not begun are left out.
    pub timeout: Option<Duration>,
}

/// Policy as the host calls it, between two stages and in one thread at a time.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PolicyTable {
    /// Owner, passed to each call.
    pub owner: *mut (),
    /// Returns the index of the next stage; -1 at the cycle's end, -2 after a panic.
    pub next: unsafe extern "C" fn(*mut (), *const LoopPlace) -> i32,
    /// Ends the policy.
    pub end: unsafe extern "C" fn(*mut ()),
}

/// Position of the main loop, for a policy.
#[repr(C)]
#[derive(Debug)]
pub struct LoopPlace {
    /// Names of the stages, in order.
    stages: *const Bytes,
    /// Number of stages.
    stage_count: usize,
    /// Stage that has ended; -1 at the beginning of a cycle.
    after: i32,
    /// Reserved.
    reserved: u32,
    /// Agent's time, ns.
    pub now: u64,
    /// Counts cycles from 1.
    pub cycle: u64,
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for MainLoop {
    const DESCRIPTOR: &'static Descriptor =
        &service::<Self>("main_loop 2", "Provides the loop's stages, and selects the next one.");
}

impl HostedService for MainLoop {
    const EFFECT: Effect = Effect::None;
}

impl LoopPlace {
    /// Returns the place after a stage, by its index.
    /// `None` is the beginning of a cycle. `now` is the agent's time, ns; `cycle` counts from 1.
    ///
    /// # Safety
    /// The names and their bytes are readable and unchanged as long as the place exists.
    pub unsafe fn new(stages: &[Bytes], after: Option<usize>, now: u64, cycle: u64) -> Self {
        let after = after.and_then(|after| i32::try_from(after).ok()).unwrap_or(-1);
        Self { stages: stages.as_ptr(), stage_count: stages.len(), after, reserved: 0, now, cycle }
    }

    /// Returns the number of stages.
    pub fn stage_count(&self) -> usize {
        self.stage_count
    }

    /// Returns the index of the stage of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        (0..self.stage_count).find(|index| {
            // SAFETY: the host points to so many names, which live during the call.
            unsafe { (*self.stages.add(*index)).as_slice() == name.as_bytes() }
        })
    }

    /// Returns the stage that has ended; `None` at the beginning of a cycle.
    pub fn after(&self) -> Option<usize> {
        usize::try_from(self.after).ok()
    }
}

/// Policy that selects the next stage of the main loop.
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
    /// Returns the index of the next stage; `None` at the end of the cycle.
    /// A stage may be left out or come again. After a panic the policy is ended.
    fn next(&mut self, place: &LoopPlace) -> Option<usize>;
}

impl PolicyTable {
    /// Returns the table of a policy, which the host ends.
    fn of<P: Policy>(policy: P) -> Self {
        unsafe extern "C" fn next<P: Policy>(owner: *mut (), place: *const LoopPlace) -> i32 {
            // SAFETY: made from a box below, and the host calls it in one thread at a time.
            let next = || unsafe { (*owner.cast::<P>()).next(&*place) };
            match std::panic::catch_unwind(std::panic::AssertUnwindSafe(next)) {
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
        Self { owner: Box::into_raw(Box::new(policy)).cast(), next: next::<P>, end: end::<P> }
    }
}

impl MainLoop {
    /// Takes the loop with these stages and a policy, unless this tick fails.
    /// `policy` selects the next of them.
    ///
    /// In lockstep that holds from the next cycle on. On the wall clock the plan for the stages is made beside the
    /// loop, and holds some cycles later; until then all is as before.
    ///
    /// # Errors
    /// When each of the ten stages of modules is not in exactly one of these, or a name can't be one or comes twice.
    /// Nothing changes then.
    pub fn take<P: Policy>(&self, stages: &[LoopStage<'_>], policy: P) -> Result<(), Refusal> {
        let members: Vec<Vec<u32>> =
            stages.iter().map(|stage| stage.members.iter().map(|member| *member as u32).collect()).collect();
        let stages: Vec<_> = stages
            .iter()
            .zip(&members)
            .map(|(stage, members)| StageTable {
                name: Bytes::of(stage.name),
                members: members.as_ptr(),
                member_count: members.len(),
                timeout: stage.timeout.map_or(0, nanoseconds),
            })
            .collect();
        let policy = PolicyTable::of(policy);
        // SAFETY: everything lives during the call, and the host ends the policy once.
        let (code, reason) = call_with_sink(|sink| unsafe {
            (self.take)(self.context, stages.as_ptr(), stages.len(), policy, sink)
        });
        if code == DONE { Ok(()) } else { Err(Refusal(reason)) }
    }

    /// Takes the loop with its present stages and a policy, unless this tick fails.
    /// From the next cycle on `policy` selects the next stage.
    pub fn take_with_policy<P: Policy>(&self, policy: P) {
        // SAFETY: the host's table lives as long as the module, and ends the policy once.
        unsafe { (self.take_with_policy)(self.context, PolicyTable::of(policy)) }
    }

    /// Gives the loop back.
    /// From the next cycle on the stages of before follow one another again.
    pub fn give_back(&self) {
        // SAFETY: the host's table lives as long as the module.
        unsafe { (self.give_back)(self.context) }
    }

    /// Returns true if this module has the loop, or will have it.
    /// It will as soon as there is a plan for its stages. A request of this tick is not seen before the next one.
    pub fn is_held(&self) -> bool {
        // SAFETY: as above.
        unsafe { (self.is_held)(self.context) != 0 }
    }
}

/// Returns a duration in ns; the maximum if it is too long.
fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
