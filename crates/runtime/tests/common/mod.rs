//! Modules and agents that the tests share.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]
#![allow(dead_code, reason = "each test uses a part of it")]

pub mod hanging;

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{self, Configuration};
use slate_runtime::{Agent, Options, Rate, StartError};

/// A number.
#[interface]
#[derive(PartialEq)]
pub struct Number {
    /// The number.
    pub value: f64,
}

/// Two numbers that belong together.
#[interface]
#[derive(PartialEq)]
pub struct Pair {
    /// The first.
    pub first: f64,
    /// The second.
    pub second: f64,
}

#[ports]
pub struct CounterIo {
    #[safe(Number { value: -1.0 })]
    number: Output<Number>,
}

/// Writes 1, 2, 3, ... and misbehaves when told.
pub struct Counter;

#[params]
pub struct CounterParams {
    #[param(default = 0, doc = "panics in that tick; 0 for never")]
    panic_at: u64,
    #[param(default = 0, doc = "writes a NaN in that tick")]
    nan_at: u64,
    #[param(default = 0, doc = "sleeps for hang_ms in that tick")]
    hang_at: u64,
    #[param(default = 0, doc = "milliseconds")]
    hang_ms: u64,
}

#[module(stage = SensorAcquire)]
impl Module for Counter {
    type Io = CounterIo;
    type Params = CounterParams;
    type State = f64;

    fn tick(state: &mut f64, io: &CounterIo, params: &CounterParams, now: &Tick) -> Outcome {
        *state += 1.0;
        if now.number() == params.hang_at {
            std::thread::sleep(std::time::Duration::from_millis(params.hang_ms));
        }
        if now.number() == params.panic_at {
            panic!("as the test wants");
        }
        let value = if now.number() == params.nan_at { f64::NAN } else { *state };
        io.number.set(Number { value });
        Outcome::Ok
    }
}

#[ports]
pub struct RelayIo {
    #[stale(after = "50ms")]
    input: Input<Number>,
    output: Output<Number>,
}

/// Passes a number on, plus one.
pub struct Relay;

#[module(stage = SensorProcess, on = input)]
impl Module for Relay {
    type Io = RelayIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &RelayIo, _: &(), _: &Tick) -> Outcome {
        io.output.set(Number { value: io.input.get().copied().unwrap_or_default().value + 1.0 });
        if io.input.is_stale() { Outcome::Degraded } else { Outcome::Ok }
    }
}

#[ports]
pub struct DriverIo {
    input: Input<Number>,
    wheel: Command<Number>,
}

/// Commands an actuator with what it reads.
pub struct Driver;

#[module(stage = Act)]
impl Module for Driver {
    type Io = DriverIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &DriverIo, _: &(), _: &Tick) -> Outcome {
        io.wheel.send(io.input.get().copied().unwrap_or_default(), Priority::Plan);
        Outcome::Ok
    }
}

#[ports]
pub struct TwinIo {
    left: Input<Pair>,
    right: Input<Pair>,
    mismatches: Output<Number>,
}

/// A module of two inputs of another interface.
pub struct Twin;

#[module(stage = Think)]
impl Module for Twin {
    type Io = TwinIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &TwinIo, _: &(), _: &Tick) -> Outcome {
        let [left, right] = [&io.left, &io.right].map(|pair| pair.get().copied().unwrap_or_default());
        if left.first != right.first {
            *state += 1.0;
        }
        io.mismatches.set(Number { value: *state });
        Outcome::Ok
    }
}

#[ports]
pub struct SenderIo {
    note: Outbox<Number>,
}

/// Sends a message a tick.
pub struct Sender;

#[module(stage = Think)]
impl Module for Sender {
    type Io = SenderIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &SenderIo, _: &(), _: &Tick) -> Outcome {
        *state += 1.0;
        io.note.send(Number { value: *state });
        Outcome::Ok
    }
}

#[ports]
pub struct ReceiverIo {
    notes: Inbox<Number>,
    history: Queue<Number>,
    sum: Output<Pair>,
}

/// Adds up the messages and the values of a queue.
pub struct Receiver;

#[module(stage = Act)]
impl Module for Receiver {
    type Io = ReceiverIo;
    type Params = ();
    type State = Pair2;

    fn tick(state: &mut Pair2, io: &ReceiverIo, _: &(), _: &Tick) -> Outcome {
        state.0 += io.notes.iter().map(|note| note.value).sum::<f64>();
        state.1 += io.history.iter().map(|value| value.value).sum::<f64>();
        io.sum.set(Pair { first: state.0, second: state.1 });
        Outcome::Ok
    }
}

/// The state of [`Receiver`].
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Pair2(f64, f64);

/// Draws random numbers.
pub struct Dice;

#[module(stage = SensorAcquire)]
impl Module for Dice {
    type Io = CounterIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &CounterIo, _: &(), now: &Tick) -> Outcome {
        io.number.set(Number { value: now.random(|random| random.normal()) });
        Outcome::Ok
    }
}

/// All of them.
pub fn plugins() -> Vec<Plugin> {
    vec![
        Plugin::linked::<Counter>(),
        Plugin::linked::<Relay>(),
        Plugin::linked::<Driver>(),
        Plugin::linked::<Twin>(),
        Plugin::linked::<Sender>(),
        Plugin::linked::<Receiver>(),
        Plugin::linked::<Dice>(),
        Plugin::linked::<hanging::Stumbler>(),
        Plugin::linked::<hanging::WheelWitness>(),
    ]
}

/// Reads a configuration.
pub fn configuration(text: &str) -> Configuration {
    Configuration::from_text("test.toml", text, &configuration::Options::default()).unwrap()
}

/// An agent with those plugins beside the common ones.
pub fn load(text: &str, more: &[Plugin], options: Options) -> Result<Agent, StartError> {
    let mut all = plugins();
    all.extend_from_slice(more);
    Agent::load(&configuration(text), &all, options)
}

/// An agent in lockstep, as fast as it goes.
pub fn lockstep(text: &str) -> Agent {
    try_lockstep(text).unwrap()
}

/// As [`lockstep`], with what is wrong.
pub fn try_lockstep(text: &str) -> Result<Agent, StartError> {
    // Any module can drive the clock.
    let first = text.split("[modules.").nth(1).and_then(|rest| rest.split(']').next()).unwrap_or("counter");
    let text = format!("time.source = \"{first}\"\n{text}");
    Agent::load(
        &configuration(&text),
        &plugins(),
        Options { rate: Rate::Max, armed: true, ..Options::default() },
    )
}

/// The message of an agent that does not start.
pub fn complaint(text: &str) -> String {
    match try_lockstep(text) {
        Ok(_) => panic!("it should not start"),
        Err(StartError::Configuration(report)) => report.to_string(),
        Err(other) => other.to_string(),
    }
}

/// A number on the blackboard.
pub fn number(agent: &Agent, path: &str) -> f64 {
    let (value, _) = agent.board().read(path).unwrap().unwrap();
    value.as_f64().unwrap()
}
