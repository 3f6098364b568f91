//! The main loop: stages in order, and in each stage the modules in the order of their links.
//!
//! The loop is a token, not a thread: when a step hangs on the wall clock, the watchdog moves the loop to another
//! thread and goes on without the late module. Under a time source the loop is in lockstep: everything depends on the
//! virtual time alone, and a step that hangs ends the run.

mod composing;
mod cycle;
mod driving;
mod frozen;
mod gauges;
mod guest;
mod handover;
mod hooks;
mod jobs;
mod notices;
mod pace;
mod plan;
mod playing;
mod policy;
mod roles;
mod run;
mod seat;
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
pub use frozen::FrozenLoop;
pub use gauges::Publication;
pub use hooks::{AfterCycle, AfterTick, AskedChanges, CycleWait, Hooks, WriteListeners};
pub use pace::Pace;
pub use pace::Rate;
pub use plan::Levels;
pub use playing::{PlayedCondition, Playing};
pub use policy::{LoopPolicy, LoopPosition, STAGE_LIMIT};
pub use run::LoopRun;
pub use seat::Seat;
pub use slate_composition::own::LoopState;
pub use slate_configuration::Schedule;
pub use takeover::{Takeover, Takeovers};
pub use threads::ModuleThreads;
pub use tracing::AgentTrace;
pub use watchdog::{Watchdog, WatchedModule};
pub use workers::Workers;

use composing::LoopMembers;
use cycle::Position;
use gauges::{INTERVAL, LoopMeasures};
use guest::{Absent, Guest, Role};
use handover::LoopCourse;
use jobs::Jobs;
use notices::Notices;
use plan::Plan;
use roles::{POLICY, PolicyRole, TAKEOVER, TIME_SOURCE, TimeRole};
use run::Successor;
use timeouts::StageTimeouts;
use token::LoopToken;
use tracing::Tracing;

/// What the application sees at the end of a cycle.
#[derive(Debug)]
pub struct Cycle<'a> {
    /// The agent's time, nanoseconds.
    pub now: u64,
    /// Counts cycles from 1.
    pub number: u64,
    /// Everything that the robot knows.
    pub board: &'a Board,
}

/// What the application wants after a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// The next cycle.
    Continue,
    /// The end of the run.
    Stop,
}

/// What is called at the end of each cycle, on the loop's thread.
pub type Observer = Box<dyn FnMut(&Cycle<'_>) -> Control + Send>;

/// Why a run ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// The observer, or somebody else, asked for it.
    Stopped,
    /// A step did not return, and in lockstep nothing can go on without it.
    Hung {
        /// The module.
        module: String,
    },
    /// Too many threads were lost to steps that did not return.
    TooManyHung {
        /// The modules.
        modules: Vec<String>,
    },
    /// What the loop waits for between two cycles did not come.
    Unanswered {
        /// In words.
        reason: String,
    },
}

/// How a cycle ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// The next cycle may begin.
    Next,
    /// The run ends.
    Stop,
    /// The step that this thread made was given up: another thread has the loop.
    Lost,
}

/// What the loop works on. Whoever holds the token has it alone.
pub struct Core {
    /// What the loop runs.
    plan: Plan,
    /// The program's plan while it runs the stages of a module, and theirs while it does not.
    aside: Plan,
    course: LoopCourse,
    /// The gates.
    pub actuators: Vec<Arc<Actuator>>,
    /// The fingerprint of what was written; none on the wall clock.
    pub digest: Option<Digest>,
    pace: Pace,
    /// What the application does at the end of a cycle.
    pub observer: Option<Observer>,
    /// What the loop waits for between two cycles.
    wait: Option<CycleWait>,
    workers: Workers,
    cycle: u64,
    /// The time of the last cycle, on the grid of the period or as the time source said.
    time: Option<u64>,
    policy: Option<Guest<dyn LoopPolicy>>,
    takeover: Option<Guest<Arc<Takeover>>>,
    time_source: Option<Guest<dyn TimeSource>>,
    /// What plays a recording, if anything does.
    playback: Option<Playing>,
    /// Those of them that did not return.
    absent: Vec<Absent>,
    /// Where the loop stands, for the thread that takes the token over.
    position: Position,
    notices: Notices,
}

impl Core {
    /// A loop without modules, which `time_source` may tell the time.
    fn new(pace: Pace, workers: Workers, lockstep: bool, time_source: Option<Box<dyn TimeSource>>) -> Self {
        Self {
            plan: Plan::default(),
            aside: Plan::default(),
            course: LoopCourse::default(),
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
            time_source: time_source.map(|code| Guest { what: TIME_SOURCE, seat: None, code }),
            playback: None,
            absent: Vec::new(),
            position: Position::default(),
            notices: Notices::default(),
        }
    }

    /// Goes on from another time.
    pub fn jump(&mut self, time: u64) {
        self.time = Some(time);
        self.pace.restart();
    }

    /// Goes at another rate from the next cycle on.
    pub fn set_rate(&mut self, rate: Rate) {
        self.pace.set_rate(rate);
    }
}

/// The loop as all threads see it.
pub struct SharedLoop {
    /// The properties.
    pub board: Arc<Board>,
    /// The agent's time.
    pub clock: Arc<Clock>,
    /// The log.
    pub logger: Arc<Logger>,
    /// Where other threads fall in with the loop.
    pub synchronization: Arc<Synchronization>,
    /// What ran when.
    pub tracing: Tracing,
    /// From one cycle to the next, nanoseconds.
    pub period: u64,
    /// Whether a time source sets the time and all runs on the loop.
    pub lockstep: bool,
    /// The run that goes on.
    pub run: LoopRun,
    /// What is called at certain moments.
    pub hooks: Hooks,
    core: LoopToken,
    jobs: Jobs,
    members: LoopMembers,
    timeouts: StageTimeouts,
    measures: LoopMeasures,
    /// Whether a recording is played.
    is_playing: AtomicBool,
}

/// Where the loop says what it does.
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

/// What a loop is made with.
pub struct Parameters {
    /// The properties.
    pub board: Arc<Board>,
    /// The agent's time.
    pub clock: Arc<Clock>,
    /// The log.
    pub logger: Arc<Logger>,
    /// From one cycle to the next, nanoseconds.
    pub period: u64,
    /// Whether a time source sets the time and all runs on the loop.
    pub lockstep: bool,
    /// The stages.
    pub schedule: Schedule,
    /// Threads that help with independent modules.
    pub workers: Workers,
    /// How fast it goes.
    pub pace: Pace,
    /// What says the time.
    pub time_source: Option<Box<dyn TimeSource>>,
}

impl SharedLoop {
    /// A loop without modules.
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
            is_playing: AtomicBool::new(false),
        }
    }

    /// Where it says what it does.
    pub(super) fn log(&self) -> LoopLog<'_> {
        LoopLog { clock: &self.clock, logger: &self.logger }
    }

    /// The core.
    ///
    /// # Safety
    /// The caller holds the token, or nobody does.
    #[allow(clippy::mut_from_ref, reason = "the token grants the access")]
    pub unsafe fn core(&self) -> &mut Core {
        // SAFETY: passed on to the caller.
        unsafe { self.core.core() }
    }

    /// The modules that the watchdog watches.
    pub fn watched(&self) -> Arc<[WatchedModule]> {
        Arc::clone(&self.members.watched())
    }

    /// The gates.
    pub fn actuators(&self) -> Arc<[Arc<Actuator>]> {
        Arc::clone(&self.members.gates())
    }

    /// The threads of modules.
    pub fn threads(&self) -> MutexGuard<'_, ModuleThreads> {
        self.members.threads()
    }

    /// Cycles begun.
    pub fn cycles(&self) -> u64 {
        self.measures.gauges.cycles.load(Ordering::Relaxed)
    }

    /// The stages and the modules of each.
    pub fn order(&self) -> Vec<(String, Vec<String>)> {
        self.members.parts().order()
    }

    /// Shows what was measured, from any thread.
    pub fn publish_timing(&self) {
        let parts = self.members.parts();
        let watched = self.watched();
        let modules = watched.iter().map(|watch| (&watch.seat.publication, &watch.seat.health.histogram));
        self.measures.publish(self.clock.now(), parts.gauges.values(), modules);
    }

    /// Shows what is measured until the run is over: the life of a thread beside the loop, as to sum histograms up takes
    /// some microseconds each.
    pub fn publish_until_over(&self) {
        while !self.run.is_over_within(INTERVAL) {
            if self.measures.are_old(self.clock.now()) {
                self.publish_timing();
            }
        }
        self.publish_timing();
    }

    /// Before a run.
    pub fn begin(&self) {
        self.take_token();
        // SAFETY: the token was taken.
        unsafe { self.core() }.pace.restart();
        self.run.begin();
    }

    /// After the end of a run: says that no thread works on the core any more.
    pub fn put_token_down(&self) {
        self.give_token_back();
        self.run.put_token_down();
    }

    /// Gives the loop, which is with a step that does not return, to a spare thread or a new one.
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
            Successor::Nobody => {}
        }
        self.put_token_down();
    }

    /// Lets a recording be played, from the next cycle on.
    pub fn play(&self, playback: Option<Playing>) {
        self.take_token();
        self.is_playing.store(playback.is_some(), Ordering::Relaxed);
        // SAFETY: the token was taken.
        unsafe { self.core() }.playback = playback;
        self.give_token_back();
    }

    /// What came of a module's request when the recording was made that is played, if it has that request.
    pub fn recorded_answer(&self, module: &str, lines: &str) -> Option<Result<String, String>> {
        if !self.is_playing.load(Ordering::Relaxed) {
            return None;
        }
        self.take_token();
        // SAFETY: the token was taken.
        let playback = unsafe { self.core() }.playback.as_mut();
        let answer = playback.and_then(|own| own.playback.answer(module, lines));
        self.give_token_back();
        answer
    }

    /// Takes the token for a single cycle.
    pub fn take_token(&self) {
        self.core.take();
    }

    /// Gives it back.
    pub fn give_token_back(&self) {
        self.core.give_back();
    }

    /// Sets the program's policy, which says which stage comes next while no module has the loop; without one, the stages
    /// follow one another.
    pub fn set_policy(&self, code: Option<Box<dyn LoopPolicy>>) {
        let guest = code.map(|code| Guest { what: POLICY, seat: None, code });
        self.exchange::<PolicyRole>(guest);
    }

    /// Sets who says what time it is, on a clock that is driven; without anybody, time goes on by the period. A module of
    /// `seat` is on the loop, and each call is watched like a step of its.
    pub fn set_time_source(&self, code: Option<Box<dyn TimeSource>>, seat: Option<Arc<Seat>>) {
        let guest = code.map(|code| Guest { what: TIME_SOURCE, seat, code });
        self.exchange::<TimeRole>(guest);
    }

    /// Sets what the loop waits for in lockstep at the end of each cycle; without it, cycles follow one another.
    pub fn set_wait(&self, wait: Option<CycleWait>) {
        let before = self.between_cycles(&[], move |shared| {
            // SAFETY: jobs are done by who has the token.
            Some(std::mem::replace(&mut unsafe { shared.core() }.wait, wait))
        });
        drop(before);
    }

    fn exchange<R: Role>(&self, guest: Option<Guest<R::Code>>)
    where
        Guest<R::Code>: Send + 'static,
    {
        let before = self.between_cycles(&[], move |shared| {
            // SAFETY: jobs are done by who has the token.
            Some(std::mem::replace(R::guest(unsafe { shared.core() }), guest))
        });
        drop(before);
    }
}
