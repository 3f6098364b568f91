use std::marker::PhantomData;

use slate_module::{
    Interface, Module, Outcome, Output, Params, Ports, Refusal, Setup, Spec, Stage, Tick, ports,
};

use crate::block::{BlockState, distinct, on};

/// Source of data. Only Sensors and Actuators differ between a simulated and a real robot.
pub trait Sensor: 'static {
    /// Kind in the configuration, in snake case.
    const NAME: &'static str;
    /// Description.
    const DOC: &'static str = "";
    /// Ports, such as the input of a simulator's output; `()` for a device.
    type Io: Ports;
    /// Parameters.
    type Params: Params;
    /// State; skip a connection to a device when it is saved.
    type State: BlockState;
    /// Measured value.
    type Value: Interface + Copy;

    /// Returns new data since the previous call, if any. Must not block.
    fn get_data(
        state: &mut Self::State,
        io: &Self::Io,
        params: &Self::Params,
        now: &Tick,
    ) -> Option<Self::Value>;
}

/// Additional ports of a Sensor.
#[ports]
pub struct SensorPorts<T: Interface> {
    /// Measurement of the sensor.
    value: Output<T>,
}

/// A [`Sensor`] as a module: run in every cycle, or when it has inputs, by them.
pub struct SensorBlock<S>(PhantomData<fn() -> S>);

impl<S: Sensor> Module for SensorBlock<S> {
    type Io = (S::Io, SensorPorts<S::Value>);
    type Params = S::Params;
    type State = S::State;

    const NAME: &'static str = S::NAME;
    const DOC: &'static str = S::DOC;
    const STAGE: Stage = Stage::SensorAcquire;

    fn spec() -> Spec {
        Spec { trigger: on(&S::Io::describe(), |_| true), deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, _: &S::Params) -> Result<S::State, Refusal> {
        distinct::<Self::Io>()?;
        Ok(S::State::default())
    }

    fn tick(state: &mut S::State, (io, own): &Self::Io, params: &S::Params, now: &Tick) -> Outcome {
        if let Some(value) = S::get_data(state, io, params, now) {
            own.value.set(value);
        }
        Outcome::Ok
    }
}
