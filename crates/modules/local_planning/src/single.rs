//! Mathematics in single precision, in forms that a compiler vectorizes.

/// Returns the smaller number; the first when one is not a number.
#[inline(always)]
pub(crate) fn min(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// Returns the larger number; the first when one is not a number.
#[inline(always)]
pub(crate) fn max(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// Returns `value`, clamped to `low` and `high`.
#[inline(always)]
pub(crate) fn clamp(value: f32, low: f32, high: f32) -> f32 {
    min(max(value, low), high)
}

/// Returns sine and cosine of an angle up to 1 rad.
/// The error is below 3e-6 (Taylor).
#[inline(always)]
pub(crate) fn small_sin_cos(angle: f32) -> (f32, f32) {
    let square = angle * angle;
    let sine = angle * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)));
    let cosine = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)));
    (sine, cosine)
}

/// Returns an angle in [-pi, pi] that is the same; of up to a million turns.
#[inline(always)]
pub(crate) fn wrap_angle(angle: f32) -> f32 {
    use std::f32::consts::TAU;
    // Adding it rounds to whole numbers, as its last digit is one.
    const ROUND: f32 = 12_582_912.0;
    let turns = (angle / TAU + ROUND) - ROUND;
    angle - turns * TAU
}
