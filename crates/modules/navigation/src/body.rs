//! Body of a robot that navigates.

use serde::{Deserialize, Serialize};
use slate_local_planning::PlanarVelocity;
use slate_plugin::interfaces::{Odometry, Path, Pose2, WheelSpeeds};
use slate_plugin::prelude::*;
use slate_wheeled::knowledge::WheeledModel;

use crate::local_plan::LocalPlan;
use crate::obstacles::ObstaclePoints;
use crate::settings::ControllerSettings;

/// Request to forget the obstacles that are out of sight.
#[interface]
#[derive(PartialEq)]
pub struct CostmapClear {
    /// Number of the request.
    pub number: u64,
}

/// Body of a robot with two driven wheels that navigates.
#[ports]
pub struct NavigationBody {
    /// Robot model with the pose, from Knowledge.
    #[stale(after = "300ms")]
    robot: Input<WheeledModel>,
    /// Wheel encoders.
    #[stale(after = "300ms")]
    odometry: Input<Odometry>,
    /// Obstacles around the robot in the odometry frame, from Knowledge.
    #[stale(after = "500ms")]
    obstacles: Input<ObstaclePoints>,
    /// Path of the Plan in the map frame.
    #[stale(after = "10s")]
    path: Input<Path>,
    /// Settings of the local planner, from Knowledge.
    controller: Input<ControllerSettings>,
    /// Request to forget the obstacles that are out of sight.
    clear: Output<CostmapClear>,
    /// Trajectories that the local planner compares, for views.
    #[capacity(1024)]
    pub local_plan: Debug<LocalPlan>,
    /// Both wheels.
    #[safe(WheelSpeeds::ZERO)]
    wheels: Command<WheelSpeeds>,
}

/// Input that an action misses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum MissingInput {
    /// No pose, or an old one.
    #[error("the pose is unknown or stale")]
    Pose,
    /// No odometry, or an old one.
    #[error("`odometry` is missing or stale")]
    Odometry,
    /// No obstacles, or old ones.
    #[error("`obstacles` are missing or stale: check the block that publishes them")]
    Obstacles,
    /// No settings.
    #[error("`controller` has no settings: link it to Knowledge")]
    Settings,
    /// No path to the goal, or an old one.
    #[error("`path` does not lead to the goal, or is stale: check the Plan")]
    Path,
}

impl NavigationBody {
    /// Returns the pose in the map frame.
    ///
    /// # Errors
    /// It is unknown or old.
    pub fn pose(&self) -> Result<Pose2, MissingInput> {
        let pose = self.robot.fresh().map(|robot| robot.robot.pose);
        pose.filter(Pose2::is_known).ok_or(MissingInput::Pose)
    }

    /// Returns the odometry.
    ///
    /// # Errors
    /// It is missing, old or no number.
    pub fn odometry(&self) -> Result<&Odometry, MissingInput> {
        let is_known = |odometry: &&Odometry| {
            let twist = odometry.twist;
            odometry.pose.is_known() && twist.linear.is_finite() && twist.angular.is_finite()
        };
        self.odometry.fresh().filter(is_known).ok_or(MissingInput::Odometry)
    }

    /// Returns the obstacles around the robot.
    ///
    /// # Errors
    /// They are missing or old.
    pub fn obstacles(&self) -> Result<&ObstaclePoints, MissingInput> {
        self.obstacles.fresh().ok_or(MissingInput::Obstacles)
    }

    /// Returns the path.
    ///
    /// # Errors
    /// It is missing, empty or old.
    pub fn path(&self) -> Result<&Path, MissingInput> {
        self.path.fresh().filter(|path| !path.points.is_empty()).ok_or(MissingInput::Path)
    }

    /// Returns the settings.
    ///
    /// # Errors
    /// They are missing.
    pub fn settings(&self) -> Result<&ControllerSettings, MissingInput> {
        self.controller.get().ok_or(MissingInput::Settings)
    }

    /// Returns the robot model.
    pub fn model(&self) -> Option<&WheeledModel> {
        self.robot.get()
    }

    /// Requests that obstacles out of sight are forgotten.
    pub fn clear_costmap(&self, now: &Tick) {
        self.clear.set(CostmapClear { number: now.number().max(1) });
    }

    /// Commands the wheels to a velocity; without a robot model they stop.
    pub fn drive(&self, velocity: PlanarVelocity, priority: Priority) {
        let speeds =
            self.model().map_or(WheelSpeeds::ZERO, |model| model.wheels_for(velocity.vx, velocity.wz));
        self.wheels.send(speeds, priority);
    }

    /// Commands the wheels to stand.
    pub fn stand(&self, priority: Priority) {
        self.wheels.send(WheelSpeeds::ZERO, priority);
    }
}
