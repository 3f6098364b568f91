//! Agents with modules that count, read and witness.

use crate::agents;

use std::sync::Arc;
use std::thread::JoinHandle;

use agents::wait_for;
use slate_blackboard::Board;
use slate_blackboard::interface::Value;
use slate_mapek::{Actuator, actuator};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::{Agent, Composer, Control, Mode, Options, Rate, StartError, Stopper};
use slate_share::agent::AgentSharing;
use slate_share::carrier::local::Local;

/// A number.
#[interface]
#[derive(PartialEq)]
pub struct Number {
    /// The number.
    pub value: f64,
}

/// Two numbers.
#[interface]
pub struct Both {
    /// The first.
    pub first: f64,
    /// The second.
    pub second: f64,
}

/// Ports of [`Counter`].
#[ports]
pub struct CounterIo {
    number: Output<Number>,
    notes: Inbox<Number>,
    sum: Output<Number>,
    both: Output<Both>,
}

/// Counts its ticks, and adds up the messages that it gets.
pub struct Counter;

#[module(stage = SensorAcquire)]
impl Module for Counter {
    type Io = CounterIo;
    type Params = ();
    type State = (f64, f64);

    fn tick(state: &mut (f64, f64), io: &CounterIo, _: &(), _: &Tick) -> Outcome {
        state.0 += 1.0;
        state.1 += io.notes.iter().map(|note| note.value).sum::<f64>();
        io.number.set(Number { value: state.0 });
        io.sum.set(Number { value: state.1 });
        io.both.set(Both { first: state.0, second: state.0 });
        Outcome::Ok
    }
}

/// Ports of [`Reader`].
#[ports]
pub struct ReaderIo {
    number: Input<Number>,
    all: Queue<Number>,
    other: Input<Number>,
    changes: Output<Number>,
    note: Outbox<Number>,
    fresh: Output<Number>,
    gaps: Output<Number>,
    last: Output<Number>,
}

/// Says whether its input is fresh, counts the gaps in its queue and says what came of it last, counts the changes of its
/// other input, and sends the numbers from 1 to 10.
pub struct Reader;

#[module(stage = Act)]
impl Module for Reader {
    type Io = ReaderIo;
    type Params = ();
    type State = (f64, f64, u32, f64, f64);

    fn tick(state: &mut (f64, f64, u32, f64, f64), io: &ReaderIo, _: &(), _: &Tick) -> Outcome {
        let fresh = io.number.fresh().map_or(0.0, |number| number.value);
        io.fresh.set(Number { value: fresh });
        for number in io.all.iter() {
            if state.0 != 0.0 && number.value != state.0 + 1.0 {
                state.1 += 1.0;
            }
            state.0 = number.value;
        }
        io.gaps.set(Number { value: if state.0 == 0.0 { -1.0 } else { state.1 } });
        io.last.set(Number { value: state.0 });
        if io.other.get().copied().unwrap_or_default().value != state.3 {
            (state.3, state.4) = (io.other.get().copied().unwrap_or_default().value, state.4 + 1.0);
        }
        io.changes.set(Number { value: state.4 });
        if fresh > 0.0 && state.2 < 10 {
            state.2 += 1;
            io.note.send(Number { value: f64::from(state.2) });
        }
        Outcome::Ok
    }
}

/// Ports of [`Witness`].
#[ports]
pub struct WitnessIo {
    #[role("truth")]
    truth: Output<Number>,
}

/// Knows the truth.
pub struct Witness;

#[module(stage = SensorAcquire)]
impl Module for Witness {
    type Io = WitnessIo;
    type Params = ();
    type State = ();

    fn tick((): &mut (), io: &WitnessIo, (): &(), _: &Tick) -> Outcome {
        io.truth.set(Number { value: 7.0 });
        Outcome::Ok
    }
}

/// Ports of [`Judge`].
#[ports]
pub struct JudgeIo {
    #[role("truth")]
    truth: Input<Number>,
    heard: Output<Number>,
}

/// May read it.
pub struct Judge;

#[module(stage = Act)]
impl Module for Judge {
    type Io = JudgeIo;
    type Params = ();
    type State = ();

    fn tick((): &mut (), io: &JudgeIo, (): &(), _: &Tick) -> Outcome {
        io.heard.set(io.truth.get().copied().unwrap_or_default());
        Outcome::Ok
    }
}

/// Ports of [`Helm`].
#[ports]
pub struct HelmIo {
    #[safe(Number { value: 0.0 })]
    course: Command<Number>,
}

/// Commands an actuator.
pub struct Helm;

#[module(stage = Act)]
impl Module for Helm {
    type Io = HelmIo;
    type Params = ();
    type State = ();

    fn tick((): &mut (), io: &HelmIo, (): &(), _: &Tick) -> Outcome {
        io.course.send(Number { value: 5.0 }, Priority::Plan);
        Outcome::Ok
    }
}

/// Ports of [`Rudder`].
#[ports]
pub struct RudderIo {
    moved: Output<Number>,
}

/// Shows the last command that it has applied.
pub struct Rudder;

impl Actuator for Rudder {
    const NAME: &'static str = "rudder";
    type Io = RudderIo;
    type Params = ();
    type State = ();
    type Command = Number;
    const SAFE: Number = Number { value: -1.0 };

    fn apply((): &mut (), command: &Number, io: &RudderIo, (): &(), _: &Tick) -> Outcome {
        io.moved.set(*command);
        Outcome::Ok
    }
}

/// An agent that runs until this is dropped.
pub struct Running {
    pub board: Arc<Board>,
    pub composer: Composer,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

pub fn load(name: &str, text: &str, mode: Mode) -> Agent {
    try_load(name, text, mode).unwrap()
}

pub fn try_load(name: &str, text: &str, mode: Mode) -> Result<Agent, StartError> {
    let database = Database::from_text(&format!("{name}.toml"), text, Reading::default()).unwrap();
    let plugins = [
        Plugin::linked::<Counter>(),
        Plugin::linked::<Reader>(),
        Plugin::linked::<Witness>(),
        Plugin::linked::<Judge>(),
        Plugin::linked::<Helm>(),
        actuator::<Rudder>().into(),
    ];
    let mut sharing = AgentSharing::default();
    sharing.limits = agents::limits();
    sharing.carriers.insert("other".into(), Arc::new(Local));
    let options =
        Options { mode, rate: Rate::REALTIME, sharing: Some(Box::new(sharing)), ..Options::default() };
    Agent::load_with(&database, &plugins, options)
}

impl Running {
    pub fn start(name: &str, text: &str, mode: Mode) -> Self {
        Self::run(load(name, text, mode))
    }

    pub fn run(mut agent: Agent) -> Self {
        let (board, composer, stopper) = (Arc::clone(agent.board()), agent.composer(), agent.stopper());
        let thread = std::thread::spawn(move || {
            agent.run(Box::new(|_| Control::Continue)).unwrap();
        });
        Self { board, composer, stopper, thread: Some(thread) }
    }

    pub fn number(&self, path: &str) -> f64 {
        let read = self.board.read(&format!("{path}/value")).ok().flatten();
        match read {
            Some((Value::Float(value), _)) => value,
            _ => 0.0,
        }
    }

    /// Its queue misses nothing. (A busy machine may cost some values before, as the output keeps one.)
    pub fn hears_all(&self) {
        let look = || (self.number("reader/gaps"), self.number("reader/last"));
        let mut before = look();
        wait_for("values without a gap", || {
            let now = look();
            if now.0 != before.0 {
                before = now;
            }
            now.0 >= 0.0 && now.1 >= before.1 + 10.0
        });
    }

    pub fn trouble(&self, to: &str) -> Option<String> {
        self.composer.links().into_iter().find(|link| link.to == to).unwrap().trouble
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stopper.stop();
        self.thread.take().map(JoinHandle::join);
    }
}
