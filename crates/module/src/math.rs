//! Mathematics with the same bits on every machine and in every build.
//!
//! The standard library's functions differ between platforms and optimization levels; these are libm's, and
//! `min`, `max` treat signed zero and NaN in one defined way.

use std::f64::consts::PI;

pub use libm::{acos, asin, atan, atan2, cos, exp, hypot, log as ln, pow, sin, tan};

/// Returns the smaller number; the first if equal or one is not a number.
pub fn min(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// Returns the larger number; the first if equal or one is not a number.
pub fn max(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// Clamps `value` to `low..=high`; `low` if it is not a number.
pub fn clamp(value: f64, low: f64, high: f64) -> f64 {
    if value > high {
        high
    } else if value >= low {
        value
    } else {
        low
    }
}

/// Wraps an angle to (-pi, pi], rad.
pub fn wrap_angle(angle: f64) -> f64 {
    let turns = libm::floor((angle + PI) / (2.0 * PI));
    let wrapped = angle - turns * 2.0 * PI;
    if wrapped <= -PI { wrapped + 2.0 * PI } else { wrapped }
}

/// Returns the signed angle between two headings in (-pi, pi], rad.
/// It is the shortest turn from one to the other, counter-clockwise positive.
pub fn angle_between(from: f64, to: f64) -> f64 {
    wrap_angle(to - from)
}
