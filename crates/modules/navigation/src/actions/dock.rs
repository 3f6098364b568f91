//! Slow, straight approach to a pose.

use serde::{Deserialize, Serialize};
use slate_local_planning::PlanarVelocity;
use slate_plugin::prelude::*;

use crate::body::NavigationBody;
use crate::controller::{ControlInputs, PathController};
use crate::frames::PlanarTransform;

/// Docks: drives slowly and straight to a pose before a target.
/// Such as a charger: within 2 cm and 2 degrees by the robot's pose.
///
/// It begins before the pose, about in its direction. It fails beside or behind it, and where something is in its way.
#[derive(Serialize, Deserialize)]
pub struct Dock {
    arguments: DockArguments,
    controller: PathController,
    /// Time for which an obstacle has blocked the path, s.
    blocked: f64,
}

/// Arguments of [`Dock`].
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct DockArguments {
    /// x of the pose in the map frame, m.
    pub x: f64,
    /// y of the pose in the map frame, m.
    pub y: f64,
    /// Heading of the pose, rad.
    pub theta: f64,
    /// Greatest velocity, m/s.
    pub speed: f64,
}
arguments!(DockArguments { x, y, theta, speed });

/// Tolerances at the end: along and across the path, m, and of the heading, rad.
const AHEAD_TOLERANCE: f64 = 0.01;
const SIDE_TOLERANCE: f64 = 0.02;
const HEADING_TOLERANCE: f64 = 0.035;
/// Heading towards the line per distance from it, rad/m, and the greatest one, rad.
const LINE_GAIN: f64 = 2.5;
const LINE_ANGLE: f64 = 0.5;
/// Angular velocity per error of the heading, 1/s.
const TURN_GAIN: f64 = 1.5;
/// Maximum time for which an obstacle may block the path, s.
const BLOCKED_TIMEOUT: f64 = 10.0;

impl ActionKind for Dock {
    const KIND: &'static str = "Dock";
    type Arguments = DockArguments;

    fn start(arguments: DockArguments) -> Self {
        Self { arguments, controller: PathController::default(), blocked: 0.0 }
    }
}

impl Action<NavigationBody> for Dock {
    fn act(&mut self, acting: &Acting<'_, NavigationBody>) -> Step {
        let Acting { body, priority, now } = *acting;
        let Ok(inputs) = ControlInputs::read(body) else {
            // It continues when they are well again.
            body.stand(priority);
            return Step::Running;
        };
        let Some(velocity) = self.velocity(&inputs) else {
            body.stand(priority);
            let error = self.error(&inputs);
            if error[1].abs() <= SIDE_TOLERANCE && error[2].abs() <= HEADING_TOLERANCE {
                return Step::Done;
            }
            now.warn(format_args!(
                "Dock: the robot is {:.3} m beside the pose, {:.3} rad off: it must begin farther away",
                error[1], error[2]
            ));
            return Step::Failed;
        };
        match self.controller.is_free(&inputs, velocity, body) {
            Ok(true) => {
                self.blocked = 0.0;
                body.drive(velocity, priority);
                Step::Running
            }
            Ok(false) => {
                self.blocked += now.elapsed();
                body.stand(priority);
                if self.blocked < BLOCKED_TIMEOUT {
                    return Step::Running;
                }
                now.warn(format_args!("Dock: something is in the way"));
                Step::Failed
            }
            Err(error) => {
                now.warn(format_args!("Dock: {error}"));
                Step::Failed
            }
        }
    }
}

impl Dock {
    /// Returns the tracking error: the robot in the frame of the pose.
    /// Before it (negative) or behind it, m, left of it, m, and heading, rad.
    fn error(&self, inputs: &ControlInputs<'_>) -> [f64; 3] {
        let DockArguments { x, y, theta, .. } = self.arguments;
        let target = PlanarTransform::of(&Pose2 { x, y, theta });
        let [along, left] = target.inverse_point([inputs.pose.x, inputs.pose.y]);
        [along, left, math::angle_between(theta, inputs.pose.theta)]
    }

    /// Returns the velocity towards the pose, along the line through it.
    /// `None` at its end.
    fn velocity(&self, inputs: &ControlInputs<'_>) -> Option<PlanarVelocity> {
        let [along, left, heading] = self.error(inputs);
        let speed = math::clamp(self.arguments.speed, 0.02, inputs.settings.vx_max);
        let most_turn = 0.5 * inputs.settings.wz_max;
        if along > -AHEAD_TOLERANCE {
            // Only the heading is left.
            let turn = math::clamp(-TURN_GAIN * heading, -most_turn, most_turn);
            let turn = PlanarVelocity { wz: turn, ..PlanarVelocity::ZERO };
            return (left.abs() <= SIDE_TOLERANCE && heading.abs() > HEADING_TOLERANCE).then_some(turn);
        }
        let wanted = math::clamp(-LINE_GAIN * left, -LINE_ANGLE, LINE_ANGLE);
        let wz = math::clamp(TURN_GAIN * math::angle_between(heading, wanted), -most_turn, most_turn);
        // Slower at the end, and while it turns to the line.
        let vx = math::clamp(0.8 * -along, 0.02, speed);
        let vx = if math::angle_between(heading, wanted).abs() > 0.4 { 0.0 } else { vx };
        Some(PlanarVelocity { vx, vy: 0.0, wz })
    }
}
