use serde::{Deserialize, Serialize};

use crate::look_ahead::Sides;

/// Limits and margins of an [`Avoider`](crate::Avoider).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// Maximum linear velocity, m/s.
    pub max_linear_velocity: f64,
    /// Maximum linear velocity backward, m/s.
    pub max_reverse_velocity: f64,
    /// Maximum angular velocity, rad/s.
    pub max_angular_velocity: f64,
    /// Deceleration, m/s².
    pub deceleration: f64,
    /// Angular deceleration, rad/s².
    pub angular_deceleration: f64,
    /// Latency from an echo to its effect on the wheels, seconds.
    pub reaction_time: f64,
    /// Bearing of the goal above which the planner turns on the spot, radians.
    pub heading_tolerance: f64,
    /// Minimum clearance from static obstacles, meters.
    pub min_clearance: f64,
    /// Maximum speed of unknown obstacles, m/s.
    pub max_obstacle_speed: f64,
    /// Age below which an obstacle may be moving, seconds.
    pub new_obstacle_time: f64,
    /// Clearance on both sides of a free straight path, meters.
    pub side_clearance: f64,
    /// Additional clearance to hand back to the planner (hysteresis), meters.
    pub side_clearance_hysteresis: f64,
    /// Distance over which the straight path must be free, meters.
    pub lookahead_distance: f64,
    /// Period of decisions, seconds.
    pub decision_period: f64,
    /// Age after which an obstacle without an echo is forgotten, seconds.
    pub obstacle_timeout: f64,
    /// Weight of a miss against a hit, 0 to 1.
    /// A high weight follows moving obstacles; sonars with many misses need about 0.03.
    pub miss_weight: f64,
    /// Age of the newest scan above which the robot stops, seconds.
    pub scan_timeout: f64,
    /// Time without progress after which recovery begins, seconds.
    pub progress_timeout: f64,
    /// Half the side of a known square room about the origin, meters.
    pub room_half_width: Option<f64>,
    /// Response of the wheels, if it is slow.
    /// Motions are then predicted from the present twist.
    pub sides: Option<Sides>,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            max_linear_velocity: 0.4,
            max_reverse_velocity: 0.1,
            max_angular_velocity: 1.2,
            deceleration: 0.8,
            angular_deceleration: 3.0,
            reaction_time: 0.15,
            heading_tolerance: 0.2,
            min_clearance: 0.025,
            max_obstacle_speed: 0.15,
            new_obstacle_time: 1.0,
            side_clearance: 0.05,
            side_clearance_hysteresis: 0.03,
            lookahead_distance: 0.9,
            decision_period: 0.1,
            obstacle_timeout: 6.0,
            miss_weight: 0.3,
            scan_timeout: 0.3,
            progress_timeout: 4.0,
            room_half_width: None,
            sides: None,
        }
    }
}
