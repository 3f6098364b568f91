use std::marker::PhantomData;

use slate_module::{
    Interface, Module, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick, Trigger, ports,
};

use crate::block::{BlockState, RENEWAL, distinct};
use crate::port::Commanded;

/// Device that acts on the world. Only Sensors and Actuators differ between a simulated and a real robot.
pub trait Actuator: 'static {
    /// Kind in the configuration, in snake case.
    const NAME: &'static str;
    /// Description.
    const DOC: &'static str = "";
    /// Further ports; `()` for a device.
    type Io: Ports;
    /// Parameters.
    type Params: Params;
    /// State; skip a connection to a device when it is saved.
    type State: BlockState;
    /// Command.
    type Command: Interface + Copy;
    /// Safe command, without a valid command, such as zero velocity.
    const SAFE: Self::Command;

    /// Applies a command that has passed the gate: within limits, or the safe command. Must not block.
    fn apply(
        state: &mut Self::State,
        command: &Self::Command,
        io: &Self::Io,
        params: &Self::Params,
        now: &Tick,
    ) -> Outcome;
}

/// Additional ports of an Actuator.
#[ports]
pub struct ActuatorPorts<T: Interface> {
    /// Command from the gate.
    #[stale(after = "100ms")]
    command: Commanded<T>,
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
        match own.command.0.fresh() {
            Some(command) => A::apply(state, command, io, params, now),
            None => match A::apply(state, &A::SAFE, io, params, now) {
                Outcome::Ok => Outcome::Degraded,
                outcome => outcome,
            },
        }
    }
}
