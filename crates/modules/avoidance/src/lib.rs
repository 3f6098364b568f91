//! Obstacle avoidance with a ring of sonars.
//!
//! [`Avoider`] is a local planner on a small [`LocalMap`] of echoes. Each step decides whether the straight path to the goal is free
//! ([`Decision::Clear`]: the planner may drive) or which twist avoids the obstacles ([`Decision::Avoid`]). [`Rocs`] is the published control
//! law of the authors of RoCS, as a baseline.
//!
//! Everything here is plain data and pure computation: no clock, no thread, no allocation per step, and the same
//! bits on every machine. Units are SI; x points forward, y left, angles turn counter-clockwise.

mod avoider;
mod field;
mod footprint;
mod look_ahead;
mod map;
mod motion;
mod other;
mod parameters;
mod reflex;
mod rocs;

pub use avoider::{Avoider, Decision, approach_speed};
pub use footprint::{Footprint, FootprintError};
pub use look_ahead::{Course, PREDICTIONS, Sides};
pub use map::{LocalMap, Mark};
pub use other::Other;
pub use parameters::Parameters;
pub use reflex::{
    Disc, MAX_DISTANCE, Maneuver, ROBOT_SENSOR, ReflexInput, ReflexRules, RuleError, SONAR, SensorRule, react,
};
pub use rocs::{Rocs, RocsVariant};
