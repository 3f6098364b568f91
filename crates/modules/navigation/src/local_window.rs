//! Window with the obstacles around a robot, and its footprint in it.

use slate_avoidance::Footprint;
use slate_local_planning::{FootprintPoints, LocalPlanningError, ObstacleField, PlanarVelocity};
use slate_plugin::interfaces::{Point2, Pose2};
use slate_plugin::prelude::*;

use crate::body::NavigationBody;

/// Distance between the cells of the window, m.
const RESOLUTION: f64 = 0.05;
/// Least clearance of a velocity, m, unless the robot already is nearer.
const LEAST_CLEARANCE: f64 = 0.04;

/// Obstacles around a robot.
/// They are replaced in each cycle, so that they are no state.
pub struct LocalWindow {
    size: f64,
    /// Outline of the robot.
    pub footprint: Footprint,
    points: FootprintPoints,
    /// Distances to the obstacles in the odometry frame.
    pub field: ObstacleField,
}

impl LocalWindow {
    /// Returns a window of a size, m; keeps an existing one of that size.
    ///
    /// # Errors
    /// A size that no window can have, or a robot without a model or a convex outline.
    pub fn fit<'w>(
        window: &'w mut Option<Box<Self>>,
        size: f64,
        body: &NavigationBody,
    ) -> Result<&'w mut Self, LocalPlanningError> {
        if window.as_ref().is_some_and(|window| window.size != size) {
            *window = None;
        }
        match window {
            Some(window) => Ok(window),
            none => {
                let error =
                    LocalPlanningError { name: "outline", expected: "a robot model with a convex outline" };
                let outline = &body.model().ok_or(error)?.chassis.outline;
                let footprint = Footprint::of(outline).map_err(|_| error)?;
                let (points, field) =
                    (FootprintPoints::new(&footprint), ObstacleField::new(size, RESOLUTION)?);
                Ok(none.insert(Box::new(Self { size, footprint, points, field })))
            }
        }
    }

    /// Fills the window around a pose in the odometry frame.
    pub fn update(&mut self, pose: &Pose2, obstacles: &[Point2]) {
        self.field.update([pose.x, pose.y], obstacles.iter().map(|point| [point.x, point.y]));
    }

    /// Returns true if a velocity from a pose is free of collisions for a short time.
    pub fn is_free(&self, pose: &Pose2, velocity: PlanarVelocity) -> bool {
        let distance = |seconds| self.points.distance(&self.field, &ahead(pose, velocity, seconds));
        let least = math::min(LEAST_CLEARANCE, distance(0.0));
        (1..=4).all(|k| distance(0.1 * f64::from(k)) >= least) && distance(0.4) > 0.0
    }
}

/// Returns the pose after a time at a velocity.
fn ahead(pose: &Pose2, velocity: PlanarVelocity, seconds: f64) -> Pose2 {
    Pose2 {
        x: pose.x + velocity.vx * seconds * math::cos(pose.theta),
        y: pose.y + velocity.vx * seconds * math::sin(pose.theta),
        theta: pose.theta + velocity.wz * seconds,
    }
}
