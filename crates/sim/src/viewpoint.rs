//! Poses and motions of cameras in space.

use slate_module::math::{cos, sin};

/// A vector in space, metres.
pub(crate) type Vector = [f64; 3];

/// The inner product.
pub(crate) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a` plus `b` times a factor.
pub(crate) fn plus(a: Vector, b: Vector, factor: f64) -> Vector {
    [a[0] + b[0] * factor, a[1] + b[1] * factor, a[2] + b[2] * factor]
}

/// Where a camera is, and how it is turned.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraPose {
    /// Optical centre in the world, m.
    pub origin: Vector,
    /// Axes of its optical frame in the world: right, down and forward.
    pub axes: [Vector; 3],
}

impl CameraPose {
    /// A camera that looks along a yaw, rad counter-clockwise from x, and a pitch, rad downwards.
    pub fn new(origin: Vector, yaw: f64, pitch: f64) -> Self {
        let ((sin_yaw, cos_yaw), (sin_pitch, cos_pitch)) = ((sin(yaw), cos(yaw)), (sin(pitch), cos(pitch)));
        let right = [sin_yaw, -cos_yaw, 0.0];
        let down = [-sin_pitch * cos_yaw, -sin_pitch * sin_yaw, -cos_pitch];
        let forward = [cos_yaw * cos_pitch, sin_yaw * cos_pitch, -sin_pitch];
        Self { origin, axes: [right, down, forward] }
    }

    /// A direction of the world in the optical frame.
    pub fn turn(&self, direction: Vector) -> Vector {
        self.axes.map(|axis| dot(axis, direction))
    }

    /// A point of the world in the optical frame.
    pub fn local(&self, point: Vector) -> Vector {
        self.turn(plus(point, self.origin, -1.0))
    }
}

/// How a camera moves, in its own optical frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct CameraMotion {
    /// m/s.
    pub linear: Vector,
    /// rad/s.
    pub angular: Vector,
}
