use std::marker::PhantomData;

use slate_module::{Interface, Module, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick, ports};

use crate::block::{BlockState, distinct, on};
use crate::port::Percept;

/// Interprets the data of sensors for Analyzes (RoCS, 4.2). Its sensors trigger it.
pub trait Monitor: 'static {
    /// Kind in the configuration, in snake case.
    const NAME: &'static str;
    /// Description.
    const DOC: &'static str = "";
    /// Ports of its sensors.
    type Sensors: Ports;
    /// Parameters.
    type Params: Params;
    /// State.
    type State: BlockState;
    /// Published value.
    type Value: Interface + Copy;

    /// Interprets the sensors' data; returns the percept to publish.
    fn interpret(
        state: &mut Self::State,
        sensors: &Self::Sensors,
        params: &Self::Params,
        now: &Tick,
    ) -> Option<Self::Value>;
}

/// Additional ports of a Monitor.
#[ports]
pub struct MonitorPorts<T: Interface> {
    /// Percept of the Monitor.
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
