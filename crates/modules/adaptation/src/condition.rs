//! Failure and recovery of a sensor.

use serde::{Deserialize, Serialize};
use slate_plugin::module::Level;
use slate_plugin::prelude::*;

use crate::range_health::SensorHealth;

/// Condition of a sensor.
#[interface]
#[derive(Serialize, Deserialize)]
pub enum Condition {
    /// No failure.
    Healthy,
    /// No measurements.
    Silent,
    /// Measurements are late.
    Late,
    /// Measurements are NaN.
    Invalid,
    /// Measurements stay the same while the robot moves.
    Frozen,
}

/// Change of a sensor's condition.
#[interface]
#[derive(PartialEq)]
pub struct SensorCondition {
    /// Number of the change, from 1.
    pub change: u64,
    /// New condition.
    pub condition: Condition,
}

/// Percept of a sensor's health.
#[ports]
pub struct ObservedHealth {
    health: Observed<SensorHealth>,
}

/// Parameters of [`ReportCondition`].
#[params]
pub struct ConditionParams {
    #[param(default = "sensor", doc = "name of the sensor in the log")]
    sensor: Text<28>,
    #[param(default = 0.15, range = 0.0..=60.0, unit = "s", doc = "age after which a measurement is late")]
    late_timeout: f64,
    #[param(default = 1.0, range = 0.0..=60.0, unit = "s", doc = "age after which a sensor is silent")]
    silent_timeout: f64,
    #[param(default = 0.25, range = 0.0..=1.0, doc = "fraction of NaN above which a measurement is invalid")]
    max_invalid_fraction: f64,
    #[param(default = 0.03, range = 0.0..=10.0, unit = "m", doc = "travel without a changed reading after which a sensor counts as stuck")]
    stuck_distance: f64,
    #[param(default = 2.0, range = 0.0..=60.0, unit = "s", doc = "time of health after which a sensor has recovered")]
    recovery_time: f64,
}

/// Newest report.
#[derive(Default, Serialize, Deserialize)]
pub struct LastCondition {
    change: u64,
    condition: Option<Condition>,
    /// Start of the health of a failed sensor, seconds.
    well_since: Option<f64>,
}

/// Reports sensor failures at once, recoveries after the recovery time.
pub struct ReportCondition;

impl Analyze for ReportCondition {
    const NAME: &'static str = "tell_condition";
    const DOC: &'static str = "Reports when a sensor fails and when it has recovered.";
    type Observed = ObservedHealth;
    type Params = ConditionParams;
    type State = LastCondition;
    type Value = SensorCondition;

    fn process(
        last: &mut LastCondition,
        observed: &ObservedHealth,
        params: &ConditionParams,
        now: &Tick,
    ) -> Option<SensorCondition> {
        let health = observed.health.updated()?;
        let condition = if health.age > params.silent_timeout {
            Condition::SILENT
        } else if health.age > params.late_timeout {
            Condition::LATE
        } else if health.invalid > params.max_invalid_fraction {
            Condition::INVALID
        } else if health.unchanged > params.stuck_distance {
            Condition::FROZEN
        } else {
            Condition::HEALTHY
        };
        let is_well = condition == Condition::HEALTHY;
        last.well_since = last.well_since.or(Some(now.seconds())).filter(|_| is_well);
        let recovers = last.well_since.is_some_and(|since| now.seconds() - since < params.recovery_time);
        // A recovering sensor stays in its condition.
        let waits = is_well && recovers && last.condition.is_some();
        // A silent sensor is late for a moment when it returns.
        let milder = last.condition == Some(Condition::SILENT) && condition == Condition::LATE;
        if waits || milder || last.condition == Some(condition) {
            return None;
        }
        last.change += 1;
        // The initial condition is logged only if it is a failure.
        if last.condition.replace(condition).is_some() || !is_well {
            let level = if is_well { Level::Info } else { Level::Warn };
            let (sensor, name) = (params.sensor.as_str(), condition.name());
            let fields = [
                ("change", last.change.into()),
                ("sensor", sensor.into()),
                ("condition", name.into()),
                ("age_s", health.age.into()),
                ("invalid", health.invalid.into()),
                ("unchanged_m", health.unchanged.into()),
            ];
            now.log_with(level, format_args!("change: {sensor} is {name}"), &fields);
        }
        Some(SensorCondition { change: last.change, condition })
    }
}
