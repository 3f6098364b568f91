//! Parameters.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Parameters of scan matching, of both methods.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MatchingParameters {
    /// Edge length of a cell of the maps that scans are matched with, m.
    pub resolution: f64,
    /// Range beyond which a point is left out, `max_laser_range`, m.
    pub max_laser_range: f64,
    /// Farthest that the odometry's prediction is wrong between two scans, m.
    pub search_distance: f64,
    /// Farthest that the odometry's prediction is wrong between two scans, rad.
    pub search_angle: f64,
    /// Correspondence distance of a point to the map's surfaces, m.
    /// A point belongs to surfaces within it.
    pub correspondence_distance: f64,
    /// Least share of inliers of a match.
    /// A scan of fewer is placed by the odometry.
    pub min_inliers: f64,
    /// Odometry translation between two scans that counts as an error, m.
    pub max_odometry_increment: f64,
}

impl Default for MatchingParameters {
    fn default() -> Self {
        Self {
            resolution: 0.05,
            max_laser_range: 30.0,
            search_distance: 0.4,
            search_angle: 0.35,
            correspondence_distance: 0.2,
            min_inliers: 0.3,
            max_odometry_increment: 10.0,
        }
    }
}

/// Noise of the odometry.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometryDrift {
    /// Standard deviation of the translation after a meter, m/sqrt(m).
    pub translation_stddev: f64,
    /// Standard deviation of the rotation after a radian, rad/sqrt(rad).
    pub rotation_stddev: f64,
    /// Standard deviation of the rotation after a meter, rad/sqrt(m).
    pub drift_stddev: f64,
}

impl Default for OdometryDrift {
    fn default() -> Self {
        Self { translation_stddev: 0.1, rotation_stddev: 0.1, drift_stddev: 0.1 }
    }
}

/// Parameters of [`GraphSlam`](crate::GraphSlam).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraphSlamParameters {
    /// Scan matching.
    pub matching: MatchingParameters,
    /// Noise of the odometry.
    pub odometry: OdometryDrift,
    /// Scans of a submap; every half of them another begins.
    pub scans_per_submap: usize,
    /// Loop closure.
    pub loops: LoopClosureParameters,
}

/// Parameters of loop closure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoopClosureParameters {
    /// Distance between scans of two submaps within which these are compared, m.
    pub max_distance: f64,
    /// Farthest that the pose of a submap is wrong against another, m.
    pub search_distance: f64,
    /// Farthest that the pose of a submap is wrong against another, rad.
    pub search_angle: f64,
    /// Least mean likelihood of a submap's points in another one, 0 to 1.
    pub min_score: f64,
    /// Least share of a scan's points on surfaces of the other submap, 0 to 1.
    pub min_inliers: f64,
    /// Parameter of dynamic covariance scaling of loop closures.
    /// Squared Mahalanobis distance from which it weakens a loop closure.
    pub robust_kernel: f64,
}

impl Default for LoopClosureParameters {
    fn default() -> Self {
        Self {
            max_distance: 4.0,
            search_distance: 3.0,
            search_angle: 0.4,
            min_score: 0.5,
            min_inliers: 0.6,
            robust_kernel: 5.0,
        }
    }
}

impl Default for GraphSlamParameters {
    fn default() -> Self {
        Self {
            matching: MatchingParameters::default(),
            odometry: OdometryDrift::default(),
            scans_per_submap: 40,
            loops: LoopClosureParameters::default(),
        }
    }
}

/// Parameters of [`ParticleSlam`](crate::ParticleSlam).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParticleSlamParameters {
    /// Scan matching.
    pub matching: MatchingParameters,
    /// Noise of the odometry.
    pub odometry: OdometryDrift,
    /// Number of particles.
    pub particles: usize,
    /// Poses that are weighed for the proposal of each particle.
    pub samples: usize,
    /// Number of points that count as one in the likelihood of a scan.
    /// Their errors are not independent.
    pub likelihood_gain: f64,
}

impl Default for ParticleSlamParameters {
    fn default() -> Self {
        Self {
            matching: MatchingParameters::default(),
            odometry: OdometryDrift::default(),
            particles: 30,
            samples: 10,
            likelihood_gain: 3.0,
        }
    }
}

/// Parameter that no SLAM can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InvalidSlamParameter {
    /// Name of the parameter.
    pub name: &'static str,
    /// Valid values of the parameter.
    pub expected: &'static str,
}

impl fmt::Display for InvalidSlamParameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "invalid `{}`: expected {}", self.name, self.expected)
    }
}

impl std::error::Error for InvalidSlamParameter {}

fn check<const N: usize>(
    values: [(&'static str, f64); N],
    expected: &'static str,
    is_valid: impl Fn(f64) -> bool,
) -> Result<(), InvalidSlamParameter> {
    match values.into_iter().find(|(_, value)| !is_valid(*value)) {
        Some((name, _)) => Err(InvalidSlamParameter { name, expected }),
        None => Ok(()),
    }
}

fn is_length(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

impl MatchingParameters {
    pub(crate) fn check(&self) -> Result<(), InvalidSlamParameter> {
        let lengths = [
            ("resolution", self.resolution),
            ("max_laser_range", self.max_laser_range),
            ("correspondence_distance", self.correspondence_distance),
            ("max_odometry_increment", self.max_odometry_increment),
        ];
        check(lengths, "a length above 0 m", is_length)?;
        // Maps and searches take memory and time for each cell.
        let is_range = |distance: f64| distance <= 2000.0 * self.resolution;
        let ranges = [
            ("max_laser_range", self.max_laser_range),
            ("max_odometry_increment", self.max_odometry_increment),
        ];
        check(ranges, "at most 2000 times `resolution`", is_range)?;
        let is_near = |distance: f64| distance <= 100.0 * self.resolution;
        let near = [("correspondence_distance", self.correspondence_distance)];
        check(near, "at most 100 times `resolution`", is_near)?;
        let cells = |distance: f64| (0.0..=1000.0 * self.resolution).contains(&distance);
        check([("search_distance", self.search_distance)], "0 to 1000 times `resolution`", cells)?;
        let is_angle = |angle: f64| (0.0..=std::f64::consts::PI).contains(&angle);
        check([("search_angle", self.search_angle)], "0 to pi rad", is_angle)?;
        check([("min_inliers", self.min_inliers)], "a share from 0 to 1", |share| {
            (0.0..=1.0).contains(&share)
        })
    }
}

impl OdometryDrift {
    pub(crate) fn check(&self) -> Result<(), InvalidSlamParameter> {
        let deviations = [
            ("translation_stddev", self.translation_stddev),
            ("rotation_stddev", self.rotation_stddev),
            ("drift_stddev", self.drift_stddev),
        ];
        check(deviations, "a number above 0", is_length)
    }
}

impl GraphSlamParameters {
    pub(crate) fn check(&self) -> Result<(), InvalidSlamParameter> {
        self.matching.check()?;
        self.odometry.check()?;
        if !(2..=1_000).contains(&self.scans_per_submap) {
            return Err(InvalidSlamParameter { name: "scans_per_submap", expected: "2 to 1000" });
        }
        let loops = &self.loops;
        check([("loops.max_distance", loops.max_distance)], "a length above 0 m", is_length)?;
        let cells = |distance: f64| (0.0..=1000.0 * self.matching.resolution).contains(&distance);
        check([("loops.search_distance", loops.search_distance)], "0 to 1000 times `resolution`", cells)?;
        let is_angle = |angle: f64| (0.0..=std::f64::consts::PI).contains(&angle);
        check([("loops.search_angle", loops.search_angle)], "0 to pi rad", is_angle)?;
        let shares = [("loops.min_score", loops.min_score), ("loops.min_inliers", loops.min_inliers)];
        check(shares, "a share from 0 to 1", |share| (0.0..=1.0).contains(&share))?;
        check([("loops.robust_kernel", loops.robust_kernel)], "a number above 0", is_length)
    }
}

impl ParticleSlamParameters {
    pub(crate) fn check(&self) -> Result<(), InvalidSlamParameter> {
        self.matching.check()?;
        self.odometry.check()?;
        let counts = [("particles", self.particles), ("samples", self.samples)];
        for (name, count) in counts {
            if !(1..=10_000).contains(&count) {
                return Err(InvalidSlamParameter { name, expected: "1 to 10000" });
            }
        }
        check([("likelihood_gain", self.likelihood_gain)], "a number above 0", is_length)
    }
}
