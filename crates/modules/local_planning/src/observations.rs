//! Memory of scans.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use slate_interfaces::Pose2;
use slate_module::math;

/// Observation buffer of scans, as that of Nav2's obstacle layer.
///
/// A robot whose sensor does not look all round remembers what is behind it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ObservationBuffer {
    /// Time that points are kept, `observation_persistence`, s.
    /// 0 keeps the newest scan alone.
    persistence: f64,
    /// Time between scans that are kept, s.
    interval: f64,
    scans: VecDeque<ObservedPoints>,
    /// Memory of dropped scans.
    #[serde(skip)]
    spare: Vec<Vec<[f64; 2]>>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct ObservedPoints {
    time: f64,
    /// Points in the planner's frame.
    points: Vec<[f64; 2]>,
}

impl ObservationBuffer {
    /// Returns a buffer of `observation_persistence` seconds.
    /// It keeps a scan of each `interval`, s, and the newest one.
    pub fn new(observation_persistence: f64, interval: f64) -> Self {
        Self { persistence: observation_persistence, interval, scans: VecDeque::new(), spare: Vec::new() }
    }

    /// Adds a scan: ends of beams that hit an obstacle, in the sensor's frame.
    /// `sensor` is the sensor's pose at `time`, s.
    ///
    /// A scan from a pose or at a time that is not a number is left out; scans of later times are dropped, as time has
    /// gone back.
    pub fn insert(&mut self, time: f64, sensor: &Pose2, hits: &[[f64; 2]]) {
        if !(sensor.is_known() && time.is_finite()) {
            return;
        }
        while self.scans.back().is_some_and(|newest| newest.time > time) {
            self.drop_scan(false);
        }
        // The newest scan but one is kept only if it is an interval after the one before.
        if let [.., before, newest] = self.scans.make_contiguous()
            && newest.time - before.time < self.interval
        {
            self.drop_scan(false);
        }
        while self.scans.front().is_some_and(|oldest| time - oldest.time > self.persistence) {
            self.drop_scan(true);
        }
        let mut points = self.spare.pop().unwrap_or_default();
        points.clear();
        let (sine, cosine) = (math::sin(sensor.theta), math::cos(sensor.theta));
        points.extend(
            hits.iter().map(|[x, y]| [sensor.x + x * cosine - y * sine, sensor.y + x * sine + y * cosine]),
        );
        self.scans.push_back(ObservedPoints { time, points });
    }

    fn drop_scan(&mut self, is_oldest: bool) {
        let dropped = if is_oldest { self.scans.pop_front() } else { self.scans.pop_back() };
        self.spare.extend(dropped.map(|scan| scan.points));
    }

    /// Forgets all but the newest scan.
    pub fn clear(&mut self) {
        while self.scans.len() > 1 {
            self.drop_scan(true);
        }
    }

    /// Returns the points on obstacles, in the planner's frame.
    pub fn points(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.scans.iter().flat_map(|scan| scan.points.iter().copied())
    }
}
