//! Motion by the odometry, by which frozen sensors show.

use slate_plugin::interfaces::{Odometry, Pose2};
use slate_plugin::mapek::Device;
use slate_plugin::prelude::*;

/// Turn by the odometry that proves an equal direction frozen, radians.
/// The direction is a measured one that stays the same.
pub const FROZEN_TURN: f64 = 0.1;
/// Heading drift of odometry per travel, rad/m.
/// Four standard deviations of wheels whose radii err by 1 %, 0.33 m apart.
///
/// An exact compass measures the same all along a straight path.
const DRIFT: f64 = 0.2;

/// Returns true if a robot has turned, by travel (m) and turn (rad) of odometry.
pub fn has_turned(travel: f64, turn: f64) -> bool {
    turn > FROZEN_TURN + DRIFT * travel
}

/// Pose by the odometry, and when it was measured.
#[derive(Clone, Copy)]
pub struct TraveledPose {
    /// Pose in the frame of the odometry.
    pub pose: Pose2,
    /// Nanoseconds.
    pub time: u64,
}

impl TraveledPose {
    /// Returns the newest one.
    pub fn of(odometry: &Input<Odometry>) -> Option<Self> {
        Some(Self { pose: odometry.get()?.pose, time: odometry.stamp().time })
    }

    /// Returns true if the odometry was late until now.
    /// `last` is the time of its previous measurement (ns), and becomes that of this one.
    ///
    /// Late odometry reports a motion when the robot may stand again.
    pub fn follows_gap(self, last: &mut u64) -> bool {
        let last = std::mem::replace(last, self.time);
        self.time.saturating_sub(last) as f64 * 1e-9 > Device::default().late_after()
    }
}
