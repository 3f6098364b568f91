//! Sensors and Monitors of the managing loop: the vehicle's health.

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;

use crate::interfaces::{FunctionStatus, ThrusterHealth, VehicleMission, WaterVisibility};

/// Defines a sensor of a health property.
macro_rules! health_sensor {
    ($(#[$doc:meta])* $sensor:ident, $io:ident, $value:ty, $name:literal, $about:literal) => {
        /// Property of the vehicle.
        #[ports]
        pub struct $io {
            source: Input<$value>,
        }

        $(#[$doc])*
        pub struct $sensor;

        impl Sensor for $sensor {
            const NAME: &'static str = $name;
            const DOC: &'static str = $about;
            type Io = $io;
            type Params = ();
            type State = ();
            type Value = $value;

            fn get_data(_: &mut (), io: &$io, _: &(), _: &Tick) -> Option<$value> {
                io.source.updated().copied()
            }
        }
    };
}

health_sensor!(
    /// Sensor of the water's visibility.
    VisibilitySensor, VisibilitySource, WaterVisibility, "visibility_sensor", "Measures the water's visibility."
);
health_sensor!(
    /// Sensor of the thrusters' health.
    ThrusterSensor, ThrusterSource, ThrusterHealth, "thruster_sensor", "Reads the health of the thrusters."
);
health_sensor!(
    /// Sensor of the mission.
    MissionSensor, MissionSource, VehicleMission, "mission_sensor", "Reads the task of the mission."
);

/// Functions that are active.
#[interface]
#[derive(PartialEq)]
pub struct ActiveFunctions {
    /// Altitude of the search; 0 while it is off.
    #[unit("m")]
    pub search_altitude: f64,
    /// True if the inspection is active.
    pub inspects: Bool,
    /// True if the recovery is active.
    pub recovers: Bool,
}

/// Signs of life of the functions.
#[ports]
pub struct FunctionSource {
    #[stale(after = "150ms")]
    search: Input<FunctionStatus>,
    #[stale(after = "150ms")]
    follow: Input<FunctionStatus>,
    #[stale(after = "150ms")]
    recovery: Input<FunctionStatus>,
}

/// Sensor of the active functions, for the effect of an adaptation.
pub struct FunctionSensor;

impl Sensor for FunctionSensor {
    const NAME: &'static str = "function_sensor";
    const DOC: &'static str = "Reads which functions are active.";
    type Io = FunctionSource;
    type Params = ();
    type State = ();
    type Value = ActiveFunctions;

    fn get_data(_: &mut (), io: &FunctionSource, _: &(), _: &Tick) -> Option<ActiveFunctions> {
        Some(ActiveFunctions {
            search_altitude: io.search.fresh().map_or(0.0, |search| search.altitude),
            inspects: io.follow.fresh().is_some().into(),
            recovers: io.recovery.fresh().is_some().into(),
        })
    }
}

/// Visibility and its trend.
#[interface]
#[derive(PartialEq)]
pub struct VisibilityTrend {
    /// Present visibility.
    #[unit("m")]
    pub distance: f64,
    /// Change of the visibility.
    #[unit("m/s")]
    pub rate: f64,
}

/// Sensor of the visibility.
#[ports]
pub struct VisibilitySensors {
    visibility: Sensed<WaterVisibility>,
}

/// Parameters of the trend.
#[params]
pub struct TrendParams {
    #[param(default = 1.0, range = 0.0..=60.0, unit = "s", doc = "time constant of the trend's low-pass filter")]
    time_constant: f64,
}

/// Last measurement and the trend.
#[derive(Default, Serialize, Deserialize)]
pub struct TrendState {
    /// Time and visibility, nanoseconds and meters.
    last: Option<(u64, f64)>,
    /// Rate of change, meters per second.
    rate: f64,
}

/// Monitors the visibility and estimates its trend.
pub struct VisibilityMonitor;

impl Monitor for VisibilityMonitor {
    const NAME: &'static str = "visibility_monitor";
    const DOC: &'static str = "Watches the water's visibility and its trend.";
    type Sensors = VisibilitySensors;
    type Params = TrendParams;
    type State = TrendState;
    type Value = VisibilityTrend;

    fn interpret(
        state: &mut TrendState,
        sensors: &VisibilitySensors,
        params: &TrendParams,
        _: &Tick,
    ) -> Option<VisibilityTrend> {
        let distance = sensors.visibility.updated()?.distance;
        let time = sensors.visibility.stamp().time;
        if let Some((before, last)) = state.last.replace((time, distance)) {
            let step = time.saturating_sub(before) as f64 * 1e-9;
            if step > 0.0 {
                let share = step / (params.time_constant + step);
                state.rate += share * ((distance - last) / step - state.rate);
            }
        }
        Some(VisibilityTrend { distance, rate: state.rate })
    }
}

/// Passes a health property on as a percept.
macro_rules! health_monitor {
    ($(#[$doc:meta])* $monitor:ident, $sensors:ident, $value:ty, $name:literal, $about:literal) => {
        /// Sensor of the property.
        #[ports]
        pub struct $sensors {
            sensor: Sensed<$value>,
        }

        $(#[$doc])*
        pub struct $monitor;

        impl Monitor for $monitor {
            const NAME: &'static str = $name;
            const DOC: &'static str = $about;
            type Sensors = $sensors;
            type Params = ();
            type State = ();
            type Value = $value;

            fn interpret(_: &mut (), sensors: &$sensors, _: &(), _: &Tick) -> Option<$value> {
                sensors.sensor.updated().copied()
            }
        }
    };
}

health_monitor!(
    /// Monitors the thrusters.
    ThrusterMonitor, ThrusterSensors, ThrusterHealth, "thruster_monitor", "Watches the thrusters."
);
health_monitor!(
    /// Monitors the mission.
    MissionMonitor, MissionSensors, VehicleMission, "mission_monitor", "Watches the mission."
);
