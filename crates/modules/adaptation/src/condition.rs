//! When a sensor fails, and when it has recovered.

use serde::{Deserialize, Serialize};
use slate_plugin::mapek::prelude::*;
use slate_plugin::module::Level;
use slate_plugin::prelude::*;

use crate::range_health::SensorHealth;

/// What is wrong with a sensor.
#[interface]
#[derive(Serialize, Deserialize)]
pub enum Condition {
    /// Nothing.
    Healthy,
    /// It says nothing.
    Silent,
    /// It speaks too seldom, so what it says is old.
    Late,
    /// What it says is no number.
    Invalid,
    /// It says the same again and again, while its robot moves.
    Frozen,
}

/// A sensor whose condition has changed.
#[interface]
#[derive(PartialEq)]
pub struct SensorCondition {
    /// Counts the changes of this sensor from 1.
    pub change: u64,
    /// How it is now.
    pub condition: Condition,
    /// Not used.
    pub reserved: [u8; 7],
}

/// The percept of a sensor's health.
#[ports]
pub struct ObservedHealth {
    health: Observed<SensorHealth>,
}

/// What counts as a failure.
#[params]
pub struct ConditionParams {
    #[param(default = "sensor", doc = "what the log calls the sensor")]
    sensor: Text<28>,
    #[param(default = 0.15, range = 0.0..=60.0, unit = "s", doc = "older than this is late")]
    late: f64,
    #[param(default = 1.0, range = 0.0..=60.0, unit = "s", doc = "older than this is silent")]
    silent: f64,
    #[param(default = 0.25, range = 0.0..=1.0, doc = "with a larger share of what is no number it is invalid")]
    invalid: f64,
    #[param(default = 0.03, range = 0.0..=10.0, unit = "m", doc = "the same on a longer way than this is frozen")]
    unchanged: f64,
    #[param(default = 2.0, range = 0.0..=60.0, unit = "s", doc = "who was healthy for so long has recovered")]
    recovery: f64,
}

/// What was told last.
#[derive(Default, Serialize, Deserialize)]
pub struct Told {
    change: u64,
    condition: Option<Condition>,
    /// Since when a sensor that has failed does well again, seconds.
    well_since: Option<f64>,
}

/// Tells when a sensor fails, and when it has recovered: at once the one, after a while the other.
pub struct TellCondition;

impl Analyze for TellCondition {
    const NAME: &'static str = "tell_condition";
    const DOC: &'static str = "Tells when a sensor fails, and when it has recovered.";
    type Observed = ObservedHealth;
    type Params = ConditionParams;
    type State = Told;
    type Value = SensorCondition;

    fn process(
        told: &mut Told,
        observed: &ObservedHealth,
        params: &ConditionParams,
        now: &Tick,
    ) -> Option<SensorCondition> {
        let health = observed.health.new()?;
        let condition = if health.age > params.silent {
            Condition::SILENT
        } else if health.age > params.late {
            Condition::LATE
        } else if health.invalid > params.invalid {
            Condition::INVALID
        } else if health.unchanged > params.unchanged {
            Condition::FROZEN
        } else {
            Condition::HEALTHY
        };
        let is_well = condition == Condition::HEALTHY;
        told.well_since = told.well_since.or(Some(now.seconds())).filter(|_| is_well);
        let recovers = told.well_since.is_some_and(|since| now.seconds() - since < params.recovery);
        // One that has failed does not fail in two ways to and fro while it recovers.
        let waits = is_well && recovers && told.condition.is_some();
        // Who has stopped to be silent may still be late for a moment.
        let milder = told.condition == Some(Condition::SILENT) && condition == Condition::LATE;
        if waits || milder || told.condition == Some(condition) {
            return None;
        }
        told.change += 1;
        // What a sensor does at the beginning is no news to people unless it fails.
        if told.condition.replace(condition).is_some() || !is_well {
            let level = if is_well { Level::Info } else { Level::Warn };
            let (sensor, name) = (params.sensor.as_str(), condition.name());
            let fields = [
                ("change", told.change.into()),
                ("sensor", sensor.into()),
                ("condition", name.into()),
                ("age_s", health.age.into()),
                ("invalid", health.invalid.into()),
                ("unchanged_m", health.unchanged.into()),
            ];
            now.log_with(level, format_args!("change: {sensor} is {name}"), &fields);
        }
        Some(SensorCondition { change: told.change, condition, reserved: [0; 7] })
    }
}
