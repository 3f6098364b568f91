//! Trajectories that the local planner compares, for views.

use slate_local_planning::Mppi;
use slate_plugin::interfaces::Pose2;
use slate_plugin::prelude::*;

use crate::frames::PlanarTransform;
use crate::settings::ControllerSettings;

/// Maximum number of sampled trajectories shown.
const MOST_SAMPLED: usize = 48;
/// Maximum number of points of all trajectories; capacity of the property.
const MOST_POINTS: usize = 1024;
/// Steps of a trajectory from one shown point to the next.
const STRIDE: usize = 4;

/// Trajectories of a local planner: the chosen one, and some alternatives.
#[interface]
pub struct LocalPlan {
    /// Number of points of each trajectory.
    pub steps: u32,
    /// Points by trajectory; the first trajectory is the one that is followed.
    pub points: [LocalPlanPoint],
}

/// Point of a trajectory of a local planner.
#[interface]
#[derive(PartialEq)]
pub struct LocalPlanPoint {
    /// x in the map frame.
    #[unit("m")]
    pub x: f64,
    /// y in the map frame.
    #[unit("m")]
    pub y: f64,
    /// Weight of the trajectory: 1 for the best one, 0 for one that collides.
    pub weight: f64,
}

impl LocalPlan {
    /// Writes the trajectories of a planner, if a viewer subscribes.
    /// The robot is at `pose` in the map frame.
    pub fn write(
        port: &Debug<Self>,
        planner: &Mppi,
        settings: &ControllerSettings,
        (odometry, pose): (&Pose2, &Pose2),
    ) {
        let batch_size = settings.batch_size as usize;
        let steps = (settings.time_steps as usize).div_ceil(STRIDE);
        let sampled = batch_size.min(MOST_POINTS / steps.max(1)).saturating_sub(1).min(MOST_SAMPLED);
        port.write((1 + sampled) * steps, |plan| {
            let to_map = PlanarTransform::between(odometry, pose);
            plan.steps = steps as u32;
            let mut places = plan.points.iter_mut();
            let mut put = |position, weight| {
                if let Some(place) = places.next() {
                    let [x, y] = to_map.point(position);
                    *place = LocalPlanPoint { x, y, weight };
                }
            };
            planner.trajectory().step_by(STRIDE).for_each(|pose| put([pose.x, pose.y], 1.0));
            for index in 0..sampled {
                let (weight, positions) = planner.sampled(index * batch_size / sampled);
                positions.step_by(STRIDE).for_each(|position| put(position, weight));
            }
        });
    }
}
