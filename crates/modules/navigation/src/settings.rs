//! Settings of the local planner and of the actions around it, from Knowledge.

use std::f64::consts::FRAC_PI_2;

use slate_local_planning::{
    DwaParameters, MotionLimits, MppiCritics, MppiParameters, ObstaclesCritic, PathAlignCritic,
    PathAngleCritic, PathCritic, RecoveryBehavior,
};
use slate_plugin::prelude::*;

/// Local planner that follows paths.
#[interface]
#[derive(PartialEq)]
pub struct ControllerSettings {
    /// Local planner.
    pub planner: LocalPlannerChoice,
    /// Sampled trajectories of MPPI.
    pub batch_size: u32,
    /// Steps of a trajectory.
    pub time_steps: u32,
    /// Time of a step, and between two plans.
    #[unit("s")]
    pub model_dt: f64,
    /// Largest velocity forward.
    #[unit("m/s")]
    pub vx_max: f64,
    /// Least velocity; negative backwards.
    #[unit("m/s")]
    pub vx_min: f64,
    /// Largest angular velocity.
    #[unit("rad/s")]
    pub wz_max: f64,
    /// Largest acceleration.
    #[unit("m/s^2")]
    pub ax_max: f64,
    /// Largest angular acceleration.
    #[unit("rad/s^2")]
    pub az_max: f64,
    /// Standard deviation of sampled velocities.
    #[unit("m/s")]
    pub vx_std: f64,
    /// Standard deviation of sampled angular velocities.
    #[unit("rad/s")]
    pub wz_std: f64,
    /// Length of the path ahead that is followed.
    #[unit("m")]
    pub prune_distance: f64,
    /// Distance between outline and obstacle below which a trajectory is very costly.
    #[unit("m")]
    pub collision_margin_distance: f64,
    /// Distance to an obstacle up to which it adds cost to a trajectory.
    #[unit("m")]
    pub inflation_radius: f64,
    /// Side of the window with obstacles around the robot.
    #[unit("m")]
    pub window_size: f64,
    /// Distance from the goal at which it counts as reached.
    #[unit("m")]
    pub xy_goal_tolerance: f64,
    /// Error of the heading at which it counts as reached.
    #[unit("rad")]
    pub yaw_goal_tolerance: f64,
    /// Distance within which the robot makes no progress.
    #[unit("m")]
    pub required_movement_radius: f64,
    /// Time without progress after which it is stuck.
    #[unit("s")]
    pub movement_time_allowance: f64,
    /// Recoveries without progress after which the action fails.
    pub number_of_retries: u32,
    /// Seed of the noise of MPPI.
    pub seed: u64,
}

/// Local planner.
#[interface]
pub enum LocalPlannerChoice {
    /// Model predictive path integral control.
    Mppi,
    /// Dynamic window approach.
    Dwa,
}

impl ControllerSettings {
    /// Returns the parameters of MPPI: Nav2's, with other weights.
    /// They turn the robot towards its path early.
    pub fn mppi(&self) -> MppiParameters {
        let critics = MppiCritics::default();
        MppiParameters {
            time_steps: self.time_steps as usize,
            model_dt: self.model_dt,
            batch_size: self.batch_size as usize,
            vx_std: self.vx_std,
            wz_std: self.wz_std,
            prune_distance: self.prune_distance,
            limits: MotionLimits {
                vx_max: self.vx_max,
                vx_min: self.vx_min,
                wz_max: self.wz_max,
                ax_max: self.ax_max,
                ax_min: -self.ax_max,
                az_max: self.az_max,
                ..MotionLimits::default()
            },
            critics: MppiCritics {
                obstacles: ObstaclesCritic {
                    collision_margin_distance: self.collision_margin_distance,
                    inflation_radius: self.inflation_radius,
                    ..critics.obstacles
                },
                path_align: PathAlignCritic { ..critics.path_align },
                path_follow: PathCritic { offset_from_furthest: 12, ..critics.path_follow },
                path_angle: PathAngleCritic { cost_weight: 4.0, ..critics.path_angle },
                prefer_forward: PathCritic { cost_weight: 10.0, ..critics.prefer_forward },
                ..critics
            },
            ..MppiParameters::default()
        }
    }

    /// Returns the parameters of DWA: those of `base_local_planner` of ROS.
    /// With the limits of the settings.
    pub fn dwa(&self) -> DwaParameters {
        DwaParameters {
            max_vel_x: self.vx_max,
            max_vel_theta: self.wz_max,
            acc_lim_x: self.ax_max,
            acc_lim_theta: self.az_max,
            controller_frequency: 1.0 / self.model_dt,
            inflation_radius: self.inflation_radius,
            ..DwaParameters::default()
        }
    }

    /// Returns the recovery behaviors of a stuck robot, in order.
    pub fn recoveries() -> [RecoveryBehavior; 4] {
        [
            RecoveryBehavior::ClearCostmap,
            RecoveryBehavior::BackUp { distance: 0.25, speed: 0.15 },
            RecoveryBehavior::Spin { angle: FRAC_PI_2, speed: 0.8 },
            RecoveryBehavior::Wait { duration: 3.0 },
        ]
    }
}
