//! An agent with a bit of everything.

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{self, Database};
use slate_runtime::{Agent, Options, Rate};

use crate::agents::Number;

/// Its configuration.
pub const TEXT: &str = r#"
agent.name = "robot"
time.source = "counter"
[modules.counter]
[modules.relay]
[links]
"relay/input" = "counter/number"
"relay/all" = "counter/number"
[actuators.wheel]
command = "relay/wheel"
"#;

#[ports]
struct CounterIo {
    number: Output<Number>,
}

#[params]
struct CounterParams {
    #[param(default = 1, range = 0..=9, doc = "how far it counts at once")]
    step: u64,
}

/// Counts.
struct Counter;

#[module(stage = SensorAcquire)]
impl Module for Counter {
    type Io = CounterIo;
    type Params = CounterParams;
    type State = u64;

    fn tick(state: &mut u64, io: &CounterIo, params: &CounterParams, _: &Tick) -> Outcome {
        *state = state.wrapping_add(params.step);
        io.number.set(Number { value: *state });
        Outcome::Ok
    }
}

#[ports]
struct RelayIo {
    input: Input<Number>,
    all: Queue<Number>,
    output: Output<Number>,
    wheel: Command<Number>,
}

/// Repeats.
struct Relay;

#[module(stage = Act)]
impl Module for Relay {
    type Io = RelayIo;
    type Params = ();
    type State = Vec<u64>;

    fn tick(state: &mut Vec<u64>, io: &RelayIo, (): &(), _: &Tick) -> Outcome {
        state.clear();
        state.extend(io.all.iter().map(|number| number.value));
        let input = io.input.get().copied().unwrap_or_default();
        io.output.set(Number { value: input.value });
        io.wheel.send(Number { value: input.value }, Priority::Plan);
        Outcome::Ok
    }
}

/// The agent, after a few cycles.
///
/// # Panics
/// When it can't be made.
pub fn robot() -> Agent {
    let database =
        Database::from_text("robot.toml", TEXT, configuration::Options::default()).expect("it is right");
    let plugins = [Plugin::linked::<Counter>(), Plugin::linked::<Relay>()];
    let options = Options { rate: Rate::Max, armed: true, ..Options::default() };
    let mut agent = Agent::load_with(&database, &plugins, options).expect("it is right");
    (0..5).for_each(|_| assert!(agent.step(), "it goes on"));
    agent
}
