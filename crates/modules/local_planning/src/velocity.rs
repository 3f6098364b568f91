//! Velocities and their limits.

use serde::{Deserialize, Serialize};
use slate_interfaces::{Pose2, Twist2};
use slate_module::math;

use crate::error::LocalPlanningError;

/// Largest measured velocity, as a multiple of its limit.
/// A faster one is an error of its sensor.
pub(crate) const MOST_EXCESS: f64 = 3.0;

/// Velocity in the plane, in the robot's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlanarVelocity {
    /// Forward, m/s.
    pub vx: f64,
    /// Velocity to the left, m/s; 0 unless the robot is omnidirectional.
    pub vy: f64,
    /// Counter-clockwise, rad/s.
    pub wz: f64,
}

impl PlanarVelocity {
    /// No motion.
    pub const ZERO: Self = Self { vx: 0.0, vy: 0.0, wz: 0.0 };
}

impl From<PlanarVelocity> for Twist2 {
    /// Returns the velocity without its part to the left.
    fn from(velocity: PlanarVelocity) -> Self {
        Self { linear: velocity.vx, angular: velocity.wz }
    }
}

impl From<Twist2> for PlanarVelocity {
    fn from(twist: Twist2) -> Self {
        Self { vx: twist.linear, vy: 0.0, wz: twist.angular }
    }
}

/// Pose and velocity of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionState {
    /// Pose in the planner's frame: odometry, map, or the robot itself.
    /// It is the frame of the path and of the obstacles.
    pub pose: Pose2,
    /// Velocity in the robot's frame.
    pub velocity: PlanarVelocity,
}

impl MotionState {
    pub(crate) fn is_finite(&self) -> bool {
        let PlanarVelocity { vx, vy, wz } = self.velocity;
        self.pose.is_known() && vx.is_finite() && vy.is_finite() && wz.is_finite()
    }
}

/// Motion model of a robot at a commanded velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MotionModel {
    /// Two driven wheels: forward and turns.
    #[default]
    Differential,
    /// Wheels that skid sideways in turns.
    SkidSteer {
        /// Share of a commanded turn that is lost, 0 to 1.
        slip: f64,
    },
    /// Omnidirectional.
    Omni,
}

impl MotionModel {
    /// Returns the share of a commanded turn that happens.
    pub(crate) fn turn_share(self) -> f64 {
        match self {
            Self::SkidSteer { slip } => 1.0 - slip,
            Self::Differential | Self::Omni => 1.0,
        }
    }

    pub(crate) fn check(self) -> Result<(), LocalPlanningError> {
        let Self::SkidSteer { slip } = self else { return Ok(()) };
        LocalPlanningError::unless((0.0..1.0).contains(&slip), "slip", "a share from 0, below 1")
    }
}

/// Limits of velocity and acceleration, with Nav2's names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLimits {
    /// Largest velocity forward, m/s.
    pub vx_max: f64,
    /// Least velocity, m/s; negative backwards.
    pub vx_min: f64,
    /// Largest velocity to either side, m/s.
    pub vy_max: f64,
    /// Largest angular velocity, rad/s.
    pub wz_max: f64,
    /// Largest acceleration forward, m/s².
    pub ax_max: f64,
    /// Strongest deceleration, m/s²; negative.
    pub ax_min: f64,
    /// Largest acceleration to either side, m/s².
    pub ay_max: f64,
    /// Largest angular acceleration, rad/s².
    pub az_max: f64,
}

impl Default for MotionLimits {
    fn default() -> Self {
        Self {
            vx_max: 0.5,
            vx_min: -0.35,
            vy_max: 0.5,
            wz_max: 1.9,
            ax_max: 3.0,
            ax_min: -3.0,
            ay_max: 3.0,
            az_max: 3.5,
        }
    }
}

impl MotionLimits {
    /// Returns the velocity after a time at a commanded velocity.
    pub fn apply(&self, now: PlanarVelocity, command: PlanarVelocity, seconds: f64) -> PlanarVelocity {
        let toward = |now: f64, wanted: f64, down: f64, up: f64| {
            math::clamp(wanted, now + down * seconds, now + up * seconds)
        };
        PlanarVelocity {
            vx: toward(now.vx, math::clamp(command.vx, self.vx_min, self.vx_max), self.ax_min, self.ax_max),
            vy: toward(now.vy, math::clamp(command.vy, -self.vy_max, self.vy_max), -self.ay_max, self.ay_max),
            wz: toward(now.wz, math::clamp(command.wz, -self.wz_max, self.wz_max), -self.az_max, self.az_max),
        }
    }

    pub(crate) fn check(&self) -> Result<(), LocalPlanningError> {
        LocalPlanningError::unless_magnitudes(&[("vx_max", self.vx_max), ("vy_max", self.vy_max)])?;
        LocalPlanningError::unless_positive(&[
            ("wz_max", self.wz_max),
            ("ax_max", self.ax_max),
            ("ay_max", self.ay_max),
            ("az_max", self.az_max),
        ])?;
        let is_least = self.vx_min.is_finite() && self.vx_min <= self.vx_max;
        LocalPlanningError::unless(is_least, "vx_min", "a number up to vx_max")?;
        LocalPlanningError::unless(self.ax_min.is_finite() && self.ax_min < 0.0, "ax_min", "a number below 0")
    }
}
