//! Contacts and their causes.

use serde::{Deserialize, Serialize};

use crate::geometry::Point;

/// A contact begins when bodies press on each other and lasts while they are nearer than this, metres.
pub const TOUCH: f64 = 0.002;

/// Bodies that are still farther apart than this did not begin to touch, metres.
pub const GRAZE: f64 = 0.0005;

/// A robot caused a contact if it moved towards the other faster than this, metres per second.
pub const CAUSE_SPEED: f64 = 0.01;

/// A pair touches anew only after it was apart for this long, nanoseconds.
pub const APART: u64 = 100_000_000;

/// A contact that began.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// Virtual time, nanoseconds.
    pub time: u64,
    /// The robot.
    pub robot: String,
    /// Other body: a robot or a static one.
    pub other: String,
    /// Whether the robot moved in.
    pub caused: bool,
    /// Whether the other, if it is a robot, moved in.
    pub caused_by_other: bool,
    /// How fast their drives brought the two together along the contact's normal, metres per second.
    pub approach: f64,
}

/// Motion of a body: origin, its velocity, and angular velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// The reference point, metres.
    pub origin: Point,
    /// Metres per second.
    pub velocity: Point,
    /// Radians per second.
    pub angular: f64,
}

impl Motion {
    /// The velocity of the body's point that is now there.
    pub fn at(&self, point: Point) -> Point {
        let arm = point.minus(self.origin);
        Point::new(self.velocity.x - self.angular * arm.y, self.velocity.y + self.angular * arm.x)
    }

    /// How fast the body's point there moves into a direction of length 1, metres per second.
    pub fn towards(&self, point: Point, direction: Point) -> f64 {
        self.at(point).dot(direction)
    }
}
