//! How the loop goes from the program's stages and policy to a module's, and back.

use std::sync::{Arc, TryLockError, Weak};

use slate_module::Level;

use super::guest::Guest;
use super::{Core, Seat, Shared, TAKEOVER, Takeover};

/// By what the loop goes.
#[derive(Default)]
pub(super) struct Course {
    /// The number of what a module has taken it with; 0 for the program's.
    pub number: u64,
    /// The number of the stages for which there is a plan beside the program's.
    planned: u64,
    /// Whether that plan is the one that the loop runs.
    swapped: bool,
    /// The module that has it.
    module: Option<Arc<str>>,
}

impl Course {
    /// The program's plan is in its place, and one for the stages of that number beside it.
    pub fn replan(&mut self, planned: u64) {
        (self.planned, self.swapped) = (planned, false);
    }
}

impl Core {
    /// The guest, to be dropped, unless a thread has not returned from it.
    pub(super) fn let_go(&mut self, guest: Guest<Arc<Takeover>>) -> Option<Guest<Arc<Takeover>>> {
        if guest.is_late() {
            self.absent.push(guest.into_absent());
            return None;
        }
        Some(guest)
    }
}

impl Shared {
    /// Before a cycle: lets the loop go by what holds now.
    pub(super) fn settle(&self, core: &mut Core) {
        let Core { takeover, course, plan, aside, .. } = core;
        let number = takeover.as_ref().map_or(0, |guest| {
            if course.number != 0
                && let Some(seat) = guest.seat.as_ref().filter(|seat| seat.is_idle())
            {
                // Its policy may give it no turn, in which it would see that it was switched off.
                // SAFETY: the seat is idle, and belongs to who has the token.
                unsafe { seat.runner() }.is_enabled(self.clock.now());
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
        self.logger.log(self.clock.now(), Level::Info, &text);
    }

    /// Ends what a module has taken the loop with, as its policy does not do what it should.
    pub(super) fn take_back(&self, core: &Core, why: &str) {
        let Some(guest) = &core.takeover else { return };
        guest.code.end(core.course.number);
        let text = format!("the policy of {} {why}; it is asked no more", guest.code.module);
        self.logger.log(self.clock.now(), Level::Error, &text);
    }

    /// Sets the module that may take the loop, which is on the loop.
    pub fn set_takeover(self: &Arc<Self>, module: Option<(Arc<Takeover>, Arc<Seat>)>) {
        let planning = self.planning();
        let place = module.as_ref().map(|(takeover, _)| Arc::clone(takeover));
        let before = std::mem::replace(&mut self.parts().takeover, place.clone());
        let guest =
            module.map(|(code, seat)| Guest { what: TAKEOVER, seat: Some(seat), code: Box::new(code) });
        let left = self.between_cycles(&[], move |shared| {
            // SAFETY: jobs are done by who has the token.
            let core = unsafe { shared.core() };
            let left = std::mem::replace(&mut core.takeover, guest);
            Some(left.and_then(|guest| core.let_go(guest)))
        });
        drop(left);
        if let Some(before) = before {
            before.close();
            // The stages that it had.
            self.rebuild(&planning, None, || Ok::<(), ()>(()));
        }
        // In lockstep the loop itself makes the plans, so that they are there in the same cycle in each run.
        if let Some(takeover) = place.filter(|_| !self.lockstep) {
            let (shared, own) = (Arc::downgrade(self), Arc::clone(&takeover));
            let thread = std::thread::Builder::new().name("stages".into());
            if let Err(error) = thread.spawn(move || make_plans(&shared, &own)) {
                let text =
                    format!("{} can't bring stages: a thread can't be started: {error}", takeover.module);
                self.logger.log(self.clock.now(), Level::Error, &text);
            }
        }
    }

    /// Makes plans for what the module wants now, and has the loop run them.
    fn follow(&self, takeover: &Arc<Takeover>) {
        takeover.calm();
        takeover.sweep();
        let planning = self.planning();
        let mut parts = self.parts();
        let is_present = parts.takeover.as_ref().is_some_and(|present| Arc::ptr_eq(present, takeover));
        let is_changed = is_present && parts.look_at_takeover();
        drop(parts);
        if is_changed {
            self.rebuild(&planning, None, || Ok::<(), ()>(()));
        }
    }

    /// The same in lockstep, at the end of a cycle: it may take its time, and must not depend on that of others.
    pub(super) fn follow_here(&self) {
        // SAFETY: whoever calls it has the token; the reference ends before a module's code may run.
        let takeover = unsafe { self.core() }.takeover.as_ref();
        let Some(takeover) = takeover.filter(|guest| guest.code.is_stirred()) else { return };
        let takeover = Arc::clone(&takeover.code);
        let planning = match self.members.planning.try_lock() {
            Ok(planning) => planning,
            Err(TryLockError::Poisoned(error)) => error.into_inner(),
            // Somebody changes the agent, and waits for the loop.
            Err(TryLockError::WouldBlock) => return,
        };
        takeover.calm();
        takeover.sweep();
        if self.parts().look_at_takeover() {
            let prepared = self.prepare(&planning);
            // SAFETY: as above.
            drop(self.install(unsafe { self.core() }, prepared, None));
        }
    }
}

/// The life of the thread that makes plans for a module's stages, as the loop has no time for that.
fn make_plans(shared: &Weak<Shared>, takeover: &Arc<Takeover>) {
    while takeover.wait() {
        let Some(shared) = shared.upgrade() else { return };
        shared.follow(takeover);
    }
}
