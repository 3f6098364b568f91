//! A feature that was seen in several images.

use serde::{Deserialize, Serialize};
use slate_module::math;

use super::ports::{FeatureTrackerParams, FoundVictim};
use super::sight::FeatureSight;

/// Gate: squared Mahalanobis distance of 99 % of the sights of a track.
const GATE: f64 = 9.2;
/// Greatest distance of a sight from its track, as a multiple of the parameter.
const FARTHEST: f64 = 2.0;

/// State of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum TrackState {
    Candidate,
    Reported,
    Rejected,
}

/// A feature at rest: its position by a Kalman filter.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct FeatureTrack {
    /// x, y and height, m.
    position: [f64; 3],
    /// xx, xy, yy, m².
    covariance: [f64; 3],
    pub hits: u32,
    /// Least range that it was seen from, m.
    nearest: f64,
    /// When it was seen, ns.
    seen: u64,
    pub state: TrackState,
    /// Number and time of its report.
    reported: Option<(u32, u64)>,
}

impl FeatureTrack {
    pub fn new(sight: &FeatureSight, now: u64) -> Self {
        Self {
            position: sight.position,
            covariance: sight.covariance,
            hits: 1,
            nearest: sight.range,
            seen: now,
            state: TrackState::Candidate,
            reported: None,
        }
    }

    pub fn position(&self) -> [f64; 3] {
        self.position
    }

    /// Distance of a sight that may be of this track, m.
    pub fn distance(&self, sight: &FeatureSight, merge: f64) -> Option<f64> {
        let (dx, dy) = (sight.position[0] - self.position[0], sight.position[1] - self.position[1]);
        let distance = math::hypot(dx, dy);
        let [xx, xy, yy] = sum(self.covariance, sight.covariance);
        let determinant = xx * yy - xy * xy;
        let square = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant;
        (distance <= merge || (square <= GATE && distance <= FARTHEST * merge)).then_some(distance)
    }

    /// Kalman update with the position itself as measurement.
    pub fn update(&mut self, sight: &FeatureSight, now: u64) {
        let [xx, xy, yy] = self.covariance;
        let [sxx, sxy, syy] = sum(self.covariance, sight.covariance);
        let determinant = sxx * syy - sxy * sxy;
        // Gain P S^-1.
        let gain = [
            [(xx * syy - xy * sxy) / determinant, (xy * sxx - xx * sxy) / determinant],
            [(xy * syy - yy * sxy) / determinant, (yy * sxx - xy * sxy) / determinant],
        ];
        let (dx, dy) = (sight.position[0] - self.position[0], sight.position[1] - self.position[1]);
        self.position[0] += gain[0][0] * dx + gain[0][1] * dy;
        self.position[1] += gain[1][0] * dx + gain[1][1] * dy;
        self.covariance = [
            xx - gain[0][0] * xx - gain[0][1] * xy,
            xy - gain[0][0] * xy - gain[0][1] * yy,
            yy - gain[1][0] * xy - gain[1][1] * yy,
        ];
        self.hits = self.hits.saturating_add(1);
        // The mean, as heights have no model of their errors.
        self.position[2] += (sight.position[2] - self.position[2]) / f64::from(self.hits);
        self.nearest = math::min(self.nearest, sight.range);
        self.seen = now;
    }

    /// Standard deviation along the worse direction, m.
    fn stddev(&self) -> f64 {
        let [xx, xy, yy] = self.covariance;
        let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        (mean + (half * half + xy * xy).sqrt()).sqrt()
    }

    /// Returns true if it should be examined.
    pub fn is_candidate(&self, params: &FeatureTrackerParams) -> bool {
        self.state == TrackState::Candidate && self.hits >= params.candidate_hits
    }

    /// Returns true if it can be reported and was not.
    pub fn is_sure(&self, params: &FeatureTrackerParams) -> bool {
        self.state == TrackState::Candidate
            && self.hits >= params.report_hits
            && self.nearest <= params.report_range
            && self.stddev() <= params.report_stddev
    }

    /// Returns true if it was seen in a few images only, and long ago.
    pub fn is_spurious(&self, hits: u32, after: f64, now: u64) -> bool {
        self.state == TrackState::Candidate
            && self.hits < hits
            && now.saturating_sub(self.seen) as f64 > after * 1e9
    }

    pub fn report(&mut self, number: u32, now: u64) {
        (self.state, self.reported) = (TrackState::Reported, Some((number, now)));
    }

    /// Returns the report of it.
    pub fn found(&self) -> Option<FoundVictim> {
        let (id, time) = self.reported?;
        let [x, y, z] = self.position;
        Some(FoundVictim { time, x, y, z, position_stddev: self.stddev(), id, hits: self.hits })
    }
}

fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
