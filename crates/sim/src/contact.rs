//! Contacts and their causes.

use serde::{Deserialize, Serialize};

use crate::geometry::Point;

/// Distance up to which a contact lasts, m.
/// It begins when bodies press on each other.
pub const TOUCH: f64 = 0.002;

/// Distance beyond which bodies did not begin to touch, m.
pub const GRAZE: f64 = 0.0005;

/// Approach speed above which a robot counts as the cause of a contact, m/s.
pub const CAUSE_SPEED: f64 = 0.01;

/// Separation time after which a pair touches anew, ns.
pub const SEPARATION_TIME: u64 = 100_000_000;

/// Beginning of a contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// Virtual time, ns.
    pub time: u64,
    /// The robot.
    pub robot: String,
    /// Other body: a robot or a static one.
    pub other: String,
    /// Causation by the robot: true if it moved towards the other body.
    pub caused: bool,
    /// Causation by the other body: true if it is a robot and moved towards this one.
    pub caused_by_other: bool,
    /// Closing speed of the drives along the contact's normal, m/s.
    pub approach: f64,
}

/// Motion of a body: origin, its velocity, and angular velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Reference point, m.
    pub origin: Point,
    /// Velocity of the reference point, m/s.
    pub velocity: Point,
    /// Angular velocity, rad/s.
    pub angular: f64,
}

impl Motion {
    /// Returns the velocity of the body at a point of the world.
    pub fn at(&self, point: Point) -> Point {
        let arm = point.minus(self.origin);
        Point::new(self.velocity.x - self.angular * arm.y, self.velocity.y + self.angular * arm.x)
    }

    /// Returns the speed of the body's point along a direction of length 1, m/s.
    pub fn towards(&self, point: Point, direction: Point) -> f64 {
        self.at(point).dot(direction)
    }
}
