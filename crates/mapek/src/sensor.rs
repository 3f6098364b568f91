use std::marker::PhantomData;

use slate_module::role;
use slate_module::{Module, Outcome, Params, Ports, Refusal, Setup, Spec, Stage, Tick};

use crate::Published;
use crate::block::{BlockState, distinct, on};
use crate::published::has_place;

/// Source of data.
/// Only Sensors and Actuators differ between a simulated and a real robot.
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
    /// Measured value: a small one, or [`InPlace`](crate::InPlace) for one of any size.
    type Value: Published;

    /// Returns new data since the previous call, if any. Must not block.
    fn get_data(
        state: &mut Self::State,
        io: &Self::Io,
        params: &Self::Params,
        now: &Tick,
    ) -> Option<Self::Value>;
}

/// A [`Sensor`] as a module: run in every cycle, or when it has inputs, by them.
pub struct SensorBlock<S>(PhantomData<fn() -> S>);

impl<S: Sensor> Module for SensorBlock<S> {
    type Io = (S::Io, <S::Value as Published>::Measurement);
    type Params = S::Params;
    type State = S::State;

    const NAME: &'static str = S::NAME;
    const DOC: &'static str = S::DOC;
    const STAGE: Stage = Stage::SensorAcquire;

    fn spec() -> Spec {
        Spec { trigger: on(&S::Io::describe(), &|_| true), deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, _: &S::Params) -> Result<S::State, Refusal> {
        distinct(&Self::Io::describe())?;
        has_place::<S::Value, S::Io>(role::MEASUREMENT)?;
        Ok(S::State::default())
    }

    fn tick(state: &mut S::State, (io, own): &Self::Io, params: &S::Params, now: &Tick) -> Outcome {
        match S::get_data(state, io, params, now) {
            Some(value) => value.measure(own, now),
            None => Outcome::Ok,
        }
    }
}
