//! Estimates from particles.

use slate_interfaces::{Particle, Pose2, PoseEstimate};
use slate_module::math;

/// Returns mean and covariance of particles.
pub(crate) fn moments<'a, I: Iterator<Item = &'a Particle>>(particles: impl Fn() -> I) -> PoseEstimate {
    let (mut weight, mut x, mut y, mut sine, mut cosine) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for Particle { pose, weight: own } in particles() {
        weight += own;
        x += own * pose.x;
        y += own * pose.y;
        sine += own * math::sin(pose.theta);
        cosine += own * math::cos(pose.theta);
    }
    let pose = Pose2 { x: x / weight, y: y / weight, theta: math::atan2(sine, cosine) };
    let mut covariance = [0.0; 9];
    for particle in particles() {
        let other = particle.pose;
        let error = [other.x - pose.x, other.y - pose.y, math::angle_between(pose.theta, other.theta)];
        for (at, entry) in covariance.iter_mut().enumerate() {
            *entry += particle.weight / weight * error[at / 3] * error[at % 3];
        }
    }
    PoseEstimate { pose, covariance }
}

/// Returns the pose in a frame of one that is in the frame of `origin`.
pub(crate) fn compose(origin: &Pose2, pose: &Pose2) -> Pose2 {
    let (sine, cosine) = (math::sin(origin.theta), math::cos(origin.theta));
    Pose2 {
        x: origin.x + pose.x * cosine - pose.y * sine,
        y: origin.y + pose.x * sine + pose.y * cosine,
        theta: math::wrap_angle(origin.theta + pose.theta),
    }
}

/// Returns a pose in the frame of another one.
pub(crate) fn relative(origin: &Pose2, pose: &Pose2) -> Pose2 {
    let (sine, cosine) = (math::sin(origin.theta), math::cos(origin.theta));
    let (across, up) = (pose.x - origin.x, pose.y - origin.y);
    Pose2 {
        x: across * cosine + up * sine,
        y: up * cosine - across * sine,
        theta: math::angle_between(origin.theta, pose.theta),
    }
}
