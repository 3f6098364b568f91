//! SLAM with a Rao-Blackwellized particle filter.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use slate_interfaces::Pose2;
use slate_module::{Random, math};

use crate::parameters::{InvalidSlamParameter, ParticleSlamParameters};
use crate::pose_proposal::{Moments, PoseProposal};
use crate::refine::{PosePrior, log_likelihood, refine};
use crate::saved::{self, SavedPose};
use crate::scan_increment::ScanIncrement;
use crate::scan_matcher::match_scan;
use crate::se2;
use crate::surface_map::SurfaceMap;

/// Thinning of a scan's points for each particle: one of so many.
/// These points are matched and weighed.
const THINNED: usize = 2;

/// 2D laser SLAM with a Rao-Blackwellized particle filter.
/// Grisetti, Stachniss and Burgard, 2007, *Improved techniques for grid mapping with Rao-Blackwellized particle
/// filters*, algorithm 1.
///
/// Each particle has a map of its own, whose tiles particles of one origin share until one changes them. Its pose is
/// drawn from a normal distribution around the best match of the scan, and particles are resampled only while their
/// effective number is below half of theirs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParticleSlam {
    parameters: ParticleSlamParameters,
    #[serde(with = "SavedPose")]
    odometry: Pose2,
    odometry_jumps: usize,
    particles: Vec<MapParticle>,
    /// Points of each scan.
    scans: Vec<Vec<[f64; 2]>>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct MapParticle {
    map: SurfaceMap,
    /// Pose of each scan.
    #[serde(with = "saved::poses")]
    poses: Vec<Pose2>,
    log_weight: f64,
}

impl ParticleSlam {
    /// Returns a filter without scans.
    ///
    /// # Errors
    /// A parameter that no SLAM can have.
    pub fn new(parameters: ParticleSlamParameters) -> Result<Self, InvalidSlamParameter> {
        parameters.check()?;
        let particle = MapParticle {
            map: SurfaceMap::new(parameters.matching.resolution),
            poses: Vec::new(),
            log_weight: 0.0,
        };
        let particles = vec![particle; parameters.particles];
        Ok(Self { parameters, odometry: Pose2::default(), odometry_jumps: 0, particles, scans: Vec::new() })
    }

    /// Inserts a scan; returns the heaviest particle's pose in the map frame.
    /// A scan is the pose of the odometry, and the ends of beams in the robot's frame, m. The map frame is that of the
    /// first scan.
    ///
    /// Points that are not finite or beyond `max_laser_range` are left out. An odometry that is unknown counts as that
    /// of the scan before; beyond `max_odometry_increment` from that one, no motion is assumed.
    pub fn insert(&mut self, odometry: Pose2, points: &[[f64; 2]], random: &mut Random) -> Pose2 {
        let most = self.parameters.matching.max_laser_range;
        let is_fit = |[x, y]: &&[f64; 2]| x * x + y * y <= most * most;
        let points: Vec<[f64; 2]> = points.iter().filter(is_fit).copied().collect();
        let odometry = if odometry.is_known() { odometry } else { self.odometry };
        let ParticleSlamParameters { matching, odometry: drift, .. } = &self.parameters;
        let increment = ScanIncrement::between(self.odometry, odometry, matching, drift);
        self.odometry = odometry;
        if !self.scans.is_empty() {
            self.odometry_jumps += usize::from(increment.is_jump);
            let matched = self.match_heaviest(&increment, &points);
            let thinned: Vec<[f64; 2]> = points.iter().step_by(THINNED).copied().collect();
            for particle in &mut self.particles {
                particle.advance(&increment, matched, &thinned, &self.parameters, random);
            }
            self.resample(random);
        } else {
            self.particles.iter_mut().for_each(|particle| particle.poses.push(Pose2::default()));
        }
        for particle in &mut self.particles {
            particle.map.insert(se2::transform_all(particle.pose(), &points));
        }
        self.scans.push(points);
        self.heaviest().map_or(Pose2::default(), MapParticle::pose)
    }

    /// Returns the number of scans.
    pub fn scans(&self) -> usize {
        self.scans.len()
    }

    /// Returns the number of scans with an odometry error.
    /// Errors are increments beyond `max_odometry_increment`.
    pub fn odometry_jumps(&self) -> usize {
        self.odometry_jumps
    }

    /// Poses of all scans in the map frame, by the heaviest particle.
    pub fn poses(&self) -> &[Pose2] {
        self.heaviest().map_or(&[], |particle| &particle.poses)
    }

    /// Ends of the beams of a scan in the robot's frame, m.
    pub fn points(&self, scan: usize) -> &[[f64; 2]] {
        &self.scans[scan]
    }

    /// Returns the effective number of particles (Grisetti et al., 2007, equation 18).
    pub fn effective_number(&self) -> f64 {
        let weights = self.weights();
        1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>()
    }

    /// Returns the covariance of x, y and theta of the particles.
    /// It is around the newest pose, in the map frame.
    pub fn covariance(&self) -> Matrix3<f64> {
        let pose = self.heaviest().map_or(Pose2::default(), MapParticle::pose);
        let spread = self.particles.iter().zip(self.weights()).map(|(particle, weight)| {
            let other = particle.pose();
            let turn = math::angle_between(pose.theta, other.theta);
            let error = Vector3::new(other.x - pose.x, other.y - pose.y, turn);
            error * error.transpose() * weight
        });
        spread.fold(Matrix3::zeros(), |sum, one| sum + one)
    }

    /// Returns the increment by which the heaviest particle fits its map best.
    /// A search for each particle would find almost the same.
    fn match_heaviest(&self, increment: &ScanIncrement, points: &[[f64; 2]]) -> Pose2 {
        let Some(particle) = self.heaviest() else { return increment.pose };
        let here = particle.pose();
        let predicted = se2::compose(here, increment.pose);
        let prior = se2::turned(increment.information, here.theta);
        let matching = &self.parameters.matching;
        let found = match_scan(&particle.map, points, predicted, prior, matching);
        if found.inliers < matching.min_inliers { increment.pose } else { se2::relative(here, found.pose) }
    }

    fn heaviest(&self) -> Option<&MapParticle> {
        // The first among equals.
        let particles = self.particles.iter().rev();
        particles.max_by(|one, other| one.log_weight.total_cmp(&other.log_weight))
    }

    /// Weights, whose sum is 1.
    fn weights(&self) -> Vec<f64> {
        let most = self.heaviest().map_or(0.0, |particle| particle.log_weight);
        let weights: Vec<f64> =
            self.particles.iter().map(|particle| math::exp(particle.log_weight - most)).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / sum).collect()
    }

    /// Low-variance resampling, if few particles are effective.
    /// *Probabilistic Robotics*, table 4.4.
    fn resample(&mut self, random: &mut Random) {
        let count = self.particles.len();
        if self.effective_number() > count as f64 / 2.0 {
            return;
        }
        let weights = self.weights();
        let start = random.unit() / count as f64;
        let (mut at, mut sum) = (0, weights[0]);
        let drawn = (0..count).map(|k| {
            let target = start + k as f64 / count as f64;
            while sum < target && at + 1 < count {
                at += 1;
                sum += weights[at];
            }
            MapParticle { log_weight: 0.0, ..self.particles[at].clone() }
        });
        self.particles = drawn.collect();
    }
}

impl MapParticle {
    fn pose(&self) -> Pose2 {
        self.poses.last().copied().unwrap_or_default()
    }

    /// Draws the next pose from the proposal, and weighs the particle.
    /// The proposal starts from the increment of the odometry, and from one by which the scan fits.
    fn advance(
        &mut self,
        increment: &ScanIncrement,
        matched: Pose2,
        points: &[[f64; 2]],
        parameters: &ParticleSlamParameters,
        random: &mut Random,
    ) {
        let matching = &parameters.matching;
        let here = self.pose();
        let predicted = se2::compose(here, increment.pose);
        let information = se2::turned(increment.information, here.theta);
        let prior = PosePrior { mean: predicted, information };
        let radius = matching.correspondence_distance;
        let found = refine(&self.map, points, se2::compose(here, matched), radius, Some(prior));
        let is_matched = found.inliers >= matching.min_inliers;
        let proposal = if is_matched {
            PoseProposal::new(found.pose, found.information + information)
        } else {
            PoseProposal::new(predicted, information)
        };
        // Weighs poses around the best one by odometry and scan (equations 13 to 15); the constant of the odometry's
        // density is that of all particles.
        let mut sampled = Moments::default();
        for sample in 0..parameters.samples {
            let offset = if sample == 0 { Vector3::zeros() } else { proposal.draw(random) };
            let pose = proposal.pose(offset);
            let log_prior = -0.5 * mahalanobis(&prior, pose);
            let likelihood = log_likelihood(&self.map, points, pose, radius) / parameters.likelihood_gain;
            // Samples are dense where the proposal is likely.
            sampled.add(offset, log_prior + likelihood - proposal.log_density(offset));
        }
        self.poses.push(proposal.pose(sampled.draw(random)));
        self.log_weight += sampled.log_mean_weight();
    }
}

fn mahalanobis(prior: &PosePrior, pose: Pose2) -> f64 {
    let PosePrior { mean, information } = prior;
    let turn = math::angle_between(mean.theta, pose.theta);
    let error = Vector3::new(pose.x - mean.x, pose.y - mean.y, turn);
    error.dot(&(information * error))
}
