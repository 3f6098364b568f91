use std::marker::PhantomData;

use slate_module::{
    Interface, Module, Outcome, Output, Params, Ports, Refusal, Setup, Spec, Stage, Tick, ports,
};

use crate::block::{BlockState, distinct, on};

/// A source of data. Sensors and Actuators are what differs between a simulated and a real robot; nothing else does.
pub trait Sensor: 'static {
    /// The name by which configuration finds it, in snake case.
    const NAME: &'static str;
    /// What it does.
    const DOC: &'static str = "";
    /// What it reads, such as a simulator's output; nothing for one that asks a device.
    type Io: Ports;
    /// What users may tune.
    type Params: Params;
    /// What it remembers; a connection to a device is skipped when it is saved.
    type State: BlockState;
    /// What it measures.
    type Value: Interface + Copy;

    /// The newest data; nothing if there is none since the last call. It must not wait.
    fn get_data(
        state: &mut Self::State,
        io: &Self::Io,
        params: &Self::Params,
        now: &Tick,
    ) -> Option<Self::Value>;
}

/// What the framework adds to a Sensor's ports.
#[ports]
pub struct SensorPorts<T: Interface> {
    /// What the sensor measures.
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
