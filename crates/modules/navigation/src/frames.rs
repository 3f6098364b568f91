//! Changes of frames in the plane.

use slate_plugin::interfaces::{Point2, Pose2};
use slate_plugin::prelude::*;

/// Rigid motion in the plane: the pose of a frame in another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarTransform {
    x: f64,
    y: f64,
    theta: f64,
    sine: f64,
    cosine: f64,
}

impl PlanarTransform {
    /// Returns the transform of points of a frame at that pose.
    pub fn of(pose: &Pose2) -> Self {
        let Pose2 { x, y, theta } = *pose;
        Self { x, y, theta, sine: math::sin(theta), cosine: math::cos(theta) }
    }

    /// Returns the transform between frames.
    /// It follows from the poses of the same robot in both.
    pub fn between(from: &Pose2, to: &Pose2) -> Self {
        let theta = math::wrap_angle(to.theta - from.theta);
        let turn = Self::of(&Pose2 { x: 0.0, y: 0.0, theta });
        let [x, y] = turn.point([from.x, from.y]);
        Self { x: to.x - x, y: to.y - y, ..turn }
    }

    /// Transforms a point.
    pub fn point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.x + x * self.cosine - y * self.sine, self.y + x * self.sine + y * self.cosine]
    }

    /// Transforms a point.
    pub fn point2(&self, point: Point2) -> Point2 {
        let [x, y] = self.point([point.x, point.y]);
        Point2 { x, y }
    }

    /// Transforms a heading, rad.
    pub fn heading(&self, theta: f64) -> f64 {
        math::wrap_angle(theta + self.theta)
    }

    /// Transforms a pose.
    pub fn pose(&self, pose: &Pose2) -> Pose2 {
        let [x, y] = self.point([pose.x, pose.y]);
        Pose2 { x, y, theta: self.heading(pose.theta) }
    }

    /// Returns a point of the outer frame in the frame at the pose.
    pub fn inverse_point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (across, up) = (x - self.x, y - self.y);
        [across * self.cosine + up * self.sine, up * self.cosine - across * self.sine]
    }
}

/// Returns the distance between two points, m.
pub fn distance(a: Point2, b: Point2) -> f64 {
    math::hypot(b.x - a.x, b.y - a.y)
}
