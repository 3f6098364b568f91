//! Cycle: the stages in order, and in each the steps of its modules.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::callback::{CallbackRemoval, CallbackResult, invoke_callback, remove_callback};
use super::policy::LoopPosition;
use super::roles::{PolicyRole, TakeoverRole, TimeRole};
use super::takeover::Choice;
use super::{Control, Core, Cycle, End, Flow, LoopReplay, RunnerCell, STAGE_LIMIT, SharedLoop, workers};
use crate::clock::monotonic;
use crate::runner::{Runner, StepCall};
use crate::timing::Span;

/// Position of the loop in its cycle, for the thread that takes the token over.
#[derive(Clone, Copy, Default)]
pub(super) struct Position {
    /// True once the cycle has begun.
    pub is_in_cycle: bool,
    /// Monotonic time of its begin, ns; 0 if it is not timed.
    began: u64,
    /// Nominal time of the cycle on the grid of the period, ns.
    /// Periods of modules are counted in it. It is the agent's time without the lateness of the thread's wake-up.
    nominal: u64,
    /// Present stage; `is_stage_open` is true until it has been ended.
    stage: Option<usize>,
    is_stage_open: bool,
    stage_began: u64,
    /// Deadline of the stage, monotonic, ns; 0 for none.
    deadline: u64,
    /// Number of stages of this cycle so far.
    stages: u32,
    /// Index of the next cell, and end of the stage's cells.
    cell: usize,
    end: usize,
    /// True while workers have steps that are not committed yet.
    has_worker_steps: bool,
    /// Removal of the callback that is being called.
    pub pending_removal: Option<CallbackRemoval>,
}

/// State of the cycle in this thread.
struct Turn {
    /// Agent's time, ns.
    now: u64,
    /// Nominal time, as in [`Position`], ns.
    nominal: u64,
    number: u64,
    /// True if all steps of the cycle are timed.
    /// `sampled` says that short ones also count for those of other cycles.
    timed: bool,
    sampled: bool,
    traced: bool,
    /// End of the last step, monotonic, ns; 0 if unknown.
    mark: u64,
}

impl Turn {
    /// Returns the weight of a step of that duration in its histogram.
    fn weight(&self, shared: &SharedLoop, has_deadline: bool, duration: u64) -> u32 {
        match () {
            () if has_deadline || self.traced || duration >= LONG_STEP && !shared.lockstep => 1,
            () if self.sampled => SAMPLE_INTERVAL as u32,
            () => 0,
        }
    }

    /// Measures a step that has just ended.
    /// It began at the monotonic time `start`, ns.
    #[inline(never)] // Few steps of lockstep are measured.
    fn measure(&mut self, shared: &SharedLoop, cell: &RunnerCell, runner: &mut Runner, start: u64) {
        // The end of a step is the beginning of the next.
        self.mark = monotonic();
        let duration = self.mark.saturating_sub(start);
        if self.traced {
            cell.record(shared, start, duration, self.number);
        }
        cell.measure(runner, duration, self.weight(shared, cell.has_deadline, duration));
    }

    /// Returns the weight of this cycle in the histogram.
    fn cycle_weight(&self, shared: &SharedLoop) -> u32 {
        if shared.lockstep && !self.traced { SAMPLE_INTERVAL as u32 } else { 1 }
    }

    /// Returns the number of the cycle if its steps are recorded.
    fn traced(&self) -> Option<u64> {
        self.traced.then_some(self.number)
    }

    /// Returns a monotonic time at most a step ago, ns.
    fn mark(&mut self) -> u64 {
        if self.mark == 0 {
            self.mark = monotonic();
        }
        self.mark
    }
}

/// Sampling interval of short steps, cycles; a sampled step counts for all of them.
/// In lockstep, which must be fast, only these cycles are timed. Steps with a deadline are always timed and counted.
const SAMPLE_INTERVAL: u64 = 16;
/// Least duration of a step that is always counted on the wall clock, ns.
const LONG_STEP: u64 = 50_000;

/// Makes a cycle, or the rest of one that another thread began.
pub fn cycle(shared: &SharedLoop) -> Flow {
    let Some(mut turn) = begin(shared) else { return Flow::Lost };
    loop {
        // SAFETY: this thread holds the token; every reference ends before a step is made, as the step may lose it.
        let next = unsafe { next_step(shared, shared.core(), &mut turn) };
        let (cell, call) = match next {
            // SAFETY: the core keeps the cell alive.
            Next::Step(cell, call) => (unsafe { &*cell }, call),
            Next::NotDue => continue,
            Next::StageOver => match next_stage(shared, &mut turn) {
                Stages::Next => continue,
                Stages::Over => break,
                Stages::Lost => return Flow::Lost,
            },
        };
        let start = if turn.timed || cell.has_deadline { turn.mark() } else { 0 };
        cell.begin(false, start);
        // SAFETY: the runner was prepared, and the cell keeps others out.
        let code = unsafe { call.make() };
        if !cell.end(code) {
            return Flow::Lost;
        }
        // SAFETY: the step was not given up, so this thread still holds the token.
        unsafe {
            let (core, runner) = (shared.core(), cell.runner());
            if start == 0 {
                turn.mark = 0;
            } else {
                turn.measure(shared, cell, runner, start);
            }
            if core.position.has_worker_steps {
                commit_workers(shared, core, &mut turn, runner);
            }
            runner.count();
            runner.commit(turn.now, code, core.digest.as_mut());
        }
    }
    end(shared, &mut turn)
}

/// Commits the steps of workers, which ran beside that of `runner`.
#[cold]
fn commit_workers(shared: &SharedLoop, core: &mut Core, turn: &mut Turn, runner: &mut Runner) {
    core.position.has_worker_steps = false;
    core.workers.commit(shared, turn.now, turn.traced(), core.digest.as_mut());
    runner.log.release();
    turn.mark = 0;
}

/// Waits for the beginning of a cycle, unless it has begun.
/// `None` if the time source did not return.
fn begin(shared: &SharedLoop) -> Option<Turn> {
    let (is_in_cycle, last) = {
        // SAFETY: this thread holds the token; the reference ends before the call of the time source.
        let core = unsafe { shared.core() };
        if let Some(remove_late) = core.position.pending_removal.take() {
            let text = format!("{} did not return; the default holds", remove_late(core));
            shared.log().write(slate_module::Level::Error, &text);
        }
        (core.position.is_in_cycle, core.time)
    };
    if !is_in_cycle {
        let time = time_of_next(shared, last)?;
        // SAFETY: as above; asking was not given up.
        begin_cycle(shared, unsafe { shared.core() }, time);
    }
    // SAFETY: as above.
    let core = unsafe { shared.core() };
    let traced = shared.tracing.is_on();
    let sampled = core.cycle % SAMPLE_INTERVAL == 1;
    let timed = !shared.lockstep || traced || sampled;
    let mut turn = Turn {
        now: shared.clock.now(),
        nominal: core.position.nominal,
        number: core.cycle,
        timed,
        sampled,
        traced,
        mark: 0,
    };
    if !is_in_cycle && timed {
        core.position.began = turn.mark();
    }
    Some(turn)
}

/// Returns the next cycle's time, ns; `None` if the time source did not return.
fn time_of_next(shared: &SharedLoop, last: Option<u64>) -> Option<u64> {
    let planned = last.map_or(0, |last| last + shared.period);
    if !shared.clock.is_driven() {
        return Some(planned);
    }
    // SAFETY: this thread holds the token; a playback is watched as little as an observer, so it is not lost meanwhile.
    if let Some(playback) = unsafe { shared.core() }.playback.as_mut() {
        let time = playback.playback.next(last, planned);
        return Some(last.map_or(time, |last| if time < last { last } else { time }));
    }
    match invoke_callback::<TimeRole, _>(shared, |source| source.next(last, planned)) {
        CallbackResult::Answer(time) => match last {
            Some(last) if time < last => {
                shared.measures.gauges.refused_times.fetch_add(1, Ordering::Relaxed);
                Some(last)
            }
            _ => Some(time),
        },
        CallbackResult::Unavailable => Some(planned),
        CallbackResult::Lost => None,
    }
}

fn begin_cycle(shared: &SharedLoop, core: &mut Core, time: u64) {
    let beginning = core.pace.wait(shared, time);
    // In lockstep only the pace suffers, and nothing that a module sees.
    if beginning.late > 0 && !shared.lockstep {
        shared.measures.gauges.overruns.fetch_add(1, Ordering::Relaxed);
        core.report_overrun(shared, beginning.late);
    }
    shared.clock.set(time);
    core.time = Some(time);
    core.cycle += 1;
    shared.measures.gauges.cycles.store(core.cycle, Ordering::Relaxed);
    core.select_plan(&shared.log());
    let nominal = if shared.clock.is_driven() { time } else { shared.clock.at(beginning.nominal) };
    core.position = Position { is_in_cycle: true, nominal, ..Position::default() };
    for cell in core.plan.previous_readers.iter().filter(|cell| cell.is_idle()) {
        // SAFETY: the cell is idle, and those of the plan belong to the holder of the token.
        unsafe { cell.runner() }.pin_previous();
    }
    shared.measures.emit_start();
}

/// Continuation after a stage.
enum Stages {
    Next,
    /// End of the cycle.
    Over,
    /// Policy that did not return.
    Lost,
}

/// Ends a stage, and begins the one that comes next.
fn next_stage(shared: &SharedLoop, turn: &mut Turn) -> Stages {
    let (after, stages_so_far, count, has_policy) = {
        // SAFETY: this thread holds the token; the reference ends before the call of the policy.
        let core = unsafe { shared.core() };
        if core.position.is_stage_open {
            core.position.is_stage_open = false;
            end_stage(shared, core, turn);
        }
        let has_policy = core.selection.number != 0 || core.policy.is_some();
        (core.position.stage, core.position.stages, core.plan.stages.len(), has_policy)
    };
    let mut next = Some(after.map_or(0, |after| after + 1)).filter(|next| *next < count);
    if has_policy {
        // SAFETY: as above.
        let stages = Arc::clone(&unsafe { shared.core() }.plan.names);
        let position = LoopPosition { after, stages: &stages, now: turn.now, cycle: turn.number };
        // SAFETY: as above.
        let number = unsafe { shared.core() }.selection.number;
        let result = match number {
            0 => invoke_callback::<PolicyRole, _>(shared, |policy| Choice::Stage(policy.next(&position))),
            number => {
                invoke_callback::<TakeoverRole, _>(shared, |takeover| takeover.choose(number, &position))
            }
        };
        let choice = match result {
            CallbackResult::Answer(choice) => choice,
            CallbackResult::Unavailable => Choice::InOrder,
            CallbackResult::Lost => return Stages::Lost,
        };
        // SAFETY: asking was not given up, so this thread still holds the token.
        let core = unsafe { shared.core() };
        let mut remove_policy = |reason: &str| match number {
            0 => remove_callback::<PolicyRole>(core, &shared.log(), reason),
            _ => core.end_failed_takeover(&shared.log(), reason),
        };
        match choice {
            Choice::InOrder => {}
            Choice::Panicked => remove_policy("panicked"),
            Choice::Stage(Some(stage)) if stage >= count => {
                remove_policy(&format!("chose stage {stage} of {count}, from 0"));
            }
            Choice::Stage(Some(_)) if stages_so_far >= STAGE_LIMIT => {
                remove_policy(&format!("chose {STAGE_LIMIT} stages in a cycle"));
                next = None;
            }
            Choice::Stage(choice) => next = choice,
        }
        // To decide is not a module's work.
        turn.mark = 0;
    }
    // SAFETY: as above.
    let core = unsafe { shared.core() };
    let position = &mut core.position;
    if !has_policy && !shared.synchronization.is_requested() {
        // A stage without modules has no effect without a waiter, and most robots have such stages.
        let skipped = core.plan.stages[next.unwrap_or(count)..].iter().take_while(|stage| stage.is_empty());
        let skipped = skipped.count();
        position.stages += skipped as u32;
        next = next.map(|next| next + skipped).filter(|next| *next < count);
    }
    let Some(next) = next else { return Stages::Over };
    let stage = &core.plan.stages[next];
    position.stage = Some(next);
    position.is_stage_open = true;
    position.stages += 1;
    (position.cell, position.end) = (stage.first, stage.end);
    position.stage_began = if turn.timed { turn.mark() } else { 0 };
    position.deadline = 0;
    if stage.timeout > 0 && !shared.lockstep {
        position.deadline = turn.mark() + stage.timeout;
        shared.timeouts.set_deadline(position.deadline);
    }
    if shared.synchronization.is_requested()
        && let Some(start) = stage.gauge.start.as_ref().filter(|start| start.is_requested())
    {
        start.emit();
    }
    Stages::Next
}

fn end_stage(shared: &SharedLoop, core: &mut Core, turn: &mut Turn) {
    let Core { plan, position, .. } = core;
    let Some(stage) = position.stage.and_then(|stage| plan.stages.get(stage)) else { return };
    if position.deadline != 0 {
        position.deadline = 0;
        shared.timeouts.set_deadline(0);
    }
    if position.stage_began != 0 && !stage.is_empty() {
        let duration = turn.mark().saturating_sub(position.stage_began);
        stage.gauge.histogram.record(duration, turn.cycle_weight(shared));
        if turn.traced
            && let Some(label) = stage.gauge.label
        {
            let start = shared.clock.at(position.stage_began);
            shared.tracing.record(Span { label, start, duration, cycle: turn.number });
        }
    }
    if shared.synchronization.is_requested()
        && let Some(end) = stage.gauge.end.as_ref().filter(|end| end.is_requested())
    {
        end.emit();
    }
}

/// Next action of the loop in a stage.
enum Next {
    /// Prepared step.
    /// The core keeps the cell alive, and cells are never removed while the loop runs.
    Step(*const RunnerCell, StepCall),
    /// Module that is not due.
    NotDue,
    /// All have had their turn, or the time is up.
    StageOver,
}

#[inline]
fn next_step(shared: &SharedLoop, core: &mut Core, turn: &mut Turn) -> Next {
    if core.position.has_worker_steps {
        // The thread that gave the steps to the workers was lost.
        core.position.has_worker_steps = false;
        core.workers.commit(shared, turn.now, turn.traced(), core.digest.as_mut());
    }
    let Core { plan, position, workers, playback, .. } = core;
    if position.cell >= position.end {
        return Next::StageOver;
    }
    if position.deadline != 0 && turn.mark() >= position.deadline {
        core.skip_remaining(shared);
        return Next::StageOver;
    }
    let first = position.cell;
    if let Some(playback) = playback {
        write_before(playback, turn.now, &plan.cells[first].name);
    }
    let level = || &plan.cells[first..plan.ends[first]];
    // Between those of a level there may be modules that are played.
    let (count, call) = if workers.has_threads() && playback.is_none() && workers.is_worthwhile(level()) {
        position.has_worker_steps = true;
        workers.dispatch(level(), turn.now, turn.nominal)
    } else {
        (1, workers::prepare_due(&plan.cells[first], turn.now, turn.nominal))
    };
    position.cell += count;
    match call {
        Some(call) => Next::Step(Arc::as_ptr(&plan.cells[first + count - 1]), call),
        None => Next::NotDue,
    }
}

/// Writes the recorded values of modules before this one in the cycle.
/// Few loops play a recording, and no other pays for it.
#[cold]
fn write_before(playback: &mut LoopReplay, now: u64, module: &str) {
    playback.write(now, Some(module));
}

impl Core {
    /// Skips the modules of the stage that have not had their turn.
    fn skip_remaining(&mut self, shared: &SharedLoop) {
        let Self { plan, position, .. } = self;
        let cells = &plan.cells[position.cell..position.end];
        position.cell = position.end;
        let missed = || cells.iter().filter(|cell| cell.misses_its_turn());
        missed().for_each(|cell| cell.count_miss());
        if let Some(stage) = position.stage.and_then(|stage| plan.stages.get(stage)) {
            self.notices.report_time_up(shared, stage, missed());
        }
    }

    /// Reports that cycles had to be left out.
    fn report_overrun(&mut self, shared: &SharedLoop, late: u64) {
        // Of the cycle before, which is at its end.
        let began = self.position.began;
        self.notices.report_overrun(shared, late, began, &self.plan.cells);
    }
}

/// Ends a cycle after its last stage.
fn end(shared: &SharedLoop, turn: &mut Turn) -> Flow {
    // SAFETY: this thread holds the token, and no step is left in this cycle.
    let core = unsafe { shared.core() };
    core.position.is_in_cycle = false;
    if let Some(playback) = core.playback.as_mut() {
        playback.write(turn.now, None);
    }
    for actuator in &core.actuators {
        actuator.expire(turn.now, core.digest.as_mut());
    }
    shared.hooks.notify_write();
    shared.measures.emit_end();
    let control = core.observer.as_mut().map_or(Control::Continue, |observer| {
        observer(&Cycle { now: turn.now, number: core.cycle, board: &shared.board })
    });
    if turn.timed && core.position.began != 0 {
        let duration = monotonic().saturating_sub(core.position.began);
        shared.measures.gauges.last.store(duration, Ordering::Relaxed);
        shared.measures.gauges.histogram.record(duration, turn.cycle_weight(shared));
        if turn.traced
            && let Some(label) = shared.tracing.cycle
        {
            let start = shared.clock.at(core.position.began);
            shared.tracing.record(Span { label, start, duration, cycle: turn.number });
        }
    }
    if control == Control::Continue
        && let Some(wait) = core.wait.as_mut().filter(|_| shared.lockstep)
        && let Err(reason) = wait(turn.now, &|| shared.run.is_running())
    {
        shared.run.finish(End::Unanswered { reason });
        return Flow::Stop;
    }
    // In what is left of the period, so that no cycle is late for it.
    if let Some(job) = shared.jobs.next()
        && job(shared) == Flow::Lost
    {
        return Flow::Lost;
    }
    if shared.lockstep {
        shared.plan_request_here();
    }
    if let Some(after_cycle) = shared.hooks.after_cycle()
        && after_cycle(shared, turn.now) == Flow::Lost
    {
        return Flow::Lost;
    }
    match control {
        Control::Continue => Flow::Next,
        Control::Stop => Flow::Stop,
    }
}
