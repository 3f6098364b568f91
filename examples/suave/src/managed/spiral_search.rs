//! Function `search`: an expanding spiral.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;

use super::is_near;
use crate::interfaces::{FunctionStatus, Navigation, Setpoint};

/// Ports of the search.
#[ports]
pub struct SearchIo {
    navigation: Input<Navigation>,
    /// Points of the spiral.
    setpoint: Outbox<Setpoint>,
    /// Sign of life.
    active: Output<FunctionStatus>,
}

/// Parameters of the search.
#[params]
pub struct SearchParams {
    #[param(default = 2.0, range = 0.5..=20.0, unit = "m", doc = "altitude of the spiral")]
    /// Altitude of the spiral, meters.
    pub altitude: f64,
    #[param(default = std::f64::consts::FRAC_PI_3, range = 0.01..=3.0, unit = "rad", doc = "field of view of the camera, which the turns are apart")]
    field_of_view: f64,
    #[param(default = 0.1, range = 0.001..=1.0, unit = "rad", doc = "angle between two points")]
    resolution: f64,
    #[param(default = 1.0, range = 0.05..=60.0, unit = "s", doc = "least time between two points")]
    period: f64,
    #[param(default = 0.4, range = 0.01..=5.0, unit = "m", doc = "distance along each axis at which a point is reached")]
    tolerance: f64,
}

/// Progress on the spiral.
#[derive(Default, Serialize, Deserialize)]
pub struct SearchState {
    /// Time of the last observation, seconds.
    looked: Option<f64>,
    center: Option<(f64, f64)>,
    /// Number of the next point.
    count: u32,
    /// Offset of the present point from the center, meters.
    offset: (f64, f64),
    /// Present point: east, north, altitude, meters.
    point: Option<(f64, f64, f64)>,
    /// Altitude of the last observation, meters.
    altitude: f64,
}

/// Flies a spiral with turns as far apart as the camera's view at its altitude.
pub struct SpiralSearch;

#[module(stage = Skill)]
impl Module for SpiralSearch {
    type Io = SearchIo;
    type Params = SearchParams;
    type State = SearchState;

    fn tick(state: &mut SearchState, io: &SearchIo, params: &SearchParams, now: &Tick) -> Outcome {
        io.active.set(FunctionStatus { altitude: params.altitude });
        let Some(navigation) = io.navigation.get() else { return Outcome::Degraded };
        // Times of a lockstep run are whole nanoseconds.
        if state.looked.is_some_and(|looked| now.seconds() - looked < params.period - 1e-6) {
            return Outcome::Ok;
        }
        state.looked = Some(now.seconds());
        let center = *state.center.get_or_insert((navigation.x, navigation.y));
        if state.altitude != params.altitude {
            state.altitude = params.altitude;
            state.count += 1;
        }
        let is_reached = state.point.is_none_or(|(x, y, altitude)| {
            let is_high = (navigation.altitude - altitude).abs() <= params.tolerance;
            is_near(navigation, &Setpoint { x, y, altitude }, params.tolerance) && is_high
        });
        if is_reached {
            state.offset = next_offset(state.count, state.offset, params);
            state.count += 1;
        }
        // The point is sent again while it is not reached, at the present altitude.
        let (x, y) = (center.0 + state.offset.0, center.1 + state.offset.1);
        state.point = Some((x, y, params.altitude));
        io.setpoint.send(Setpoint { x, y, altitude: params.altitude });
        Outcome::Ok
    }
}

/// Returns the offset of a numbered point of the spiral.
/// The spiral grows from the radius of the point before.
fn next_offset(count: u32, before: (f64, f64), params: &SearchParams) -> (f64, f64) {
    if count == 0 {
        return (0.0, 0.0);
    }
    let width = 2.0 * params.altitude * math::tan(params.field_of_view / 2.0);
    let radius = math::hypot(before.0, before.1) + width * params.resolution / (2.0 * PI);
    let angle = f64::from(count) * params.resolution;
    (radius * math::cos(angle), radius * math::sin(angle))
}
