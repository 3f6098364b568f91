//! Plans of the loop, prepared beside it and exchanged between two cycles.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError, Weak};

use slate_module::Level;

use super::callback::{Callback, LateCallback};
use super::cycle::Position;
use super::gauges::StageGauge;
use super::plan::{Plan, PlanParts};
use super::{
    Core, Levels, ModuleThreads, RunnerCell, Schedule, SharedLoop, TAKEOVER, Takeover, WatchedModule,
};
use crate::actuators::Actuator;
use crate::clock::TimeSource;

/// Plans that are ready for the loop.
pub(super) struct Prepared {
    program: Plan,
    /// Plan of a module's stages, with their number.
    module: Option<(u64, Plan)>,
    watched: Arc<[WatchedModule]>,
}

/// Parts that the loop no longer needs, dropped by another thread.
#[allow(dead_code, reason = "it is only dropped")]
pub(super) struct ReplacedParts {
    plans: [Plan; 2],
    actuators: Option<Vec<Arc<Actuator>>>,
    takeover: Option<Callback<Arc<Takeover>>>,
    time_source: Option<Callback<dyn TimeSource>>,
    returned: Vec<LateCallback>,
}

/// Members of the loop: modules, gates and threads, for changes.
#[derive(Default)]
pub(super) struct LoopMembers {
    /// Lock of planning, held until the plans are exchanged.
    planning: Mutex<()>,
    parts: Mutex<PlanParts>,
    watched: Mutex<Arc<[WatchedModule]>>,
    /// Gates, for a stop, which waits for nothing else.
    gates: Mutex<Arc<[Arc<Actuator>]>>,
    threads: Mutex<ModuleThreads>,
}

impl LoopMembers {
    /// Returns no members yet, on a loop with those stages.
    pub fn new(schedule: Schedule) -> Self {
        Self { parts: Mutex::new(PlanParts { schedule, ..PlanParts::default() }), ..Self::default() }
    }

    /// Locks the parts from which plans are made.
    pub fn parts(&self) -> MutexGuard<'_, PlanParts> {
        lock(&self.parts)
    }

    /// Locks the modules that the watchdog watches.
    pub fn watched(&self) -> MutexGuard<'_, Arc<[WatchedModule]>> {
        lock(&self.watched)
    }

    /// Locks the gates.
    pub fn gates(&self) -> MutexGuard<'_, Arc<[Arc<Actuator>]>> {
        lock(&self.gates)
    }

    /// Locks the threads of modules.
    pub fn threads(&self) -> MutexGuard<'_, ModuleThreads> {
        lock(&self.threads)
    }

    /// Locks planning: only the holder makes plans.
    fn planning(&self) -> MutexGuard<'_, ()> {
        lock(&self.planning)
    }

    /// Tries to take the planning lock without blocking.
    fn try_planning(&self) -> Option<MutexGuard<'_, ()>> {
        match self.planning.try_lock() {
            Ok(planning) => Some(planning),
            Err(TryLockError::Poisoned(error)) => Some(error.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl SharedLoop {
    /// Sets the modules and actuators of the loop, from its next cycle on.
    /// `levels` holds the modules by their stages, and `threaded` those watched beside them; stale commands of
    /// `actuators` expire in the loop. A module that is no longer among them loses its policy of the loop and its time
    /// source.
    pub fn compose(
        &self,
        levels: Vec<Levels>,
        threaded: Vec<Arc<RunnerCell>>,
        actuators: Vec<Arc<Actuator>>,
    ) {
        self.compose_with(levels, threaded, actuators, || Ok::<(), ()>(()));
    }

    /// Acts as [`compose`](SharedLoop::compose), after `work` at the same moment.
    /// If `work` fails, nothing is changed. `None` if the loop was lost.
    pub fn compose_with<R: Send + 'static, E: Send + 'static>(
        &self,
        levels: Vec<Levels>,
        threaded: Vec<Arc<RunnerCell>>,
        actuators: Vec<Arc<Actuator>>,
        work: impl FnOnce() -> Result<R, E> + Send + 'static,
    ) -> Option<Result<R, E>> {
        let planning = self.members.planning();
        let mut parts = self.members.parts();
        let before = (parts.levels.clone(), parts.threaded.clone());
        (parts.levels, parts.threaded) = (levels, threaded);
        drop(parts);
        let gates = actuators.iter().cloned().collect();
        let result = self.rebuild(&planning, Some(actuators), work);
        match result {
            Some(Ok(_)) => *self.members.gates() = gates,
            _ => {
                let mut parts = self.members.parts();
                (parts.levels, parts.threaded) = before;
                self.watch(&parts);
            }
        }
        result
    }

    /// Sets the program's stages, from the next cycle on.
    /// The loop runs them while no module has taken it with others.
    pub fn set_schedule(&self, schedule: Schedule) {
        let planning = self.members.planning();
        self.members.parts().schedule = schedule;
        self.rebuild(&planning, None, || Ok::<(), ()>(()));
    }

    /// Makes new plans and exchanges them between two cycles, after `work`.
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
            // SAFETY: a job runs in the thread that holds the token.
            let core = unsafe { shared.core() };
            Some(Ok((result, shared.install(core, prepared, actuators))))
        });
        // Unused parts are dropped here and not on the loop.
        match exchanged {
            Ok(Ok((result, _))) => Some(Ok(result)),
            Ok(Err((error, _))) => Some(Err(error)),
            Err(_) => None,
        }
    }

    /// Makes the plans.
    pub(super) fn prepare(&self, _: &MutexGuard<'_, ()>) -> Prepared {
        let mut parts = self.members.parts();
        parts.update_request();
        let before = std::mem::take(&mut parts.gauges);
        let stages =
            parts.schedule.stages().iter().chain(parts.request.iter().flat_map(|(_, own)| own.stages()));
        let names: Vec<Arc<str>> = stages.map(|stage| stage.name.as_str().into()).collect();
        for name in names {
            let gauge = before.get(&name).cloned().unwrap_or_else(|| {
                Arc::new(StageGauge::new(&name, &self.synchronization, self.tracing.trace()))
            });
            parts.gauges.insert(name, gauge);
        }
        let program = parts.plan(&parts.schedule);
        let module = parts.request.as_ref().map(|(number, own)| (*number, parts.plan(own)));
        let plans = [Some(&program), module.as_ref().map(|(_, plan)| plan)].into_iter().flatten();
        let timeouts = plans.flat_map(|plan| &plan.stages).map(|stage| stage.timeout);
        let shortest = timeouts.filter(|timeout| *timeout > 0).min();
        self.timeouts.set_shortest(shortest);
        for gauge in before.values().chain(parts.gauges.values()) {
            let is_present = parts.stages().stages().iter().any(|stage| *stage.name == *gauge.name);
            if is_present { gauge.add_to(&self.board) } else { gauge.remove_from(&self.board) }
        }
        let watched = self.watch(&parts);
        Prepared { program, module, watched }
    }

    /// Lets the watchdog watch the present modules.
    fn watch(&self, parts: &PlanParts) -> Arc<[WatchedModule]> {
        let watched: Arc<[WatchedModule]> =
            parts.watched().map(|(cell, stage)| WatchedModule { cell, stage }).collect();
        *self.members.watched() = Arc::clone(&watched);
        // After they can be seen, so that a trace which begins now finds them there or here.
        self.tracing.add_tracks(&watched);
        watched
    }

    /// Installs plans in the loop between two cycles; the caller has the token.
    pub(super) fn install(
        &self,
        core: &mut Core,
        prepared: Prepared,
        actuators: Option<Vec<Arc<Actuator>>>,
    ) -> ReplacedParts {
        let Prepared { program, module, watched } = prepared;
        let (planned, own) = module.unwrap_or_default();
        core.selection.replan(planned);
        let plans =
            [std::mem::replace(&mut core.plan, program), std::mem::replace(&mut core.inactive_plan, own)];
        for cell in plans.iter().flat_map(|plan| &plan.cells) {
            // SAFETY: the caller has the token, between two cycles.
            unsafe { cell.set_in_turn(false) };
        }
        for cell in core.plan.cells.iter().chain(&core.inactive_plan.cells) {
            // SAFETY: as above; and these are the loop's from now on.
            unsafe { cell.set_in_turn(true) };
        }
        let actuators = actuators.map(|actuators| std::mem::replace(&mut core.actuators, actuators));
        // A run that was ended by a step that did not return has left in the middle of its cycle.
        core.position = Position::default();
        self.timeouts.set_deadline(0);
        let takeover = core.takeover.take_if(|callback| callback.is_removed(&watched));
        let takeover = takeover.and_then(|callback| core.release_callback(callback));
        let time_source = core.time_source.take_if(|callback| callback.is_removed(&watched));
        let returned =
            core.late_callbacks.extract_if(.., |late_callbacks| late_callbacks.has_returned()).collect();
        ReplacedParts { plans, actuators, takeover, time_source, returned }
    }

    /// Sets the module that may take the loop, which is on the loop.
    pub fn set_takeover(self: &Arc<Self>, module: Option<(Arc<Takeover>, Arc<RunnerCell>)>) {
        let planning = self.members.planning();
        let slot = module.as_ref().map(|(takeover, _)| Arc::clone(takeover));
        let before = std::mem::replace(&mut self.members.parts().takeover, slot.clone());
        let callback =
            module.map(|(code, cell)| Callback { name: TAKEOVER, cell: Some(cell), code: Box::new(code) });
        let left = self.between_cycles(&[], move |shared| {
            // SAFETY: a job runs in the thread that holds the token.
            let core = unsafe { shared.core() };
            let left = std::mem::replace(&mut core.takeover, callback);
            Some(left.and_then(|callback| core.release_callback(callback)))
        });
        drop(left);
        if let Some(before) = before {
            before.close();
            // The stages that it had.
            self.rebuild(&planning, None, || Ok::<(), ()>(()));
        }
        // In lockstep the loop itself makes the plans, so that they are there in the same cycle in each run.
        if let Some(takeover) = slot.filter(|_| !self.lockstep) {
            let (shared, own) = (Arc::downgrade(self), Arc::clone(&takeover));
            let thread = std::thread::Builder::new().name("stages".into());
            if let Err(error) = thread.spawn(move || make_plans(&shared, &own)) {
                let text =
                    format!("{} can't bring stages: a thread can't be started: {error}", takeover.module);
                self.log().write(Level::Error, &text);
            }
        }
    }

    /// Makes plans for the requested stages of a module, and lets the loop run them.
    fn plan_request(&self, takeover: &Arc<Takeover>) {
        takeover.clear_pending();
        takeover.drop_replaced();
        let planning = self.members.planning();
        let mut parts = self.members.parts();
        let is_present = parts.takeover.as_ref().is_some_and(|present| Arc::ptr_eq(present, takeover));
        let is_changed = is_present && parts.update_request();
        drop(parts);
        if is_changed {
            self.rebuild(&planning, None, || Ok::<(), ()>(()));
        }
    }

    /// Exchanges the plans in lockstep, at the end of a cycle.
    /// It may take its time, and must not depend on the timing of other threads.
    pub(super) fn plan_request_here(&self) {
        // SAFETY: the caller has the token; the reference ends before a module's code may run.
        let takeover = unsafe { self.core() }.takeover.as_ref();
        let Some(takeover) = takeover.filter(|callback| callback.code.has_pending_work()) else { return };
        let takeover = Arc::clone(&takeover.code);
        // Else another thread changes the agent, and waits for the loop.
        let Some(planning) = self.members.try_planning() else { return };
        takeover.clear_pending();
        takeover.drop_replaced();
        if self.members.parts().update_request() {
            let prepared = self.prepare(&planning);
            // SAFETY: as above.
            drop(self.install(unsafe { self.core() }, prepared, None));
        }
    }
}

/// Runs the thread that makes plans for a module's stages.
/// The loop has no time for that.
fn make_plans(shared: &Weak<SharedLoop>, takeover: &Arc<Takeover>) {
    while takeover.wait() {
        let Some(shared) = shared.upgrade() else { return };
        shared.plan_request(takeover);
    }
}
