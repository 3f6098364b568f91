//! Handover of the loop between the program's stages and policy and a module's.

use std::sync::Arc;

use slate_module::Level;

use super::guest::Guest;
use super::{Core, LoopLog, Takeover};

/// Course of the loop: its own plan, or that of a takeover.
#[derive(Default)]
pub(super) struct LoopCourse {
    /// Number of the active takeover; 0 for the program's policy.
    pub number: u64,
    /// Number of the takeover for whose stages there is a plan beside the program's.
    planned: u64,
    /// True while the loop runs that plan.
    swapped: bool,
    /// Module that has the loop.
    module: Option<Arc<str>>,
}

impl LoopCourse {
    /// Registers new plans: the program's is active, `planned` names the one beside it.
    pub fn replan(&mut self, planned: u64) {
        (self.planned, self.swapped) = (planned, false);
    }
}

impl Core {
    /// Releases a guest for dropping; `None` if a thread has not returned from it.
    pub(super) fn let_go(&mut self, guest: Guest<Arc<Takeover>>) -> Option<Guest<Arc<Takeover>>> {
        if guest.is_late() {
            self.absent.push(guest.into_absent());
            return None;
        }
        Some(guest)
    }

    /// Prepares a cycle: selects the active policy and plan.
    pub(super) fn settle(&mut self, log: &LoopLog) {
        let Self { takeover, course, plan, aside, .. } = self;
        let number = takeover.as_ref().map_or(0, |guest| {
            if course.number != 0
                && let Some(seat) = guest.seat.as_ref().filter(|seat| seat.is_idle())
            {
                // Its policy may give it no turn, in which it would see that it was switched off.
                // SAFETY: the seat is idle, and belongs to who has the token.
                unsafe { seat.runner() }.is_enabled(log.clock.now());
            }
            guest.code.settle(course.planned)
        });
        let has_stages = number != 0 && number == course.planned;
        if has_stages != course.swapped {
            std::mem::swap(plan, aside);
            course.swapped = has_stages;
        }
        if number == std::mem::replace(&mut course.number, number) {
            return;
        }
        let module = takeover.as_ref().filter(|_| number != 0).map(|guest| Arc::clone(&guest.code.module));
        let before = std::mem::replace(&mut course.module, module);
        let text = match (&course.module, before) {
            (Some(module), _) if has_stages => {
                format!("{module} has the main loop, with the stages {}", plan.names.join(", "))
            }
            (Some(module), _) => format!("{module} has the main loop, and says which stage comes next"),
            (None, Some(module)) => {
                let names = plan.names.join(", ");
                format!("{module} has the main loop no more; from now on its stages are {names}")
            }
            (None, None) => return,
        };
        log.write(Level::Info, &text);
    }

    /// Ends a module's takeover of the loop because its policy failed.
    pub(super) fn take_back(&self, log: &LoopLog, why: &str) {
        let Some(guest) = &self.takeover else { return };
        guest.code.end(self.course.number);
        let text = format!("the policy of {} {why}; it is asked no more", guest.code.module);
        log.write(Level::Error, &text);
    }
}
