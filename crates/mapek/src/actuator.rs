use std::marker::PhantomData;

use slate_module::{
    Input, Interface, Module, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick, Trigger, ports,
};

use crate::block::{BlockState, RENEWAL, distinct};

/// A device that acts on the world. Sensors and Actuators are what differs between a simulated and a real robot;
/// nothing else does.
pub trait Actuator: 'static {
    /// The name by which configuration finds it, in snake case.
    const NAME: &'static str;
    /// What it does.
    const DOC: &'static str = "";
    /// What else it reads and writes; nothing for one that only drives a device.
    type Io: Ports;
    /// What users may tune.
    type Params: Params;
    /// What it remembers; a connection to a device is skipped when it is saved.
    type State: BlockState;
    /// What it is told.
    type Command: Interface + Copy;
    /// What it does without a fresh command, such as standing still.
    const SAFE: Self::Command;

    /// Does what is commanded. The command has passed the gate: it is within limits, and the safe one if nobody
    /// commands. It must not wait.
    fn apply(
        state: &mut Self::State,
        command: &Self::Command,
        io: &Self::Io,
        params: &Self::Params,
        now: &Tick,
    ) -> Outcome;
}

/// What the framework adds to an Actuator's ports.
#[ports]
pub struct ActuatorPorts<T: Interface> {
    /// What passed the gate.
    #[stale(after = "100ms")]
    command: Input<T>,
}

/// An [`Actuator`] as a module.
pub struct ActuatorBlock<A>(PhantomData<fn() -> A>);

impl<A: Actuator> Module for ActuatorBlock<A> {
    type Io = (A::Io, ActuatorPorts<A::Command>);
    type Params = A::Params;
    type State = A::State;

    const NAME: &'static str = A::NAME;
    const DOC: &'static str = A::DOC;
    const STAGE: Stage = Stage::ActExec;

    fn spec() -> Spec {
        let trigger = Trigger::On { ports: vec!["command".into()], timeout: Some(RENEWAL) };
        Spec { trigger, deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, _: &A::Params) -> Result<A::State, Refusal> {
        distinct::<Self::Io>()?;
        Ok(A::State::default())
    }

    fn tick(state: &mut A::State, (io, own): &Self::Io, params: &A::Params, now: &Tick) -> Outcome {
        match own.command.fresh() {
            Some(command) => A::apply(state, command, io, params, now),
            None => match A::apply(state, &A::SAFE, io, params, now) {
                Outcome::Ok => Outcome::Degraded,
                outcome => outcome,
            },
        }
    }
}
