//! Rigid motions of the plane, SE(2).

use nalgebra::Matrix3;
use slate_interfaces::Pose2;
use slate_module::math;

/// Returns the composition of `first` and `second`.
/// `second` is in the frame of `first`; the result is in the parent frame of `first`.
pub fn compose(first: Pose2, second: Pose2) -> Pose2 {
    let [x, y] = transform(first, [second.x, second.y]);
    Pose2 { x, y, theta: math::wrap_angle(first.theta + second.theta) }
}

/// Returns `to` in the frame of `from`.
pub fn relative(from: Pose2, to: Pose2) -> Pose2 {
    let (sine, cosine) = (math::sin(from.theta), math::cos(from.theta));
    let (right, up) = (to.x - from.x, to.y - from.y);
    Pose2 {
        x: right * cosine + up * sine,
        y: up * cosine - right * sine,
        theta: math::angle_between(from.theta, to.theta),
    }
}

/// Returns a point in the frame of a pose, in the frame of the pose itself.
pub fn transform(pose: Pose2, [x, y]: [f64; 2]) -> [f64; 2] {
    let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
    [pose.x + x * cosine - y * sine, pose.y + x * sine + y * cosine]
}

/// Returns points in the frame of a pose, in the frame of the pose itself.
pub(crate) fn transform_all(pose: Pose2, points: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> {
    let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
    points.iter().map(move |[x, y]| [pose.x + x * cosine - y * sine, pose.y + x * sine + y * cosine])
}

/// Returns the inverse covariance of x, y and theta in a rotated frame.
/// The frame of `information` is turned by the angle in it.
pub(crate) fn turned(information: Matrix3<f64>, angle: f64) -> Matrix3<f64> {
    let (sine, cosine) = (math::sin(angle), math::cos(angle));
    let rotation = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
    rotation * information * rotation.transpose()
}

/// Returns the distance between two poses, m.
pub(crate) fn distance(a: Pose2, b: Pose2) -> f64 {
    math::hypot(b.x - a.x, b.y - a.y)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pose() -> impl Strategy<Value = Pose2> {
        (-9.0..9.0_f64, -9.0..9.0_f64, -3.0..3.0_f64).prop_map(|(x, y, theta)| Pose2 { x, y, theta })
    }

    proptest! {
        #[test]
        fn relative_undoes_compose(a in pose(), b in pose()) {
            let found = relative(a, compose(a, b));
            prop_assert!(distance(found, b) < 1e-9 && math::angle_between(found.theta, b.theta).abs() < 1e-9);
        }
    }
}
