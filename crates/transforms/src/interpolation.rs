use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector4};

/// Cosine of half the angle above which linear interpolation is exact enough.
/// The sine is then too small to divide by.
const STRAIGHT: f64 = 0.999_999;

/// Interpolates between two transforms, with `part` from 0 to 1.
/// Translation linearly, rotation spherically (slerp).
pub(crate) fn between(first: &Isometry3<f64>, second: &Isometry3<f64>, part: f64) -> Isometry3<f64> {
    let (from, to) = (first.translation.vector, second.translation.vector);
    let translation = Translation3::from(from + (to - from) * part);
    Isometry3::from_parts(translation, turn(&first.rotation, &second.rotation, part))
}

/// Interpolates a rotation spherically (slerp).
/// nalgebra's own has the standard library's sine, which differs between machines, and refuses half a turn.
fn turn(first: &UnitQuaternion<f64>, second: &UnitQuaternion<f64>, part: f64) -> UnitQuaternion<f64> {
    let (from, mut to) = (first.as_vector(), *second.as_vector());
    let mut cosine = from.dot(&to);
    if cosine < 0.0 {
        // The same rotation, and nearer.
        (cosine, to) = (-cosine, -to);
    }
    let (a, b) = if cosine > STRAIGHT {
        (1.0 - part, part)
    } else {
        let angle = libm::acos(cosine);
        let sine = libm::sin(angle);
        (libm::sin((1.0 - part) * angle) / sine, libm::sin(part * angle) / sine)
    };
    unit(from * a + to * b)
}

/// Normalizes a vector that is not zero.
fn unit(vector: Vector4<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::from(vector))
}

/// Normalizes the rotation of a transform: products drift by rounding.
pub(crate) fn normalized(transform: &Isometry3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(transform.translation, unit(*transform.rotation.as_vector()))
}
