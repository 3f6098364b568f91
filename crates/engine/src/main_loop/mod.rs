//! Main loop: stages in order, and in each stage the modules in link order.
//!
//! The loop is a token, not a thread: when a step hangs on the wall clock, the watchdog moves the loop to another
//! thread and continues without the late module. Under a time source the loop is in lockstep: everything depends on the
//! virtual time alone, and a step that hangs ends the run.

mod callback;
mod composing;
mod cycle;
mod driving;
mod gauges;
mod handover;
mod hooks;
mod jobs;
mod loop_replay;
mod notices;
mod pace;
mod plan;
mod policy;
mod roles;
mod run;
mod runner_cell;
mod snapshot;
mod takeover;
mod threads;
mod timeouts;
mod token;
mod tracing;
mod watchdog;
mod workers;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, MutexGuard};

use slate_blackboard::Board;
use slate_module::Level;

use crate::actuators::Actuator;
use crate::clock::{Clock, TimeSource};
use crate::digest::Digest;
use crate::log::Logger;
use crate::synchronization::Synchronization;

pub use cycle::cycle;
pub use driving::drive;
pub use gauges::HistogramPublisher;
pub use hooks::{AfterCycle, AfterTick, CycleWait, Hooks, RequestedChanges, WriteListeners};
pub use loop_replay::{LoopReplay, ReplayedCondition};
pub use pace::Pace;
pub use pace::Rate;
pub use plan::Levels;
pub use policy::{LoopPolicy, LoopPosition, STAGE_LIMIT};
pub use run::LoopRun;
pub use runner_cell::RunnerCell;
pub use slate_composition::own::LoopState;
pub use slate_configuration::Schedule;
pub use snapshot::LoopSnapshot;
pub use takeover::{Takeover, Takeovers};
pub use threads::ModuleThreads;
pub use tracing::AgentTrace;
pub use watchdog::{Watchdog, WatchedModule};
pub use workers::Workers;

use callback::{Callback, LateCallback, Role};
use composing::LoopMembers;
use cycle::Position;
use gauges::{LoopMeasures, PUBLICATION_PERIOD};
use handover::PlanSelection;
use jobs::Jobs;
use notices::Notices;
use plan::Plan;
use roles::{POLICY, PolicyRole, TAKEOVER, TIME_SOURCE, TimeRole};
use run::Successor;
use timeouts::StageTimeouts;
use token::LoopToken;
use tracing::Tracing;

/// View of the application at the end of a cycle.
#[derive(Debug)]
pub struct Cycle<'a> {
    /// Agent's time, ns.
    pub now: u64,
    /// Counts cycles from 1.
    pub number: u64,
    /// Blackboard with all properties of the robot.
    pub board: &'a Board,
}

/// Decision of the application after a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Begin of the next cycle.
    Continue,
    /// End of the run.
    Stop,
}

/// Callback at the end of each cycle, on the loop's thread.
pub type Observer = Box<dyn FnMut(&Cycle<'_>) -> Control + Send>;

/// Reason for the end of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// Requested by the observer or another caller.
    Stopped,
    /// Hanging step, without which nothing can continue in lockstep.
    Hung {
        /// Name of the module.
        module: String,
    },
    /// Hanging steps that cost too many threads.
    TooManyHung {
        /// Names of the modules.
        modules: Vec<String>,
    },
    /// Wait between two cycles that failed.
    Unanswered {
        /// Description.
        reason: String,
    },
}

/// Result of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Next cycle.
    Next,
    /// End of the run.
    Stop,
    /// Lost token: this thread's step was given up, and another thread has the loop.
    Lost,
}

/// Core of the loop, used only by the holder of the token.
pub struct Core {
    /// Active plan.
    plan: Plan,
    /// Inactive plan: the program's while the loop runs a module's stages, else theirs.
    inactive_plan: Plan,
    selection: PlanSelection,
    /// Gates.
    pub actuators: Vec<Arc<Actuator>>,
    /// Digest of the written values; `None` on the wall clock.
    pub digest: Option<Digest>,
    pace: Pace,
    /// Application's callback at the end of a cycle.
    pub observer: Option<Observer>,
    /// Wait between two cycles.
    wait: Option<CycleWait>,
    workers: Workers,
    cycle: u64,
    /// Time of the last cycle, ns: on the grid of the period, or of the time source.
    time: Option<u64>,
    policy: Option<Callback<dyn LoopPolicy>>,
    takeover: Option<Callback<Arc<Takeover>>>,
    time_source: Option<Callback<dyn TimeSource>>,
    /// Replay of a recording, if any.
    playback: Option<LoopReplay>,
    /// Callbacks that did not return.
    late_callbacks: Vec<LateCallback>,
    /// Position of the loop, for the thread that takes the token over.
    position: Position,
    notices: Notices,
}

impl Core {
    /// Returns the core of a loop without modules.
    fn new(pace: Pace, workers: Workers, lockstep: bool, time_source: Option<Box<dyn TimeSource>>) -> Self {
        Self {
            plan: Plan::default(),
            inactive_plan: Plan::default(),
            selection: PlanSelection::default(),
            actuators: Vec::new(),
            digest: lockstep.then(Digest::default),
            pace,
            observer: None,
            wait: None,
            workers,
            cycle: 0,
            time: None,
            policy: None,
            takeover: None,
            time_source: time_source.map(|code| Callback { name: TIME_SOURCE, cell: None, code }),
            playback: None,
            late_callbacks: Vec::new(),
            position: Position::default(),
            notices: Notices::default(),
        }
    }

    /// Jumps to another time, ns.
    pub fn jump(&mut self, time: u64) {
        self.time = Some(time);
        self.pace.restart();
    }

    /// Goes at another rate from the next cycle on.
    pub fn set_rate(&mut self, rate: Rate) {
        self.pace.set_rate(rate);
    }
}

/// Main loop, shared by all threads.
pub struct SharedLoop {
    /// Blackboard with the properties.
    pub board: Arc<Board>,
    /// Clock of the agent.
    pub clock: Arc<Clock>,
    /// Log.
    pub logger: Arc<Logger>,
    /// Synchronization points at which other threads join the loop.
    pub synchronization: Arc<Synchronization>,
    /// Trace of the steps and cycles.
    pub tracing: Tracing,
    /// Period of the cycles, ns.
    pub period: u64,
    /// True if a time source sets the time and all modules run on the loop.
    pub lockstep: bool,
    /// Present run.
    pub run: LoopRun,
    /// Callbacks at certain moments.
    pub hooks: Hooks,
    core: LoopToken,
    jobs: Jobs,
    members: LoopMembers,
    timeouts: StageTimeouts,
    measures: LoopMeasures,
    /// True while a recording is replayed.
    is_replaying: AtomicBool,
}

/// Log of the loop.
#[derive(Clone, Copy)]
pub(super) struct LoopLog<'a> {
    clock: &'a Clock,
    logger: &'a Logger,
}

impl LoopLog<'_> {
    /// Writes a line, now.
    pub fn write(&self, level: Level, text: &str) {
        self.logger.log(self.clock.now(), level, text);
    }
}

// SAFETY: the core is used only by the thread that holds the token, and the track of the loop too.
unsafe impl Sync for SharedLoop {}

/// Parameters of a new loop.
pub struct Parameters {
    /// Blackboard with the properties.
    pub board: Arc<Board>,
    /// Clock of the agent.
    pub clock: Arc<Clock>,
    /// Log.
    pub logger: Arc<Logger>,
    /// Period of the cycles, ns.
    pub period: u64,
    /// True if a time source sets the time and all modules run on the loop.
    pub lockstep: bool,
    /// Stages.
    pub schedule: Schedule,
    /// Threads that help with independent modules.
    pub workers: Workers,
    /// Pace of the cycles.
    pub pace: Pace,
    /// Source of the time.
    pub time_source: Option<Box<dyn TimeSource>>,
}

impl SharedLoop {
    /// Returns a loop without modules.
    pub fn new(parameters: Parameters) -> Self {
        let Parameters { board, clock, logger, period, lockstep, schedule, workers, pace, time_source } =
            parameters;
        let synchronization = Arc::new(Synchronization::default());
        let core = Core::new(pace, workers, lockstep, time_source);
        Self {
            measures: LoopMeasures::new(&board, &synchronization),
            board,
            clock,
            logger,
            synchronization,
            tracing: Tracing::default(),
            period,
            lockstep,
            run: LoopRun::default(),
            hooks: Hooks::default(),
            core: LoopToken::new(core),
            jobs: Jobs::default(),
            members: LoopMembers::new(schedule),
            timeouts: StageTimeouts::default(),
            is_replaying: AtomicBool::new(false),
        }
    }

    /// Returns the log of the loop.
    pub(super) fn log(&self) -> LoopLog<'_> {
        LoopLog { clock: &self.clock, logger: &self.logger }
    }

    /// Returns the core.
    ///
    /// # Safety
    /// The caller holds the token, or no thread does.
    #[allow(clippy::mut_from_ref, reason = "the token grants the access")]
    pub unsafe fn core(&self) -> &mut Core {
        // SAFETY: passed on to the caller.
        unsafe { self.core.core() }
    }

    /// Returns the modules that the watchdog watches.
    pub fn watched(&self) -> Arc<[WatchedModule]> {
        Arc::clone(&self.members.watched())
    }

    /// Returns the gates.
    pub fn actuators(&self) -> Arc<[Arc<Actuator>]> {
        Arc::clone(&self.members.gates())
    }

    /// Locks the threads of modules.
    pub fn threads(&self) -> MutexGuard<'_, ModuleThreads> {
        self.members.threads()
    }

    /// Cycles begun.
    pub fn cycles(&self) -> u64 {
        self.measures.gauges.cycles.load(Ordering::Relaxed)
    }

    /// Returns the stages with the modules of each.
    pub fn order(&self) -> Vec<(String, Vec<String>)> {
        self.members.parts().order()
    }

    /// Publishes the measurements, from any thread.
    pub fn publish_timing(&self) {
        let parts = self.members.parts();
        let watched = self.watched();
        let modules = watched.iter().map(|watch| (&watch.cell.publication, &watch.cell.health.histogram));
        self.measures.publish(self.clock.now(), parts.gauges.values(), modules);
    }

    /// Publishes the measurements until the run is over.
    /// It runs in a thread beside the loop, as a summary of a histogram takes some microseconds.
    pub fn publish_until_over(&self) {
        while !self.run.is_over_within(PUBLICATION_PERIOD) {
            if self.measures.are_due(self.clock.now()) {
                self.publish_timing();
            }
        }
        self.publish_timing();
    }

    /// Begins a run.
    pub fn begin(&self) {
        self.take_token();
        // SAFETY: the token was taken.
        unsafe { self.core() }.pace.restart();
        self.run.begin();
    }

    /// Records at the end of a run that no thread works on the core any more.
    pub fn release_token_at_end(&self) {
        self.release_token();
        self.run.record_token_release();
    }

    /// Moves the loop away from a step that does not return, to a spare or new thread.
    pub fn move_token(self: &Arc<Self>) {
        match self.run.pass_token() {
            Successor::Spare => return,
            Successor::NewThread => {
                let shared = Arc::clone(self);
                let next = std::thread::Builder::new().name("main loop".into());
                if next.spawn(move || drive(&shared)).is_ok() {
                    return;
                }
                self.run.finish(End::Stopped);
            }
            Successor::RunEnded => {}
        }
        self.release_token_at_end();
    }

    /// Lets a recording be played, from the next cycle on.
    pub fn play(&self, playback: Option<LoopReplay>) {
        self.take_token();
        self.is_replaying.store(playback.is_some(), Ordering::Relaxed);
        // SAFETY: the token was taken.
        unsafe { self.core() }.playback = playback;
        self.release_token();
    }

    /// Returns the recorded answer to a module's request; `None` if not recorded.
    pub fn recorded_answer(&self, module: &str, lines: &str) -> Option<Result<String, String>> {
        if !self.is_replaying.load(Ordering::Relaxed) {
            return None;
        }
        self.take_token();
        // SAFETY: the token was taken.
        let playback = unsafe { self.core() }.playback.as_mut();
        let answer = playback.and_then(|own| own.playback.answer(module, lines));
        self.release_token();
        answer
    }

    /// Takes the token for a single cycle.
    pub fn take_token(&self) {
        self.core.take();
    }

    /// Releases the token.
    pub fn release_token(&self) {
        self.core.release();
    }

    /// Sets the program's policy, which selects the next stage while no module does.
    /// Without one, the stages follow one another.
    pub fn set_policy(&self, code: Option<Box<dyn LoopPolicy>>) {
        let callback = code.map(|code| Callback { name: POLICY, cell: None, code });
        self.exchange::<PolicyRole>(callback);
    }

    /// Sets the time source of a driven clock.
    /// Without one, time advances by the period. A module of `cell` is on the loop, and each call is watched like a
    /// step of it.
    pub fn set_time_source(&self, code: Option<Box<dyn TimeSource>>, cell: Option<Arc<RunnerCell>>) {
        let callback = code.map(|code| Callback { name: TIME_SOURCE, cell, code });
        self.exchange::<TimeRole>(callback);
    }

    /// Sets the wait in lockstep at the end of each cycle.
    /// Without one, cycles follow one another.
    pub fn set_wait(&self, wait: Option<CycleWait>) {
        let before = self.between_cycles(&[], move |shared| {
            // SAFETY: jobs run in the thread that holds the token.
            Some(std::mem::replace(&mut unsafe { shared.core() }.wait, wait))
        });
        drop(before);
    }

    fn exchange<R: Role>(&self, callback: Option<Callback<R::Code>>)
    where
        Callback<R::Code>: Send + 'static,
    {
        let before = self.between_cycles(&[], move |shared| {
            // SAFETY: jobs run in the thread that holds the token.
            Some(std::mem::replace(R::callback(unsafe { shared.core() }), callback))
        });
        drop(before);
    }
}
