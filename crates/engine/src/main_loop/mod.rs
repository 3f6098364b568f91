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
mod jobs;
mod notices;
mod pace;
mod plan;
mod playing;
mod policy;
mod seat;
mod takeover;
mod threads;
mod tracing;
mod watchdog;
mod workers;

use std::cell::UnsafeCell;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};

use slate_blackboard::Board;

use crate::actuators::Actuator;
use crate::clock::{Clock, TimeSource};
use crate::digest::Digest;
use crate::log::Logger;
use crate::synchronization::{Emitter, Synchronization};

pub use cycle::cycle;
pub use driving::drive;
pub use frozen::FrozenLoop;
pub use gauges::Publication;
pub use pace::Pace;
pub use pace::Rate;
pub use plan::Levels;
pub use playing::{PlayedCondition, Playing};
pub use policy::{LoopPolicy, Place, STAGE_LIMIT};
pub use seat::Seat;
pub use slate_composition::own::LoopState;
pub use slate_configuration::Schedule;
pub use takeover::{Takeover, Takeovers};
pub use threads::ModuleThreads;
pub use tracing::AgentTrace;
pub use watchdog::{Watch, Watchdog};
pub use workers::Workers;

use cycle::Position;
use driving::Ending;
use gauges::{LoopGauges, Publisher};
use guest::{Absent, Guest, Role};
use handover::Course;
use jobs::{Jobs, Token};
use notices::Notices;
use plan::{Parts, Plan};
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
}

/// What is called between two cycles with the agent's time; [`Flow::Lost`] when it lost the token.
pub type AfterCycle = Box<dyn Fn(&Shared, u64) -> Flow + Send + Sync>;

/// What sends to other agents what was written; it is called after each tick that wrote something.
pub type AfterTick = Box<dyn Fn() + Send + Sync>;

/// Changes of the configuration that modules ask for in their ticks.
pub trait AskedChanges: Send + Sync {
    /// Whether something is to be changed; a look costs a load.
    fn is_asked(&self) -> bool;

    /// Makes the changes that were asked for. The loop's token must be free.
    fn carry_out(&self);
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
    course: Course,
    /// The gates.
    pub actuators: Vec<Arc<Actuator>>,
    /// The fingerprint of what was written; none on the wall clock.
    pub digest: Option<Digest>,
    pace: Pace,
    /// What the application does at the end of a cycle.
    pub observer: Option<Observer>,
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

/// Who says which stage comes next, of the program.
struct PolicyRole;

impl Role for PolicyRole {
    type Code = dyn LoopPolicy;

    fn guest(core: &mut Core) -> &mut Option<Guest<dyn LoopPolicy>> {
        &mut core.policy
    }
}

/// The module that may take the loop.
struct TakeoverRole;

impl Role for TakeoverRole {
    type Code = Arc<Takeover>;

    fn guest(core: &mut Core) -> &mut Option<Guest<Arc<Takeover>>> {
        &mut core.takeover
    }

    /// It stays: while its module is late it is not asked, and that ends what it has taken.
    fn put_away(_: &mut Core) -> &'static str {
        TAKEOVER
    }
}

/// Who says what time it is.
struct TimeRole;

impl Role for TimeRole {
    type Code = dyn TimeSource;

    fn guest(core: &mut Core) -> &mut Option<Guest<dyn TimeSource>> {
        &mut core.time_source
    }
}

/// The loop as all threads see it.
pub struct Shared {
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
    core: UnsafeCell<Core>,
    token: Token,
    jobs: Jobs,
    run: Run,
    members: Members,
    timeouts: Timeouts,
    measures: Measures,
    /// What is called at certain moments.
    pub hooks: Hooks,
    /// Whether a recording is played.
    is_playing: AtomicBool,
}

/// The run that goes on, and how it ends.
struct Run {
    /// Its number; 0 for none.
    running: AtomicU64,
    ending: Mutex<Ending>,
    changed: Condvar,
}

/// What the loop runs, for those who change it.
struct Members {
    /// Whoever makes plans has it until they are exchanged.
    planning: Mutex<()>,
    parts: Mutex<Parts>,
    watched: Mutex<Arc<[Watch]>>,
    /// For a stop, which waits for nothing else.
    gates: Mutex<Arc<[Arc<Actuator>]>>,
    threads: Mutex<ModuleThreads>,
}

/// How long stages may take.
struct Timeouts {
    /// When the time of the present stage is up, monotonic; 0 for never.
    deadline: AtomicU64,
    /// The shortest time-out of a stage, nanoseconds.
    shortest_timeout: AtomicU64,
}

/// What is measured and told of the loop.
struct Measures {
    gauges: LoopGauges,
    publisher: Mutex<Publisher>,
    cycle_start: Option<Emitter>,
    cycle_end: Option<Emitter>,
}

/// What others have called at certain moments; the first one of each stays.
#[derive(Default)]
pub struct Hooks {
    /// Looks at the end of each cycle whether there is something to do between two of them.
    after_cycle: OnceLock<AfterCycle>,
    /// What changes the configuration for modules.
    changes: OnceLock<Arc<dyn AskedChanges>>,
    /// What sends to other agents what was written.
    pub after_tick: Arc<OnceLock<AfterTick>>,
}

// SAFETY: the core is used only by the thread that holds the token, and the track of the loop too.
unsafe impl Sync for Shared {}

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

impl Shared {
    /// A loop without modules.
    pub fn new(parameters: Parameters) -> Self {
        let Parameters { board, clock, logger, period, lockstep, schedule, workers, pace, time_source } =
            parameters;
        let synchronization = Arc::new(Synchronization::default());
        let core = Core {
            plan: Plan::default(),
            aside: Plan::default(),
            course: Course::default(),
            actuators: Vec::new(),
            digest: lockstep.then(Digest::default),
            pace,
            observer: None,
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
        };
        let emitter = |name| synchronization.emitter(name, "main loop").ok();
        Self {
            measures: Measures {
                gauges: LoopGauges::default(),
                publisher: Mutex::new(Publisher::new(&board)),
                cycle_start: emitter("/cycle/start"),
                cycle_end: emitter("/cycle/end"),
            },
            board,
            clock,
            logger,
            synchronization,
            tracing: Tracing::default(),
            period,
            lockstep,
            core: UnsafeCell::new(core),
            token: Token::default(),
            jobs: Jobs::default(),
            run: Run { running: AtomicU64::new(0), ending: Mutex::default(), changed: Condvar::new() },
            members: Members {
                planning: Mutex::default(),
                parts: Mutex::new(Parts { schedule, ..Parts::default() }),
                watched: Mutex::new(Arc::from([])),
                gates: Mutex::new(Arc::from([])),
                threads: Mutex::default(),
            },
            timeouts: Timeouts { deadline: AtomicU64::new(0), shortest_timeout: AtomicU64::new(u64::MAX) },
            hooks: Hooks::default(),
            is_playing: AtomicBool::new(false),
        }
    }

    /// Says that values were written.
    pub fn wrote(&self) {
        if let Some(call) = self.hooks.after_tick.get() {
            call();
        }
    }

    /// The core.
    ///
    /// # Safety
    /// The caller holds the token, or nobody does.
    #[allow(clippy::mut_from_ref, reason = "the token grants the access")]
    pub unsafe fn core(&self) -> &mut Core {
        // SAFETY: passed on to the caller.
        unsafe { &mut *self.core.get() }
    }

    /// The modules that the watchdog watches.
    pub fn watched(&self) -> Arc<[Watch]> {
        Arc::clone(&self.members.watched.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The gates.
    pub fn actuators(&self) -> Arc<[Arc<Actuator>]> {
        Arc::clone(&self.members.gates.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The threads of modules.
    pub fn threads(&self) -> MutexGuard<'_, ModuleThreads> {
        self.members.threads.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Cycles begun.
    pub fn cycles(&self) -> u64 {
        self.measures.gauges.cycles.load(Ordering::Relaxed)
    }

    /// The stages and the modules of each.
    pub fn order(&self) -> Vec<(String, Vec<String>)> {
        self.parts().order()
    }

    fn parts(&self) -> MutexGuard<'_, Parts> {
        self.members.parts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Has this called at the end of each cycle with the agent's time, by who has the token. Only the first one counts.
    pub fn watch_cycles(&self, look: AfterCycle) {
        // An agent sets it when it is loaded.
        let _ = self.hooks.after_cycle.set(look);
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
        self.token.take();
    }

    /// Gives it back.
    pub fn give_token_back(&self) {
        self.token.give_back();
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

/// What the log calls them.
const POLICY: &str = "the policy of the main loop";
const TAKEOVER: &str = "the policy of a module";
const TIME_SOURCE: &str = "the time source";
