//! The context of a robot, and what it means for the parameters of others.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::Twist2;
use slate_plugin::prelude::*;

/// Ports of [`ContextSubsystem`].
#[ports]
pub struct ContextSubsystemIo {
    /// Velocity of the robot.
    #[stale(after = "1s")]
    actual_speed: Input<Twist2>,
    /// Roughness of the ground, as a camera or an inertial measurement unit sees it.
    #[stale(after = "2s")]
    terrain: Input<TerrainReading>,
    /// Advised parameters of the other modules.
    advice: Output<ContextAdvice>,
}

/// Roughness of the ground, in the unit of its sensor.
#[interface]
#[derive(PartialEq)]
pub struct TerrainReading {
    /// The reading: higher is rougher.
    pub roughness: f64,
}

/// Parameters that fit the context.
#[interface]
#[derive(PartialEq)]
pub struct ContextAdvice {
    /// Length of the motion blur in images.
    #[unit("px")]
    pub deblur_length: f64,
    /// Greatest velocity on this ground.
    #[unit("m/s")]
    pub max_linear_velocity: f64,
    /// Roughness of the ground, from 0 (smooth) to 1 (rough), over the last seconds.
    pub roughness: f64,
}

/// Parameters of [`ContextSubsystem`].
#[params]
pub struct ContextSubsystemParams {
    #[param(default = 0.01, range = 0.0..=1.0, unit = "s", doc = "exposure of the camera")]
    exposure: f64,
    #[param(default = 277.13, range = 1.0..=100_000.0, unit = "px", doc = "focal length of the camera")]
    focal_length: f64,
    #[param(default = 2.0, range = 0.05..=100.0, unit = "m", doc = "distance of what the camera looks at")]
    view_distance: f64,
    #[param(default = 0.0, range = 0.0..=1000.0, doc = "reading of smooth ground")]
    smooth: f64,
    #[param(default = 1.0, range = 0.0..=1000.0, doc = "reading of rough ground")]
    rough: f64,
    #[param(default = 0.5, range = 0.0..=10.0, unit = "m/s", doc = "greatest velocity on smooth ground")]
    smooth_linear_velocity: f64,
    #[param(default = 0.2, range = 0.0..=10.0, unit = "m/s", doc = "greatest velocity on rough ground")]
    rough_linear_velocity: f64,
    #[param(default = 1.0, range = 0.0..=60.0, unit = "s", doc = "time constant of the roughness")]
    time_constant: f64,
    #[param(default = 0.05, range = 0.0..=1.0, unit = "m/s", doc = "change below which the greatest velocity stays")]
    velocity_step: f64,
}

/// Reasons about the context of a robot: OpenRDK's `contextSubSystem`.
///
/// Its output is linked to parameters of modules that know nothing of a context. A faster robot has more motion blur in its
/// images; on rougher ground it should drive slower (Calisi, Censi, Iocchi and Nardi, 2012, section 4.3).
pub struct ContextSubsystem;

/// State of [`ContextSubsystem`].
#[derive(Default, Serialize, Deserialize)]
pub struct ContextSubsystemState {
    /// Roughness, 0 to 1, low-passed.
    roughness: Option<f64>,
    /// Greatest velocity that it has advised.
    velocity: Option<f64>,
}

#[module(stage = Think)]
impl Module for ContextSubsystem {
    type Io = ContextSubsystemIo;
    type Params = ContextSubsystemParams;
    type State = ContextSubsystemState;

    fn tick(
        state: &mut ContextSubsystemState,
        io: &ContextSubsystemIo,
        params: &ContextSubsystemParams,
        now: &Tick,
    ) -> Outcome {
        if let Some(terrain) = io.terrain.fresh().filter(|terrain| terrain.roughness.is_finite()) {
            state.take(terrain.roughness, params, now.elapsed());
        }
        let Some(speed) = io.actual_speed.fresh() else { return Outcome::Degraded };
        let pixels = params.exposure * params.focal_length;
        let blur = pixels * (speed.angular.abs() + speed.linear.abs() / params.view_distance);
        let roughness = state.roughness.unwrap_or(0.0);
        io.advice.set(ContextAdvice {
            // Steps of half a pixel: a filter is made for each.
            deblur_length: (2.0 * blur).round() / 2.0,
            max_linear_velocity: state.velocity(roughness, params),
            roughness,
        });
        if io.terrain.fresh().is_some() { Outcome::Ok } else { Outcome::Degraded }
    }
}

impl ContextSubsystemState {
    /// Low-passes a reading.
    fn take(&mut self, reading: f64, params: &ContextSubsystemParams, seconds: f64) {
        let span = math::max(params.rough - params.smooth, 1e-9);
        let share = math::clamp((reading - params.smooth) / span, 0.0, 1.0);
        let before = self.roughness.unwrap_or(share);
        let weight = seconds / (params.time_constant + seconds);
        // The first reading has no time before it.
        self.roughness = Some(if weight.is_finite() { before + weight * (share - before) } else { share });
    }

    /// Greatest velocity on this ground; it stays as long as it differs little.
    fn velocity(&mut self, roughness: f64, params: &ContextSubsystemParams) -> f64 {
        let (smooth, rough) = (params.smooth_linear_velocity, params.rough_linear_velocity);
        let wanted = smooth + roughness * (rough - smooth);
        let kept = self.velocity.filter(|kept| (kept - wanted).abs() < params.velocity_step);
        let velocity = kept.unwrap_or(wanted);
        self.velocity = Some(velocity);
        velocity
    }
}
