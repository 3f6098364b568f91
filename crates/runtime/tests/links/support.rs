//! Modules and agents of these tests.

use std::sync::Mutex;
use std::time::Duration;

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::{Agent, Mode, Options, Rate};
use slate_sorted::SortedSet;

use crate::links::common::{Number, Pair, plugins};

/// Ports of [`Twins`].
#[ports]
pub struct TwinsIo {
    one: Output<Pair>,
    two: Output<Pair>,
    number: Output<Number>,
}

/// Parameters of [`Twins`].
#[params]
pub struct TwinsParams {
    #[param(default = 0.0, doc = "added to what is written")]
    offset: f64,
}

/// Writes two pairs of four equal numbers.
pub struct Twins;

#[module(stage = SensorAcquire)]
impl Module for Twins {
    type Io = TwinsIo;
    type Params = TwinsParams;
    type State = f64;

    fn tick(count: &mut f64, io: &TwinsIo, params: &TwinsParams, _: &Tick) -> Outcome {
        *count += 1.0;
        let number = *count + params.offset;
        io.one.set(Pair { first: number, second: number });
        io.two.set(Pair { first: number, second: number });
        io.number.set(Number { value: number });
        Outcome::Ok
    }
}

/// Ports of [`Judge`].
#[ports]
pub struct JudgeIo {
    left: Input<Pair>,
    right: Input<Pair>,
    seen: Output<Pair>,
    torn: Output<Number>,
}

/// Counts the ticks that saw numbers which do not belong together.
pub struct Judge;

#[module(stage = Think)]
impl Module for Judge {
    type Io = JudgeIo;
    type Params = ();
    type State = f64;

    fn tick(torn: &mut f64, io: &JudgeIo, _: &(), _: &Tick) -> Outcome {
        let [left, right] = [&io.left, &io.right].map(|pair| pair.get().copied().unwrap_or_default());
        if left.first != left.second || left != right {
            *torn += 1.0;
        }
        io.seen.set(Pair { first: left.first, second: right.first });
        io.torn.set(Number { value: *torn });
        Outcome::Ok
    }
}

/// Ports of [`Collector`].
#[ports]
pub struct CollectorIo {
    numbers: Queue<Number>,
    count: Output<Number>,
    sum: Output<Number>,
}

/// Adds up what comes.
pub struct Collector;

#[module(stage = Act)]
impl Module for Collector {
    type Io = CollectorIo;
    type Params = ();
    type State = (f64, f64);

    fn tick(state: &mut (f64, f64), io: &CollectorIo, _: &(), _: &Tick) -> Outcome {
        state.0 += io.numbers.iter().count() as f64;
        state.1 += io.numbers.iter().map(|number| number.value).sum::<f64>();
        io.count.set(Number { value: state.0 });
        io.sum.set(Number { value: state.1 });
        Outcome::Ok
    }
}

/// How a module is, as its property `state` says it.
#[interface]
pub struct ModuleState {
    /// Ticks made until then.
    pub ticks: u64,
    /// Panics caught until then.
    pub panics: u64,
    /// How it is.
    pub condition: ModuleCondition,
    /// The port that it waits for.
    pub waiting_for: Text<56>,
}

/// The condition of a module.
#[interface]
pub enum ModuleCondition {
    /// Not enabled.
    Inactive,
    /// As intended.
    Working,
    /// With less than it wants.
    Degraded,
    /// It could not do its work in its last tick.
    Failed,
    /// Its tick has not returned in time.
    Late,
    /// It panicked too often, or could not be made anew.
    Faulted,
    /// Its plugin is not loaded.
    Unloaded,
    /// A service that it needs is not provided.
    Waiting,
}

/// Ports of [`Watcher`].
#[ports]
pub struct WatcherIo {
    states: Queue<ModuleState>,
    count: Output<Number>,
}

/// Counts the states of a module.
pub struct Watcher;

#[module(stage = Act)]
impl Module for Watcher {
    type Io = WatcherIo;
    type Params = ();
    type State = f64;

    fn tick(count: &mut f64, io: &WatcherIo, _: &(), _: &Tick) -> Outcome {
        *count += io.states.iter().count() as f64;
        io.count.set(Number { value: *count });
        Outcome::Ok
    }
}

/// Modules that do not return from their steps while they are among these.
static HELD: Mutex<SortedSet<u64>> = Mutex::new(SortedSet::new());

/// Holds modules of that number, or lets them go.
pub fn hold(number: u64, held: bool) {
    let mut all = HELD.lock().unwrap();
    let _ = if held { all.insert(number) } else { all.remove(&number) };
}

/// Ports of [`Held`].
#[ports]
pub struct HeldIo {
    number: Input<Number>,
    pair: Input<Pair>,
    seen: Output<Number>,
}

/// Parameters of [`Held`].
#[params]
pub struct HeldParams {
    #[param(default = 0, doc = "what it is held by")]
    hold: u64,
    #[param(default = 1.0, doc = "what is seen is multiplied by it")]
    factor: f64,
}

/// Shows its input, and hangs when it is held.
pub struct Held;

#[module(stage = Act)]
impl Module for Held {
    type Io = HeldIo;
    type Params = HeldParams;
    type State = ();

    fn tick(_: &mut (), io: &HeldIo, params: &HeldParams, _: &Tick) -> Outcome {
        while HELD.lock().unwrap().contains(&params.hold) {
            std::thread::sleep(Duration::from_millis(1));
        }
        let (number, pair) =
            (io.number.get().copied().unwrap_or_default(), io.pair.get().copied().unwrap_or_default());
        io.seen.set(Number { value: params.factor * (number.value + pair.second) });
        Outcome::Ok
    }
}

/// All kinds.
pub fn all() -> Vec<Plugin> {
    let own = [
        Plugin::linked::<Twins>(),
        Plugin::linked::<Judge>(),
        Plugin::linked::<Collector>(),
        Plugin::linked::<Held>(),
        Plugin::linked::<Watcher>(),
    ];
    plugins().into_iter().chain(own).collect()
}

/// An agent that follows a configuration.
pub fn agent(text: &str, mode: Mode) -> Agent {
    let database = Database::from_text("test.toml", text, Reading::default()).unwrap();
    let rate = if mode == Mode::Staged { Rate::Max } else { Rate::REALTIME };
    Agent::load_with(&database, &all(), Options { mode, rate, armed: true, ..Options::default() }).unwrap()
}

/// An agent in lockstep, whose clock is the first module.
pub fn lockstep(text: &str) -> Agent {
    let first = text.split("[modules.").nth(1).and_then(|rest| rest.split(']').next()).unwrap();
    agent(&format!("time.source = \"{first}\"\n{text}"), Mode::Staged)
}

/// Makes so many cycles.
pub fn steps(agent: &mut Agent, count: u64) {
    for _ in 0..count {
        assert!(agent.step());
    }
}
