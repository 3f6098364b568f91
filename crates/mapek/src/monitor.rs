use std::marker::PhantomData;

use slate_module::{Interface, Module, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick, ports};

use crate::block::{BlockState, distinct, on};
use crate::port::Percept;

/// Organises and interprets the data of sensors and forwards them to Analyzes (RoCS, 4.2). It is woken by its sensors.
pub trait Monitor: 'static {
    /// The name by which configuration finds it, in snake case.
    const NAME: &'static str;
    /// What it does.
    const DOC: &'static str = "";
    /// The sensors it watches.
    type Sensors: Ports;
    /// What users may tune.
    type Params: Params;
    /// What it remembers.
    type State: BlockState;
    /// What it publishes.
    type Value: Interface + Copy;

    /// Interprets the sensors' data; what it returns is published.
    fn interpret(
        state: &mut Self::State,
        sensors: &Self::Sensors,
        params: &Self::Params,
        now: &Tick,
    ) -> Option<Self::Value>;
}

/// What the framework adds to a Monitor's ports.
#[ports]
pub struct MonitorPorts<T: Interface> {
    /// What the Monitor makes of its sensors.
    percept: Percept<T>,
}

/// A [`Monitor`] as a module.
pub struct MonitorBlock<M>(PhantomData<fn() -> M>);

impl<M: Monitor> Module for MonitorBlock<M> {
    type Io = (M::Sensors, MonitorPorts<M::Value>);
    type Params = M::Params;
    type State = M::State;

    const NAME: &'static str = M::NAME;
    const DOC: &'static str = M::DOC;
    const STAGE: Stage = Stage::SensorProcess;

    fn spec() -> Spec {
        Spec { trigger: on(&M::Sensors::describe(), |_| true), deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, _: &M::Params) -> Result<M::State, Refusal> {
        distinct::<Self::Io>()?;
        Ok(M::State::default())
    }

    fn tick(state: &mut M::State, (sensors, own): &Self::Io, params: &M::Params, now: &Tick) -> Outcome {
        if let Some(value) = M::interpret(state, sensors, params, now) {
            own.percept.0.set(value);
        }
        Outcome::Ok
    }
}
