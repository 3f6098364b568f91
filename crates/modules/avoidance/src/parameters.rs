use serde::{Deserialize, Serialize};

use crate::look_ahead::Sides;

/// What an [`Avoider`](crate::Avoider) may do and how careful it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// Highest speed forward, m/s.
    pub speed: f64,
    /// Highest speed backward, m/s.
    pub reverse_speed: f64,
    /// Highest rate of turn, rad/s.
    pub turn_rate: f64,
    /// How hard the robot can brake, m/s2.
    pub deceleration: f64,
    /// How hard the robot can stop turning, rad/s2.
    pub angular_deceleration: f64,
    /// Time from a sonar's echo to its effect on the wheels, seconds.
    pub reaction_time: f64,
    /// The planner turns on the spot when the goal is farther than this from straight ahead, radians.
    pub heading_tolerance: f64,
    /// Least distance to what is known to stand, metres.
    pub margin: f64,
    /// How fast other things may move, m/s.
    pub other_speed: f64,
    /// What appeared within this time may be moving, seconds.
    pub newcomer_time: f64,
    /// The straight way counts as free when this much room is left on both sides, metres.
    pub side_room: f64,
    /// Further room needed to hand back to the planner, so that the route does not flicker, metres.
    pub side_room_hysteresis: f64,
    /// How far ahead the straight way must be free, metres.
    pub look_ahead: f64,
    /// Time between two choices of a motion, seconds.
    pub period: f64,
    /// After this time without an echo a mark in the map is forgotten, seconds.
    pub memory: f64,
    /// How much one silent scan counts against what was heard at a place, 0 to 1. Much lets the robot follow what
    /// moves; sonars that often miss what is there need little, about 0.03.
    pub silence: f64,
    /// Without a scan for longer than this the robot stands still, seconds.
    pub scan_age: f64,
    /// Without progress for this time the robot tries to get out, seconds.
    pub patience: f64,
    /// The room is known to reach so far from the origin of the world to each side, metres, if it is known.
    pub room: Option<f64>,
    /// How the robot's sides follow commands, if that is slow: then motions are judged by how the
    /// robot moves already.
    pub sides: Option<Sides>,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            speed: 0.4,
            reverse_speed: 0.1,
            turn_rate: 1.2,
            deceleration: 0.8,
            angular_deceleration: 3.0,
            reaction_time: 0.15,
            heading_tolerance: 0.2,
            margin: 0.025,
            other_speed: 0.15,
            newcomer_time: 1.0,
            side_room: 0.05,
            side_room_hysteresis: 0.03,
            look_ahead: 0.9,
            period: 0.1,
            memory: 6.0,
            silence: 0.3,
            scan_age: 0.3,
            patience: 4.0,
            room: None,
            sides: None,
        }
    }
}
