//! What the loop runs is made beside it, and exchanged between two cycles.

use std::sync::atomic::Ordering;
use std::sync::{Arc, MutexGuard, PoisonError};

use super::cycle::Position;
use super::gauges::StageGauge;
use super::guest::{Absent, Guest};
use super::plan::{Parts, Plan};
use super::{Core, Levels, Schedule, Seat, Shared, Takeover, Watch};
use crate::actuators::Actuator;
use crate::clock::TimeSource;

/// Plans that are ready for the loop.
pub(super) struct Prepared {
    program: Plan,
    /// That of a module's stages, and their number.
    module: Option<(u64, Plan)>,
    watched: Arc<[Watch]>,
}

/// What the loop needs no longer, to be dropped by somebody else.
#[allow(dead_code, reason = "it is only dropped")]
pub(super) struct Replaced {
    plans: [Plan; 2],
    actuators: Option<Vec<Arc<Actuator>>>,
    takeover: Option<Guest<Arc<Takeover>>>,
    time_source: Option<Guest<dyn TimeSource>>,
    returned: Vec<Absent>,
}

impl Shared {
    /// From the next cycle on the loop runs these modules, by their stages, and ends stale commands of these actuators;
    /// `threaded` are watched beside them. A module that is not among them says neither the order nor the time any more.
    pub fn compose(&self, levels: Vec<Levels>, threaded: Vec<Arc<Seat>>, actuators: Vec<Arc<Actuator>>) {
        self.compose_with(levels, threaded, actuators, || Ok::<(), ()>(()));
    }

    /// As [`compose`](Shared::compose), and does `work` in the same moment, before it: when that fails, all stays as it
    /// is. Nothing when the loop was lost.
    pub fn compose_with<R: Send + 'static, E: Send + 'static>(
        &self,
        levels: Vec<Levels>,
        threaded: Vec<Arc<Seat>>,
        actuators: Vec<Arc<Actuator>>,
        work: impl FnOnce() -> Result<R, E> + Send + 'static,
    ) -> Option<Result<R, E>> {
        let planning = self.planning();
        let mut parts = self.parts();
        let before = (parts.levels.clone(), parts.threaded.clone());
        (parts.levels, parts.threaded) = (levels, threaded);
        drop(parts);
        let gates = actuators.iter().cloned().collect();
        let result = self.rebuild(&planning, Some(actuators), work);
        match result {
            Some(Ok(_)) => *self.members.gates.lock().unwrap_or_else(PoisonError::into_inner) = gates,
            _ => {
                let mut parts = self.parts();
                (parts.levels, parts.threaded) = before;
                self.watch(&parts);
            }
        }
        result
    }

    /// From the next cycle on these are the program's stages, which the loop has while no module has taken it with
    /// others.
    pub fn set_schedule(&self, schedule: Schedule) {
        let planning = self.planning();
        self.parts().schedule = schedule;
        self.rebuild(&planning, None, || Ok::<(), ()>(()));
    }

    /// Who has it makes plans, and nobody else does.
    pub(super) fn planning(&self) -> MutexGuard<'_, ()> {
        self.members.planning.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes the plans anew and exchanges them between two cycles, after `work`.
    pub(super) fn rebuild<R: Send + 'static, E: Send + 'static>(
        &self,
        planning: &MutexGuard<'_, ()>,
        actuators: Option<Vec<Arc<Actuator>>>,
        work: impl FnOnce() -> Result<R, E> + Send + 'static,
    ) -> Option<Result<R, E>> {
        let prepared = self.prepare(planning);
        let exchanged = self.between_cycles(&[], move |shared| {
            let result = match work() {
                Ok(result) => result,
                Err(error) => return Some(Err((error, prepared))),
            };
            // SAFETY: jobs are done by who has the token.
            let core = unsafe { shared.core() };
            Some(Ok((result, shared.install(core, prepared, actuators))))
        });
        // What is no longer needed is dropped here and not on the loop.
        match exchanged {
            Ok(Ok((result, _))) => Some(Ok(result)),
            Ok(Err((error, _))) => Some(Err(error)),
            Err(_) => None,
        }
    }

    /// Makes the plans.
    pub(super) fn prepare(&self, _: &MutexGuard<'_, ()>) -> Prepared {
        let mut parts = self.parts();
        parts.look_at_takeover();
        let before = std::mem::take(&mut parts.gauges);
        let stages =
            parts.schedule.stages().iter().chain(parts.wish.iter().flat_map(|(_, own)| own.stages()));
        let names: Vec<Arc<str>> = stages.map(|stage| stage.name.as_str().into()).collect();
        for name in names {
            let gauge = before.get(&name).cloned().unwrap_or_else(|| {
                Arc::new(StageGauge::new(&name, &self.synchronization, self.tracing.trace()))
            });
            parts.gauges.insert(name, gauge);
        }
        let program = parts.plan(&parts.schedule);
        let module = parts.wish.as_ref().map(|(number, own)| (*number, parts.plan(own)));
        let plans = [Some(&program), module.as_ref().map(|(_, plan)| plan)].into_iter().flatten();
        let timeouts = plans.flat_map(|plan| &plan.stages).map(|stage| stage.timeout);
        let shortest = timeouts.filter(|timeout| *timeout > 0).min();
        self.timeouts.shortest_timeout.store(shortest.unwrap_or(u64::MAX), Ordering::Relaxed);
        for gauge in before.values().chain(parts.gauges.values()) {
            let is_there = parts.stages().stages().iter().any(|stage| *stage.name == *gauge.name);
            if is_there { gauge.show(&self.board) } else { gauge.hide(&self.board) }
        }
        let watched = self.watch(&parts);
        Prepared { program, module, watched }
    }

    /// Lets the watchdog watch the modules that are there.
    fn watch(&self, parts: &Parts) -> Arc<[Watch]> {
        let watched: Arc<[Watch]> = parts.watched().map(|(seat, stage)| Watch { seat, stage }).collect();
        *self.members.watched.lock().unwrap_or_else(PoisonError::into_inner) = Arc::clone(&watched);
        // After they can be seen, so that a trace which begins now finds them there or here.
        self.tracing.add_tracks(&watched);
        watched
    }

    /// Gives the loop its plans; whoever has the token does, between two cycles.
    pub(super) fn install(
        &self,
        core: &mut Core,
        prepared: Prepared,
        actuators: Option<Vec<Arc<Actuator>>>,
    ) -> Replaced {
        let Prepared { program, module, watched } = prepared;
        let (planned, own) = module.unwrap_or_default();
        core.course.replan(planned);
        let plans = [std::mem::replace(&mut core.plan, program), std::mem::replace(&mut core.aside, own)];
        for seat in plans.iter().flat_map(|plan| &plan.seats) {
            // SAFETY: who installs has the token, between two cycles.
            unsafe { seat.set_in_turn(false) };
        }
        for seat in core.plan.seats.iter().chain(&core.aside.seats) {
            // SAFETY: as above; and these are the loop's from now on.
            unsafe { seat.set_in_turn(true) };
        }
        let actuators = actuators.map(|actuators| std::mem::replace(&mut core.actuators, actuators));
        // A run that was ended by a step that did not return has left in the middle of its cycle.
        core.position = Position::default();
        self.timeouts.deadline.store(0, Ordering::Release);
        let takeover = core.takeover.take_if(|guest| guest.has_left(&watched));
        let takeover = takeover.and_then(|guest| core.let_go(guest));
        let time_source = core.time_source.take_if(|guest| guest.has_left(&watched));
        let returned = core.absent.extract_if(.., |absent| absent.has_returned()).collect();
        Replaced { plans, actuators, takeover, time_source, returned }
    }
}
