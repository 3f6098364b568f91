use std::marker::PhantomData;

use slate_module::role;
use slate_module::{
    Direction, Module, Outcome, Params, PortDescription, Ports, Refusal, Setup, Spec, Stage, StaleInput,
    Tick, Trigger,
};

use crate::Published;
use crate::block::{BlockState, distinct, on};
use crate::knowledge::Device;
use crate::published::has_place;

/// Interprets the data of sensors for Analyzes (RoCS, 4.2). Its sensors trigger it.
///
/// It finds the settings of its sensors, such as their limits, in the RobotModel, which it reads of the cycle before: Knowledge
/// comes after it. While an input of a sensor is older than its `#[stale]` and its [device](Monitor::device) say, or its data are
/// invalid, the Monitor is degraded, and the log names the sensor.
pub trait Monitor: 'static {
    /// Kind in the configuration, in snake case.
    const NAME: &'static str;
    /// Description.
    const DOC: &'static str = "";
    /// Ports: [`Sensed`](crate::Sensed) for each sensor, plain inputs for knowledge.
    /// Without a `Sensed`, every input is of a sensor.
    type Sensors: Ports;
    /// Parameters.
    type Params: Params;
    /// State.
    type State: BlockState;
    /// Published value: a small one, or [`InPlace`](crate::InPlace) for any size.
    type Value: Published;

    /// Interprets the sensors' data; returns the percept to publish.
    fn interpret(
        state: &mut Self::State,
        sensors: &Self::Sensors,
        params: &Self::Params,
        now: &Tick,
    ) -> Option<Self::Value>;

    /// Returns the device that a port of a sensor reads, from the RobotModel.
    /// The sensor counts as stopped by the device's rate, if that is later than by the port's `#[stale]`.
    fn device<'s>(_: &'s Self::Sensors, _port: &str) -> Option<&'s Device> {
        None
    }

    /// Returns whether the newest data are invalid: the Monitor is degraded.
    fn is_degraded(_: &Self::State) -> bool {
        false
    }
}

/// A [`Monitor`] as a module.
pub struct MonitorBlock<M>(PhantomData<fn() -> M>);

impl<M: Monitor> Module for MonitorBlock<M> {
    type Io = (M::Sensors, <M::Value as Published>::Percept);
    type Params = M::Params;
    type State = M::State;

    const NAME: &'static str = M::NAME;
    const DOC: &'static str = M::DOC;
    const STAGE: Stage = Stage::SensorProcess;

    fn spec() -> Spec {
        let ports = M::Sensors::describe();
        let is_sensed = |port: &PortDescription| port.role == role::MEASUREMENT;
        let has_sensed = ports.iter().any(is_sensed);
        // Beside sensors, a plain input is knowledge.
        let mut trigger =
            on(&ports, &|port| !has_sensed || is_sensed(port) || port.direction != Direction::Input);
        if let Trigger::On { timeout: Some(timeout), .. } = &mut trigger {
            // At the first tick without a measurement, the newest one is stale already.
            *timeout += 1;
        }
        Spec { trigger, deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, _: &M::Params) -> Result<M::State, Refusal> {
        distinct(&Self::Io::describe())?;
        has_place::<M::Value, M::Sensors>(role::PERCEPT)?;
        Ok(M::State::default())
    }

    fn tick(state: &mut M::State, (sensors, own): &Self::Io, params: &M::Params, now: &Tick) -> Outcome {
        let outcome = match M::interpret(state, sensors, params, now) {
            Some(value) => value.perceive(own, now),
            None => Outcome::Ok,
        };
        match outcome {
            Outcome::Ok if M::is_degraded(state) => Outcome::Degraded,
            Outcome::Ok => watch::<M>(sensors, now),
            outcome => outcome,
        }
    }
}

/// Returns `Degraded` while a sensor has stopped; logged once.
fn watch<M: Monitor>(sensors: &M::Sensors, now: &Tick) -> Outcome {
    let Some(StaleInput { name, stamp, after: declared }) = sensors.stale_input() else {
        return Outcome::Ok;
    };
    let age = now.now().saturating_sub(stamp.time);
    let device = M::device(sensors, name);
    let by_rate = device.map_or(0, |device| (device.silent_after() * 1e9) as u64);
    let after = declared.max(by_rate);
    if age > declared && age <= after {
        // It is slower than the port says.
        return Outcome::Ok;
    }
    let last_tick = (now.elapsed() * 1e9 + 0.5) as u64;
    // An input whose Sensor is gone is stale at once, and has a value that is old later; at the last tick it was not yet.
    if age > after && age.saturating_sub(last_tick) <= after {
        let name = device.map_or(name, |device| device.name.as_str());
        now.warn(format_args!(
            "the sensor `{name}` has stopped: its newest value is {:.2} s old",
            age as f64 * 1e-9
        ));
    }
    Outcome::Degraded
}
