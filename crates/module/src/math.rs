//! Mathematics that gives the same bits on every machine and in every build.
//!
//! The standard library's functions differ between platforms and optimisation levels; these are libm's, and
//! `min`, `max` treat signed zero and NaN in one defined way.

use std::f64::consts::PI;

pub use libm::{acos, asin, atan, atan2, cos, exp, hypot, log as ln, pow, sin, tan};

/// The smaller number; the first when they compare equal or one is not a number.
pub fn min(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The larger number; the first when they compare equal or one is not a number.
pub fn max(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// `value` held between `low` and `high`; `low` when it is not a number.
pub fn clamp(value: f64, low: f64, high: f64) -> f64 {
    if value > high {
        high
    } else if value >= low {
        value
    } else {
        low
    }
}

/// The same angle in (-pi, pi], radians.
pub fn wrap_angle(angle: f64) -> f64 {
    let turns = libm::floor((angle + PI) / (2.0 * PI));
    let wrapped = angle - turns * 2.0 * PI;
    if wrapped <= -PI { wrapped + 2.0 * PI } else { wrapped }
}

/// The shortest turn from one heading to another in (-pi, pi], radians, counter-clockwise positive.
pub fn angle_between(from: f64, to: f64) -> f64 {
    wrap_angle(to - from)
}
