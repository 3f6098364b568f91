//! A positioning system with a compass.

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::wrap_angle;

use crate::geometry::{Point, Pose};
use crate::rate::due;
use crate::robot::PositioningDescription;

/// Measurement of a positioning system; what is missing was not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fix {
    /// Position in the world, metres.
    pub position: Option<Point>,
    /// Heading, counter-clockwise from x, radians.
    pub orientation: Option<f64>,
}

/// Measures where a robot is.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PositioningSystem {
    description: PositioningDescription,
    random: Random,
    /// When it measured last, nanoseconds.
    last: Option<u64>,
}

impl PositioningSystem {
    /// The positioning system of a robot whose noise comes from that stream.
    pub fn new(description: PositioningDescription, random: Random) -> Self {
        Self { description, random, last: None }
    }

    /// Measures the pose, if it is time to; `now` in nanoseconds.
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
