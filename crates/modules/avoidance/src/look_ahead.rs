//! What a robot can do in the next seconds, when its wheels speed up and slow down only so fast.

use serde::{Deserialize, Serialize};
use slate_interfaces::{Pose2, Twist2};
use slate_module::math;

/// How the sides of a robot follow commands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sides {
    /// From side to side as it turns, metres.
    pub track: f64,
    /// How fast a side changes its speed, m/s2.
    pub acceleration: f64,
}

/// Where a robot is and how it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Course {
    /// In the world.
    pub pose: Pose2,
    /// How it moves now.
    pub motion: Twist2,
}

/// Looks at the first of two motions, and at the second.
const FIRST: u32 = 4;
const SECOND: u32 = 12;
/// So often [`Sides::best`] looks at what comes.
pub const LOOKS: u32 = FIRST + SECOND;

impl Sides {
    /// Where a robot is that was told to move so for `time` seconds, which are few.
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

    /// Which of the motions in `first` to begin with, when one of those in `second` comes after it: that from which the
    /// least `cost` follows, summed over places at times (seconds from now), every `interval` (seconds). A motion comes with
    /// a cost of its own.
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
                for step in FIRST + 1..=LOOKS {
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
