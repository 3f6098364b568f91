//! Settings of the navigations that are compared.

use std::f64::consts::{FRAC_PI_2, TAU};

use slate_local_planning::{
    DwaParameters, MotionLimits, MppiCritics, MppiParameters, ObstaclesCritic, PathAngleCritic, PathCritic,
    RecoveryBehavior,
};
use slate_planning::Inflation;

use super::LocalPlannerKind;
use super::jackal::MOTORS;

/// Settings that differ between the planners.
pub struct NavigationSettings {
    pub mppi: MppiParameters,
    pub dwa: DwaParameters,
    /// Margin around the robot's outline, m.
    pub footprint_padding: f64,
    /// Costs of the global planner.
    pub inflation: Inflation,
    pub cost_factor: f64,
    /// Size of the local window, m.
    pub field_size: f64,
    /// Ranges up to which beams mark and clear, m.
    pub obstacle_range: f64,
    pub raytrace_range: f64,
    /// Time that points stay in the local window, s.
    pub observation_persistence: f64,
    /// Time without progress after which the robot recovers, s.
    pub movement_time_allowance: f64,
    pub recovery: Vec<RecoveryBehavior>,
}

impl NavigationSettings {
    pub fn of(kind: LocalPlannerKind) -> Self {
        match kind {
            LocalPlannerKind::Mppi => Self::mppi(),
            LocalPlannerKind::Dwa => Self::dwa(),
        }
    }

    /// Returns Nav2's defaults, adapted to a robot three times as fast.
    /// It must decide within narrow passages.
    fn mppi() -> Self {
        let critics = MppiCritics::default();
        Self {
            mppi: MppiParameters {
                limits: MotionLimits { vx_max: 1.5, vx_min: -0.2, wz_max: 2.5, ..MOTORS },
                prune_distance: 6.0,
                vx_std: 0.5,
                wz_std: 0.8,
                critics: MppiCritics {
                    obstacles: ObstaclesCritic { collision_margin_distance: 0.06, ..critics.obstacles },
                    path_follow: PathCritic {
                        cost_weight: 10.0,
                        offset_from_furthest: 20,
                        ..critics.path_follow
                    },
                    path_angle: PathAngleCritic { cost_weight: 5.0, ..critics.path_angle },
                    prefer_forward: PathCritic { cost_weight: 20.0, ..critics.prefer_forward },
                    ..critics
                },
                ..MppiParameters::default()
            },
            dwa: DwaParameters::default(),
            footprint_padding: 0.0,
            // The circle around the footprint: a path that the robot can follow at any heading.
            inflation: Inflation { inscribed_radius: 0.33, inflation_radius: 0.8, cost_scaling_factor: 4.0 },
            cost_factor: 5.0,
            field_size: 10.0,
            obstacle_range: 10.0,
            raytrace_range: 10.0,
            observation_persistence: 30.0,
            movement_time_allowance: 3.0,
            recovery: vec![
                RecoveryBehavior::BackUp { distance: 0.3, speed: 0.3 },
                RecoveryBehavior::Spin { angle: FRAC_PI_2, speed: 1.0 },
                RecoveryBehavior::Wait { duration: 1.0 },
                RecoveryBehavior::ClearCostmap,
            ],
        }
    }

    /// Returns the settings published with the challenge.
    fn dwa() -> Self {
        Self {
            mppi: MppiParameters::default(),
            dwa: DwaParameters {
                max_vel_x: 0.5,
                min_vel_x: 0.1,
                max_vel_theta: 1.57,
                min_in_place_vel_theta: 0.314,
                escape_vel: -0.5,
                acc_lim_x: 10.0,
                acc_lim_theta: 20.0,
                sim_time: 2.0,
                sim_granularity: 0.02,
                angular_sim_granularity: 0.02,
                vx_samples: 6,
                vtheta_samples: 20,
                controller_frequency: 20.0,
                pdist_scale: 0.75,
                gdist_scale: 1.0,
                occdist_scale: 0.1,
                inflation_radius: 0.3,
                cost_scaling_factor: 10.0,
                oscillation_reset_dist: 0.05,
                heading_lookahead: 0.325,
            },
            // The published footprint is 0.42 m by 0.33 m with 0.1 m around it.
            footprint_padding: 0.056,
            inflation: Inflation {
                inscribed_radius: 0.265,
                inflation_radius: 0.3,
                cost_scaling_factor: 10.0,
            },
            cost_factor: 1.0,
            field_size: 10.0,
            obstacle_range: 2.5,
            raytrace_range: 3.0,
            observation_persistence: 10.0,
            movement_time_allowance: 10.0,
            recovery: vec![RecoveryBehavior::ClearCostmap, RecoveryBehavior::Spin { angle: TAU, speed: 1.0 }],
        }
    }
}
