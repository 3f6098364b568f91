//! Sonars that repeat an echo while the robot moves.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Echo, Pose2, SonarScan};
use slate_plugin::mapek::Device;
use slate_plugin::prelude::*;

use crate::traveled_pose::{TraveledPose, has_turned};

/// Displacement along a sonar's axis that proves an equal echo frozen, meters.
const DISPLACEMENT: f64 = 0.05;
/// Greatest ratio of the displacement across a sonar's axis to that along it.
///
/// A sonar that looks farther aside, at 31 degrees, may hear a wall along the way, whose range stays the same.
const MAX_LATERAL_RATIO: f64 = 0.6;

/// Detects sonars that repeat an echo, to the last bit, while the odometry moves.
///
/// An echo counts as repeated when it is the same for as long as makes a device late, and the robot has meanwhile moved 0.05 m along
/// the sonar's axis, or turned by 0.1 rad and 0.2 rad for each meter. A sonar that hears nothing, or at a limit of its range, tells nothing.
#[derive(Default, Serialize, Deserialize)]
pub struct FrozenSonars {
    held: [HeldEcho; 16],
    /// Time since which a sonar has been frozen, ns.
    since: Option<u64>,
    /// Time of the newest odometry, ns.
    #[serde(default)]
    odometry_at: u64,
}

/// Repeated echo, with the time and pose of its first occurrence.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
struct HeldEcho {
    /// Range, m; zero without an echo.
    range: f64,
    /// Nanoseconds.
    since: u64,
    /// x, y (m) and heading (rad) in the frame of the odometry.
    place: [f64; 3],
}

impl FrozenSonars {
    /// Adds the newest measurements; returns the time since which one is frozen, ns.
    pub fn update(
        &mut self,
        scan: Option<&SonarScan>,
        odometry: Option<TraveledPose>,
        device: Option<&Device>,
        now: &Tick,
    ) -> Option<u64> {
        if odometry.is_some_and(|odometry| odometry.follows_gap(&mut self.odometry_at)) {
            self.held = Default::default();
        }
        let (Some(scan), Some(odometry)) = (scan, odometry) else { return self.since };
        let late_after = device.map_or_else(|| Device::default().late_after(), Device::late_after);
        self.since = None;
        let sonars = scan.echoes.iter().zip(scan.placements.iter());
        for (held, (echo, placement)) in self.held.iter_mut().zip(sonars) {
            let range = if is_telling(echo, scan) { echo.range } else { 0.0 };
            if range == 0.0 || range.to_bits() != held.range.to_bits() {
                let Pose2 { x, y, theta } = odometry.pose;
                *held = HeldEcho { range, since: now.now(), place: [x, y, theta] };
            } else if now.now().saturating_sub(held.since) as f64 * 1e-9 > late_after
                && held.must_have_changed(odometry.pose, placement.theta)
            {
                self.since = Some(self.since.map_or(held.since, |since| since.min(held.since)));
            }
        }
        self.since
    }
}

impl HeldEcho {
    /// Returns whether the range in this direction (rad) must have changed.
    ///
    /// The pose is that of now, in the frame of the odometry.
    fn must_have_changed(&self, pose: Pose2, direction: f64) -> bool {
        let [x, y, theta] = self.place;
        let (east, north) = (pose.x - x, pose.y - y);
        let (sine, cosine) = (math::sin(theta + direction), math::cos(theta + direction));
        let along = (east * cosine + north * sine).abs();
        let aside = (north * cosine - east * sine).abs();
        (along > DISPLACEMENT && aside < MAX_LATERAL_RATIO * along)
            || has_turned(math::hypot(along, aside), math::angle_between(theta, pose.theta).abs())
    }
}

/// Returns whether an echo is within the range of the sonars.
fn is_telling(echo: &Echo, scan: &SonarScan) -> bool {
    echo.heard.get() && echo.range > scan.range_min && echo.range < scan.range_max
}
