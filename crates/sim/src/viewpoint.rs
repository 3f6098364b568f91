//! Poses and motions of cameras in space.

use slate_module::math::{cos, sin};

/// Vector in space, m.
pub(crate) type Vector = [f64; 3];

/// Returns the inner product.
pub(crate) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns `a` plus `b` times a factor.
pub(crate) fn plus(a: Vector, b: Vector, factor: f64) -> Vector {
    [a[0] + b[0] * factor, a[1] + b[1] * factor, a[2] + b[2] * factor]
}

/// Position and orientation of a camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraPose {
    /// Optical center in the world, m.
    pub origin: Vector,
    /// Axes of its optical frame in the world: right, down and forward.
    pub axes: [Vector; 3],
}

impl CameraPose {
    /// Creates the pose of a camera from yaw and pitch.
    /// Yaw is in rad counter-clockwise from x, pitch in rad downwards.
    pub fn new(origin: Vector, yaw: f64, pitch: f64) -> Self {
        let ((sin_yaw, cos_yaw), (sin_pitch, cos_pitch)) = ((sin(yaw), cos(yaw)), (sin(pitch), cos(pitch)));
        let right = [sin_yaw, -cos_yaw, 0.0];
        let down = [-sin_pitch * cos_yaw, -sin_pitch * sin_yaw, -cos_pitch];
        let forward = [cos_yaw * cos_pitch, sin_yaw * cos_pitch, -sin_pitch];
        Self { origin, axes: [right, down, forward] }
    }

    /// Rotates a direction of the world to the optical frame.
    pub fn turn(&self, direction: Vector) -> Vector {
        self.axes.map(|axis| dot(axis, direction))
    }

    /// Transforms a point of the world to the optical frame.
    pub fn local(&self, point: Vector) -> Vector {
        self.turn(plus(point, self.origin, -1.0))
    }
}

/// Twist of a camera in its own optical frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct CameraMotion {
    /// Linear velocity, m/s.
    pub linear: Vector,
    /// Angular velocity, rad/s.
    pub angular: Vector,
}
