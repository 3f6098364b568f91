//! Positioning system with a compass.

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::wrap_angle;

use crate::geometry::{Point, Pose};
use crate::rate::due;
use crate::robot::PositioningDescription;

/// Measurement of a positioning system; `None` for missing values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fix {
    /// Position in the world, m.
    pub position: Option<Point>,
    /// Heading, counter-clockwise from x, rad.
    pub orientation: Option<f64>,
}

/// Positioning system with its errors.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PositioningSystem {
    description: PositioningDescription,
    random: Random,
    /// Time of the last measurement, ns.
    last: Option<u64>,
}

impl PositioningSystem {
    /// Creates the system of a robot; `random` is the stream of its noise.
    pub fn new(description: PositioningDescription, random: Random) -> Self {
        Self { description, random, last: None }
    }

    /// Measures the pose if a measurement is due at `now`, ns.
    pub fn measure(&mut self, truth: Pose, now: u64) -> Fix {
        let PositioningDescription { noise_position, noise_orientation, dropout, rate } = self.description;
        if rate.is_some_and(|rate| !due(rate, 0.0, self.last, now)) {
            return Fix::default();
        }
        self.last = Some(now);
        let mut pose = truth;
        if noise_position > 0.0 || noise_orientation > 0.0 {
            pose.x += noise_position * self.random.normal();
            pose.y += noise_position * self.random.normal();
            pose.theta = wrap_angle(pose.theta + noise_orientation * self.random.normal());
        }
        let mut lost = || dropout > 0.0 && self.random.unit() < dropout;
        let (no_position, no_orientation) = (lost(), lost());
        Fix {
            position: (!no_position).then(|| pose.point()),
            orientation: (!no_orientation).then_some(pose.theta),
        }
    }
}
