//! Adaptive Monte Carlo localization.

use serde::{Deserialize, Serialize};
use slate_interfaces::{Particle, Pose2, PoseEstimate};
use slate_module::{Random, math};

use crate::InvalidParameter;
use crate::beam_skip::skip_beams;
use crate::bins::PoseBins;
use crate::candidate_pool::CandidatePool;
use crate::estimate::{compose, moments, relative};
use crate::likelihood_field::LikelihoodField;
use crate::motion_model::OdometryIncrement;
use crate::parameters::MonteCarloParameters;
use crate::particles::{effective_number, normalize, parts as particle_parts};

/// Adaptive Monte Carlo localization with KLD sampling.
/// Dellaert, Fox, Burgard and Thrun, 1999, *Monte Carlo localization for mobile robots*; with augmented recovery,
/// selective resampling and beam skipping.
///
/// Until it is [initialized](Self::initialize) somewhere or [anywhere](Self::initialize_globally), the pose is
/// unknown. It is plain data: a filter that is saved and restored continues with the same bits.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MonteCarloLocalization {
    parameters: MonteCarloParameters,
    #[serde(with = "particle_parts")]
    particles: Vec<Particle>,
    /// Newest pose of the odometry, and that up to which particles have moved.
    odometry: Option<[f64; 3]>,
    predicted: Option<[f64; 3]>,
    /// Mean (x, y, heading) and covariance of the heaviest cluster.
    /// They hold for the time at which the odometry was `predicted`.
    estimate: Option<([f64; 3], [f64; 9])>,
    initialization: Initialization,
    updates: u32,
    /// Likelihoods of scans, averaged over a long and a short time.
    slow: f64,
    fast: f64,
    #[serde(skip)]
    buffers: SampleBuffers,
}

/// Initialization that the next scan completes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Initialization {
    /// Done: the first update has passed.
    Done,
    /// Update by the next scan, whether the robot has moved or not.
    Local,
    /// Update by the next scan, with particles that the scan selects.
    Global,
}

/// Memory that is used again.
#[derive(Clone, Debug, Default)]
struct SampleBuffers {
    drawn: Vec<Particle>,
    /// Sums of weights up to each particle.
    cumulative: Vec<f64>,
    /// Logarithm of the scan's likelihood from each particle.
    log_likelihoods: Vec<f64>,
    bins: PoseBins,
    stack: Vec<u32>,
    /// Share of the particles that explain each beam, and whether it counts.
    explained: Vec<f64>,
    counts: Vec<bool>,
    pool: CandidatePool,
}

impl MonteCarloLocalization {
    /// Returns a filter without particles.
    ///
    /// # Errors
    /// A parameter that no filter can have.
    pub fn new(parameters: MonteCarloParameters) -> Result<Self, InvalidParameter> {
        parameters.check()?;
        Ok(Self {
            parameters,
            particles: Vec::with_capacity(parameters.sampling.max_particles),
            odometry: None,
            predicted: None,
            estimate: None,
            initialization: Initialization::Done,
            updates: 0,
            slow: 0.0,
            fast: 0.0,
            buffers: SampleBuffers::default(),
        })
    }

    /// Parameters.
    pub fn parameters(&self) -> &MonteCarloParameters {
        &self.parameters
    }

    /// Sets other parameters, from the next update on.
    ///
    /// # Errors
    /// A parameter that no filter can have, without a change.
    pub fn set_parameters(&mut self, parameters: MonteCarloParameters) -> Result<(), InvalidParameter> {
        parameters.check()?;
        self.parameters = parameters;
        Ok(())
    }

    /// Initializes at a pose in the map frame with standard deviations.
    /// They are of x, y (m) and heading (rad). Returns false, without a change, for a value that is not a number or
    /// farther than 1,000 km.
    pub fn initialize(&mut self, pose: Pose2, stddev: [f64; 3], random: &mut Random) -> bool {
        if !is_plausible(&pose) || !stddev.iter().all(|part| (0.0..=FARTHEST).contains(part)) {
            return false;
        }
        let sample = |random: &mut Random| Pose2 {
            x: pose.x + stddev[0] * random.normal(),
            y: pose.y + stddev[1] * random.normal(),
            theta: math::wrap_angle(pose.theta + stddev[2] * random.normal()),
        };
        self.fill(|random| Some(sample(random)), random);
        self.initialization = Initialization::Local;
        true
    }

    /// Initializes uniformly over the free cells of the map.
    /// Without one, the pose is unknown.
    pub fn initialize_globally(&mut self, field: &LikelihoodField, random: &mut Random) {
        self.fill(|random| field.random_pose(random), random);
        self.initialization = Initialization::Global;
    }

    fn fill(&mut self, sample: impl Fn(&mut Random) -> Option<Pose2>, random: &mut Random) {
        let count = self.parameters.sampling.max_particles;
        let weight = 1.0 / count as f64;
        self.particles.clear();
        self.particles.extend((0..count).map_while(|_| Some(Particle { pose: sample(random)?, weight })));
        self.predicted = self.odometry;
        (self.updates, self.slow, self.fast) = (0, 0.0, 0.0);
        self.estimate_pose();
    }

    /// Returns the particles, with weights that sum up to 1.
    /// It is empty while the pose is unknown. They are of the newest update, as the [estimate](Self::estimate) continues
    /// by the odometry in between.
    pub fn particles(&self) -> &[Particle] {
        &self.particles
    }

    /// Predicts by the odometry; updates by a scan after enough motion.
    /// Returns whether it updated; the motion counts since the newest update. A pose that is not a number, or farther than
    /// 1,000 km, is skipped.
    ///
    /// Points are ends of beams in the robot's frame, m, without those that hit nothing.
    pub fn update(
        &mut self,
        odometry: Pose2,
        points: &[[f64; 2]],
        field: &LikelihoodField,
        random: &mut Random,
    ) -> bool {
        if !is_plausible(&odometry) {
            return false;
        }
        self.odometry = Some(parts(&odometry));
        if self.particles.is_empty() {
            return false;
        }
        let from = pose(*self.predicted.get_or_insert(parts(&odometry)));
        if points.is_empty() || !self.is_due(&from, &odometry) {
            return false;
        }
        if from != odometry {
            // At once, as variances of the motion model are those of such an increment.
            let increment = OdometryIncrement::between(from, odometry, &self.parameters.alphas);
            self.particles.iter_mut().for_each(|particle| increment.apply(particle, random));
        }
        self.predicted = Some(parts(&odometry));
        self.correct(points, field, random);
        self.estimate_pose();
        true
    }

    /// Takes an odometry pose without a motion, as after its reset.
    /// The estimate stays.
    pub fn rebase(&mut self, odometry: Pose2) {
        if !is_plausible(&odometry) {
            return;
        }
        let (newest, predicted) = (self.odometry.map(pose), self.predicted.map(pose));
        if let (Some(newest), Some(predicted)) = (newest, predicted) {
            self.predicted = Some(parts(&compose(&odometry, &relative(&newest, &predicted))));
        }
        self.odometry = Some(parts(&odometry));
    }

    fn is_due(&self, from: &Pose2, to: &Pose2) -> bool {
        let moved = math::hypot(to.x - from.x, to.y - from.y);
        let turned = math::angle_between(from.theta, to.theta).abs();
        self.initialization != Initialization::Done
            || moved >= self.parameters.update_min_d
            || turned >= self.parameters.update_min_a
    }

    /// Weighs particles by a scan, and resamples them.
    fn correct(&mut self, points: &[[f64; 2]], field: &LikelihoodField, random: &mut Random) {
        let candidates = self.parameters.candidates.global;
        let begin = std::mem::replace(&mut self.initialization, Initialization::Done);
        if begin == Initialization::Global && candidates > 0 {
            self.buffers.pool.fill(candidates, points, field, random);
            for particle in &mut self.particles {
                particle.pose = self.buffers.pool.draw(random).unwrap_or(particle.pose);
            }
            return;
        }
        self.weight(points, field);
        self.updates = self.updates.wrapping_add(1);
        if self.updates.is_multiple_of(self.parameters.resample_interval.max(1)) && self.needs_resampling() {
            self.resample(points, field, random);
        }
    }

    /// Multiplies weights by the scan's likelihood from each particle.
    fn weight(&mut self, points: &[[f64; 2]], field: &LikelihoodField) {
        let SampleBuffers { log_likelihoods, explained, counts, .. } = &mut self.buffers;
        counts.clear();
        if let Some(skip) = self.parameters.beam_skip {
            skip_beams(&skip, &self.particles, points, field, (explained, counts));
        }
        log_likelihoods.clear();
        let (mut average, mut best) = (0.0, f64::NEG_INFINITY);
        for particle in &self.particles {
            let score = field.score(&particle.pose, points, counts);
            average += particle.weight * score.per_beam();
            let log_likelihood = score.log_likelihood();
            best = math::max(best, log_likelihood);
            log_likelihoods.push(log_likelihood);
        }
        for (particle, log_likelihood) in self.particles.iter_mut().zip(log_likelihoods) {
            particle.weight *= math::exp(*log_likelihood - best);
        }
        normalize(&mut self.particles);
        let recovery = self.parameters.recovery;
        // The mean of all, as long as those are few: the first scans, of which the pose is least certain, must not weigh
        // most.
        let mean = 1.0 / (f64::from(self.updates) + 1.0);
        let approach = |value: f64, rate: f64| value + math::max(rate, mean) * (average - value);
        self.slow = approach(self.slow, recovery.alpha_slow);
        self.fast = approach(self.fast, recovery.alpha_fast);
    }

    fn needs_resampling(&self) -> bool {
        let few = 0.5 * self.particles.len() as f64;
        !self.parameters.selective_resampling
            || effective_number(&self.particles) < few
            || self.random_share() > 0.0
    }

    /// Draws as many particles as KLD sampling requires, by their weights.
    fn resample(&mut self, points: &[[f64; 2]], field: &LikelihoodField, random: &mut Random) {
        let MonteCarloParameters { sampling, candidates, .. } = self.parameters;
        let share = self.random_share();
        let SampleBuffers { drawn, cumulative, bins, pool, .. } = &mut self.buffers;
        let has_pool = share > 0.0 && candidates.recovery > 0;
        if has_pool {
            // Few random particles are worth few candidates.
            let count = math::min(1.0, share / FULL_SHARE) * candidates.recovery as f64;
            pool.fill(count.ceil() as usize, points, field, random);
        }
        cumulative.clear();
        cumulative.extend(self.particles.iter().scan(0.0, |sum, particle| {
            *sum += particle.weight;
            Some(*sum)
        }));
        let total = cumulative.last().copied().unwrap_or(0.0);
        bins.clear(sampling.max_particles);
        drawn.clear();
        let mut needed = sampling.min_particles;
        while drawn.len() < needed {
            let is_random = random.unit() < share;
            let draw = random.unit() * total;
            let at = cumulative.partition_point(|sum| *sum <= draw);
            let chosen = self.particles[at.min(self.particles.len() - 1)].pose;
            let lost = match (is_random, has_pool) {
                (true, true) => pool.draw(random),
                (true, false) => field.random_pose(random),
                (false, _) => None,
            };
            let pose = lost.unwrap_or(chosen);
            drawn.push(Particle { pose, weight: 1.0 });
            bins.add(&pose, 1.0);
            needed = sampling.particles(bins.len());
        }
        std::mem::swap(&mut self.particles, drawn);
        normalize(&mut self.particles);
    }

    /// Returns the share of random particles.
    /// It is the relative loss of likelihood of recent scans.
    fn random_share(&self) -> f64 {
        let recovery = self.parameters.recovery;
        if recovery.alpha_slow <= 0.0 || self.slow <= 0.0 {
            return 0.0;
        }
        math::max(0.0, 1.0 - self.fast / self.slow)
    }

    /// Returns mean and covariance of the heaviest cluster of particles.
    /// They are moved on by the odometry since the newest update; `None` while the pose is unknown.
    pub fn estimate(&self) -> Option<PoseEstimate> {
        let (mean, covariance) = self.estimate?;
        let moved = match (self.predicted, self.odometry) {
            (Some(from), Some(to)) if from != to => relative(&pose(from), &pose(to)),
            _ => return Some(PoseEstimate { pose: pose(mean), covariance }),
        };
        Some(PoseEstimate { pose: compose(&pose(mean), &moved), covariance })
    }

    fn estimate_pose(&mut self) {
        let SampleBuffers { bins, stack, .. } = &mut self.buffers;
        bins.clear(self.particles.len());
        self.particles.iter().for_each(|particle| bins.add(&particle.pose, particle.weight));
        self.estimate = bins.heaviest_cluster(stack).map(|heaviest| {
            let in_cluster =
                || self.particles.iter().filter(|particle| bins.cluster(&particle.pose) == Some(heaviest));
            let PoseEstimate { pose, covariance } = moments(in_cluster);
            (parts(&pose), covariance)
        });
    }
}

fn parts(pose: &Pose2) -> [f64; 3] {
    [pose.x, pose.y, pose.theta]
}

fn pose([x, y, theta]: [f64; 3]) -> Pose2 {
    Pose2 { x, y, theta }
}

/// Share of random particles from which they are chosen from all candidates.
const FULL_SHARE: f64 = 0.2;

/// Farther poses are faults of what sent them, m.
pub(crate) const FARTHEST: f64 = 1e6;

fn is_plausible(pose: &Pose2) -> bool {
    // Also false for NaN.
    pose.x.abs() <= FARTHEST && pose.y.abs() <= FARTHEST && pose.theta.is_finite()
}
