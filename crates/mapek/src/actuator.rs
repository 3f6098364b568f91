use std::marker::PhantomData;

use serde::{Deserialize, Serialize};
use slate_interfaces::{GateMode, GateState};
use slate_module::{
    Input, Interface, Module, Outcome, Output, Params, Ports, Refusal, Setup, Spec, Stage, Tick, Trigger,
    ports,
};

use crate::block::{BlockState, RENEWAL, distinct};
use crate::knowledge::{ActuatorStatus, DeviceHealth};
use crate::port::Commanded;

/// Device that acts on the world.
/// Only Sensors and Actuators differ between a simulated and a real robot.
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

    /// Applies a command that has passed the gate.
    /// It is within limits, or the safe command. Must not block.
    ///
    /// While the device does not obey, such as without a connection, return `Degraded` or `Failed`: the RobotModel then has
    /// it as [`FAILED`](crate::DeviceHealth::FAILED).
    fn apply(
        state: &mut Self::State,
        command: &Self::Command,
        io: &Self::Io,
        params: &Self::Params,
        now: &Tick,
    ) -> Outcome;
}

/// Status from the gate, the gate's command, and the device's outcome.
fn status_of(gate: Option<&GateState>, is_commanded: bool, applied: Outcome) -> ActuatorStatus {
    let is_active = gate.map_or(is_commanded, |gate| is_commanded && gate.age.get().is_some());
    let health = match gate.map_or(GateMode::ARMED, |gate| gate.mode) {
        _ if applied != Outcome::Ok => DeviceHealth::FAILED,
        GateMode::STOPPED => DeviceHealth::STOPPED,
        GateMode::DISARMED => DeviceHealth::DISARMED,
        _ if is_active => DeviceHealth::READY,
        _ => DeviceHealth::SAFE,
    };
    ActuatorStatus { health }
}

/// Additional ports of an Actuator.
#[ports]
pub struct ActuatorPorts<T: Interface> {
    /// Command from the gate.
    #[stale(after = "100ms")]
    command: Commanded<T>,
    /// State of the gate.
    #[role("gate_state")]
    gate: Input<GateState>,
    /// Health, for the RobotModel.
    #[role("actuator_status")]
    #[safe(ActuatorStatus::FAILED)]
    status: Output<ActuatorStatus>,
}

/// State of an [`ActuatorBlock`].
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct ActuatorBlockState<S: BlockState> {
    device: S,
    /// Health that was reported last.
    reported: u8,
}

/// An [`Actuator`] as a module.
pub struct ActuatorBlock<A>(PhantomData<fn() -> A>);

impl<A: Actuator> Module for ActuatorBlock<A> {
    type Io = (A::Io, ActuatorPorts<A::Command>);
    type Params = A::Params;
    type State = ActuatorBlockState<A::State>;

    const NAME: &'static str = A::NAME;
    const DOC: &'static str = A::DOC;
    const STAGE: Stage = Stage::ActExec;

    fn spec() -> Spec {
        let trigger = Trigger::On { ports: vec!["command".into()], timeout: Some(RENEWAL) };
        Spec { trigger, deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, _: &A::Params) -> Result<Self::State, Refusal> {
        distinct(&Self::Io::describe())?;
        Ok(Self::State::default())
    }

    fn tick(state: &mut Self::State, (io, own): &Self::Io, params: &A::Params, now: &Tick) -> Outcome {
        let command = own.command.0.fresh();
        let applied = A::apply(&mut state.device, command.unwrap_or(&A::SAFE), io, params, now);
        let status = status_of(own.gate.get(), command.is_some(), applied);
        if status.health.0 != state.reported {
            state.reported = status.health.0;
            own.status.set(status);
        }
        match applied {
            Outcome::Ok if command.is_none() => Outcome::Degraded,
            outcome => outcome,
        }
    }
}
