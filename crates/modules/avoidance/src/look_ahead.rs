//! Prediction over the next seconds with limited acceleration of the wheels.

use serde::{Deserialize, Serialize};
use slate_interfaces::{Pose2, Twist2};
use slate_module::math;

/// Response of the wheels of each side to commands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sides {
    /// Effective track width, meters.
    pub track: f64,
    /// Acceleration of a side, m/s².
    pub acceleration: f64,
}

/// Pose and twist of a robot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Course {
    /// Pose in the map frame.
    pub pose: Pose2,
    /// Present twist.
    pub motion: Twist2,
}

/// Predictions of the first of two motions, and of the second.
const FIRST: u32 = 4;
const SECOND: u32 = 12;
/// Number of predictions of [`Sides::best`].
pub const PREDICTIONS: u32 = FIRST + SECOND;

impl Sides {
    /// Predicts pose and twist after a command of `time` seconds, which must be short.
    pub fn after(&self, course: Course, motion: Twist2, time: f64) -> Course {
        let half = self.track / 2.0;
        let most = self.acceleration * time;
        let follow = |is: f64, wanted: f64| is + math::clamp(wanted - is, -most, most);
        let Course { pose, motion: Twist2 { linear, angular } } = course;
        let left = follow(linear - angular * half, motion.linear - motion.angular * half);
        let right = follow(linear + angular * half, motion.linear + motion.angular * half);
        let now = Twist2 { linear: (left + right) / 2.0, angular: (right - left) / self.track };
        let turn = (angular + now.angular) / 2.0 * time;
        let way = (linear + now.linear) / 2.0 * time;
        let direction = pose.theta + turn / 2.0;
        Course {
            pose: Pose2 {
                x: pose.x + way * math::cos(direction),
                y: pose.y + way * math::sin(direction),
                theta: pose.theta + turn,
            },
            motion: now,
        }
    }

    /// Returns the cheapest motion of `first`, followed by one of `second`.
    ///
    /// `cost` is summed over predicted poses every `interval` seconds; each motion has a cost of its own.
    pub fn best(
        &self,
        course: Course,
        interval: f64,
        first: impl Iterator<Item = (Twist2, f64)>,
        second: impl Iterator<Item = Twist2> + Clone,
        cost: impl Fn(Pose2, f64) -> f64,
    ) -> Option<Twist2> {
        let mut best = None;
        let mut least = f64::INFINITY;
        for (motion, own) in first {
            let (mut there, mut begun) = (course, own);
            for step in 1..=FIRST {
                there = self.after(there, motion, interval);
                begun += cost(there.pose, interval * f64::from(step));
            }
            for next in std::iter::once(motion).chain(second.clone()) {
                let (mut there, mut sum) = (there, begun);
                for step in FIRST + 1..=PREDICTIONS {
                    // It can only get dearer.
                    if sum >= least {
                        break;
                    }
                    there = self.after(there, next, interval);
                    sum += cost(there.pose, interval * f64::from(step));
                }
                if sum < least {
                    (best, least) = (Some(motion), sum);
                }
            }
        }
        best
    }
}
