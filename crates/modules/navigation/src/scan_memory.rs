//! Obstacles out of sight.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use slate_local_planning::ObservationBuffer;
use slate_plugin::interfaces::{LaserScan, Pose2};
use slate_plugin::prelude::*;

use crate::frames::PlanarTransform;

/// Time between scans that are remembered, s.
const INTERVAL: f64 = 0.5;
/// Distance within which a beam and a point are the same, m.
const SAME: f64 = 0.1;

/// Memory of scans with ray tracing, as in Nav2's obstacle layer.
/// A later scan clears the points that it sees through.
#[derive(Debug, Serialize, Deserialize)]
pub struct ScanMemory {
    scans: ObservationBuffer,
    /// Persistence that the memory has room for, s.
    persistence: f64,
    /// Points of the newest scan, and whether there is one.
    newest: usize,
    #[serde(skip)]
    hits: Vec<[f64; 2]>,
}

impl Default for ScanMemory {
    fn default() -> Self {
        Self::new(0.0)
    }
}

impl ScanMemory {
    fn new(persistence: f64) -> Self {
        Self {
            scans: ObservationBuffer::new(persistence, INTERVAL),
            persistence,
            newest: 0,
            hits: Vec::new(),
        }
    }

    /// Adds a scan from a pose of the laser at a time, s.
    /// Beams up to `max_range` (m) that hit an obstacle mark it.
    pub fn insert(&mut self, scan: &LaserScan, laser: &Pose2, limits: &MemoryLimits, time: f64) {
        if self.persistence != limits.persistence {
            *self = Self::new(limits.persistence);
        }
        let most = math::min(limits.max_range, scan.range_max);
        let step = scan.ranges.len().div_ceil(limits.max_beams.max(1)).max(1);
        self.hits.clear();
        for (beam, range) in scan.ranges.iter().enumerate().step_by(step) {
            let range = f64::from(*range);
            // False for NaN, too.
            if range >= scan.range_min && range < most {
                let angle = scan.angle_min + beam as f64 * scan.angle_increment;
                self.hits.push([range * math::cos(angle), range * math::sin(angle)]);
            }
        }
        self.newest = self.hits.len();
        self.scans.insert(time, laser, &self.hits);
    }

    /// Forgets all but the newest scan.
    pub fn clear(&mut self) {
        self.scans.clear();
    }

    /// Returns the points on obstacles, in the newest scan and remembered.
    /// Remembered are those of earlier scans that the newest one does not see through or see again.
    pub fn points<'m>(&'m self, scan: &'m LaserScan, laser: &Pose2) -> impl Iterator<Item = [f64; 2]> + 'm {
        let laser = PlanarTransform::of(laser);
        let earlier = self.scans.points().count().saturating_sub(self.newest);
        self.scans.points().enumerate().filter_map(move |(at, point)| {
            (at >= earlier || is_hidden(scan, laser.inverse_point(point))).then_some(point)
        })
    }
}

/// Limits of the memory of scans.
#[derive(Clone, Copy, Debug)]
pub struct MemoryLimits {
    /// Time that points are kept, s.
    pub persistence: f64,
    /// Longest range, m.
    pub max_range: f64,
    /// Number of beams.
    pub max_beams: usize,
}

/// Returns true if no beam of a scan reaches a point in the laser's frame.
/// The scan then gives no information about the point.
fn is_hidden(scan: &LaserScan, [x, y]: [f64; 2]) -> bool {
    let angle = math::atan2(y, x) - scan.angle_min;
    // From 0 on, as beams are.
    let angle = angle - TAU * (angle / TAU).floor();
    let beam = (angle / scan.angle_increment).round();
    if !(beam >= 0.0 && beam < scan.ranges.len() as f64) {
        return true;
    }
    let range = f64::from(scan.ranges[beam as usize]);
    math::hypot(x, y) > range + SAME
}
