//! Adaptive Monte Carlo localization.

use slate_interfaces::{Pose2, PoseEstimate};
use slate_module::{Random, math};

use crate::bins::PoseBins;
use crate::likelihood_field::LikelihoodField;
use crate::motion_model::OdometryIncrement;
use crate::parameters::{BeamSkip, InvalidParameter, MonteCarloParameters};
use crate::particles::{Particle, effective_number, normalize};

/// Adaptive Monte Carlo localization (Dellaert, Fox, Burgard and Thrun, 1999, *Monte Carlo localization for mobile
/// robots*) with KLD sampling, augmented recovery, selective resampling and beam skipping.
///
/// Until it is [initialized](Self::initialize) somewhere or [anywhere](Self::initialize_globally), the pose is
/// unknown.
#[derive(Clone, Debug)]
pub struct MonteCarloLocalization {
    parameters: MonteCarloParameters,
    particles: Vec<Particle>,
    /// Newest pose of the odometry, and that of the newest update.
    odometry: Option<Pose2>,
    updated: Option<Pose2>,
    updates: u32,
    /// Likelihoods of scans, averaged over a long and a short time.
    slow: f64,
    fast: f64,
    buffers: SampleBuffers,
}

/// Memory that is used again.
#[derive(Clone, Debug, Default)]
struct SampleBuffers {
    drawn: Vec<Particle>,
    /// Sums of weights up to each particle.
    cumulative: Vec<f64>,
    bins: PoseBins,
    stack: Vec<u32>,
    /// Share of the particles that explain each beam, and whether it counts.
    explained: Vec<f64>,
    counts: Vec<bool>,
}

impl MonteCarloLocalization {
    /// Makes a filter without particles.
    ///
    /// # Errors
    /// A parameter that no filter can have.
    pub fn new(parameters: MonteCarloParameters) -> Result<Self, InvalidParameter> {
        parameters.check()?;
        Ok(Self {
            parameters,
            particles: Vec::with_capacity(parameters.sampling.max_particles),
            odometry: None,
            updated: None,
            updates: 0,
            slow: 0.0,
            fast: 0.0,
            buffers: SampleBuffers::default(),
        })
    }

    /// Begins, or begins anew, at a pose in the map frame with standard deviations of x, y (m) and heading (rad).
    /// Returns false, without a change, for what is no number or farther than 1,000 km.
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
        true
    }

    /// Begins, or begins anew, anywhere in the free cells of the map. Without one, the pose is unknown.
    pub fn initialize_globally(&mut self, field: &LikelihoodField, random: &mut Random) {
        self.fill(|random| field.random_pose(random), random);
    }

    fn fill(&mut self, sample: impl Fn(&mut Random) -> Option<Pose2>, random: &mut Random) {
        let count = self.parameters.sampling.max_particles;
        let weight = 1.0 / count as f64;
        self.particles.clear();
        self.particles.extend((0..count).map_while(|_| Some(Particle { pose: sample(random)?, weight })));
        (self.updated, self.updates, self.slow, self.fast) = (None, 0, 0.0, 0.0);
    }

    /// Particles, whose weights sum up to 1; none while the pose is unknown.
    pub fn particles(&self) -> &[Particle] {
        &self.particles
    }

    /// Predicts by the odometry, and updates by a scan once the robot has moved far enough since the newest update;
    /// returns whether it did. A pose that is no number, or farther than 1,000 km, is skipped.
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
        let from = self.odometry.replace(odometry).unwrap_or(odometry);
        if self.particles.is_empty() {
            return false;
        }
        if from != odometry {
            let increment = OdometryIncrement::between(from, odometry, &self.parameters.alphas);
            self.particles.iter_mut().for_each(|particle| increment.apply(particle, random));
        }
        if points.is_empty() || !self.is_due(odometry) {
            return false;
        }
        self.updated = Some(odometry);
        self.weight(points, field);
        self.updates = self.updates.wrapping_add(1);
        if self.updates.is_multiple_of(self.parameters.resample_interval.max(1)) && self.needs_resampling() {
            self.resample(field, random);
        }
        true
    }

    fn is_due(&self, odometry: Pose2) -> bool {
        self.updated.is_none_or(|updated| {
            let moved = math::hypot(odometry.x - updated.x, odometry.y - updated.y);
            let turned = math::angle_between(updated.theta, odometry.theta).abs();
            moved >= self.parameters.update_min_d || turned >= self.parameters.update_min_a
        })
    }

    /// Multiplies weights by the scan's likelihood from each particle.
    fn weight(&mut self, points: &[[f64; 2]], field: &LikelihoodField) {
        self.buffers.counts.clear();
        if let Some(skip) = self.parameters.beam_skip {
            let SampleBuffers { explained, counts, .. } = &mut self.buffers;
            skip_beams(&skip, &self.particles, points, field, (explained, counts));
        }
        let skipped = self.buffers.counts.iter().filter(|counts| !**counts).count();
        let counted = (points.len() - skipped) as f64;
        let mut average = 0.0;
        for particle in &mut self.particles {
            let likelihood = field.likelihood(&particle.pose, points, &self.buffers.counts);
            // Per beam, so that scans of different numbers of points compare.
            average += particle.weight * (likelihood - 1.0) / counted;
            particle.weight *= likelihood;
        }
        normalize(&mut self.particles);
        let recovery = self.parameters.recovery;
        let approach =
            |value: f64, rate: f64| if value == 0.0 { average } else { value + rate * (average - value) };
        self.slow = approach(self.slow, recovery.alpha_slow);
        self.fast = approach(self.fast, recovery.alpha_fast);
    }

    fn needs_resampling(&self) -> bool {
        let few = 0.5 * self.particles.len() as f64;
        !self.parameters.selective_resampling || effective_number(&self.particles) < few
    }

    /// Draws as many particles as KLD sampling asks for, by their weights.
    fn resample(&mut self, field: &LikelihoodField, random: &mut Random) {
        let sampling = self.parameters.sampling;
        let share = self.random_share();
        let SampleBuffers { drawn, cumulative, bins, .. } = &mut self.buffers;
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
            let lost = if random.unit() < share { field.random_pose(random) } else { None };
            let draw = random.unit() * total;
            let at = cumulative.partition_point(|sum| *sum <= draw);
            let chosen = || self.particles[at.min(self.particles.len() - 1)].pose;
            let pose = lost.unwrap_or_else(chosen);
            drawn.push(Particle { pose, weight: 1.0 });
            bins.add(&pose, 1.0);
            needed = sampling.particles(bins.len());
        }
        std::mem::swap(&mut self.particles, drawn);
        normalize(&mut self.particles);
    }

    /// Share of random particles: how far scans are less likely than they were.
    fn random_share(&self) -> f64 {
        let recovery = self.parameters.recovery;
        if recovery.alpha_slow <= 0.0 || self.slow <= 0.0 {
            return 0.0;
        }
        math::max(0.0, 1.0 - self.fast / self.slow)
    }

    /// Returns mean and covariance of the heaviest cluster of particles; `None` while the pose is unknown.
    pub fn estimate(&mut self) -> Option<PoseEstimate> {
        let SampleBuffers { bins, stack, .. } = &mut self.buffers;
        bins.clear(self.parameters.sampling.max_particles);
        self.particles.iter().for_each(|particle| bins.add(&particle.pose, particle.weight));
        let heaviest = bins.heaviest_cluster(stack)?;
        let in_cluster =
            || self.particles.iter().filter(|particle| bins.cluster(&particle.pose) == Some(heaviest));
        Some(moments(in_cluster))
    }
}

/// Mean and covariance of particles.
fn moments<'a, I: Iterator<Item = &'a Particle>>(particles: impl Fn() -> I) -> PoseEstimate {
    let (mut weight, mut x, mut y, mut sine, mut cosine) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for Particle { pose, weight: own } in particles() {
        weight += own;
        x += own * pose.x;
        y += own * pose.y;
        sine += own * math::sin(pose.theta);
        cosine += own * math::cos(pose.theta);
    }
    let pose = Pose2 { x: x / weight, y: y / weight, theta: math::atan2(sine, cosine) };
    let mut covariance = [0.0; 9];
    for particle in particles() {
        let other = particle.pose;
        let error = [other.x - pose.x, other.y - pose.y, math::angle_between(pose.theta, other.theta)];
        for (at, entry) in covariance.iter_mut().enumerate() {
            *entry += particle.weight / weight * error[at / 3] * error[at % 3];
        }
    }
    PoseEstimate { pose, covariance }
}

/// Finds which beams count: those that enough particles explain; all, if most beams would be left out. `explained` is
/// a buffer.
fn skip_beams(
    skip: &BeamSkip,
    particles: &[Particle],
    points: &[[f64; 2]],
    field: &LikelihoodField,
    (explained, counts): (&mut Vec<f64>, &mut Vec<bool>),
) {
    explained.clear();
    explained.resize(points.len(), 0.0);
    for Particle { pose, weight } in particles {
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        for ([x, y], explained) in points.iter().zip(&mut *explained) {
            let end = (pose.x + x * cosine - y * sine, pose.y + x * sine + y * cosine);
            if field.distance(end.0, end.1) < skip.distance {
                *explained += weight;
            }
        }
    }
    counts.extend(explained.iter().map(|share| *share > skip.threshold));
    let skipped = counts.iter().filter(|counts| !**counts).count() as f64;
    if skipped >= skip.error_threshold * points.len() as f64 {
        counts.fill(true);
    }
}

/// Farther poses are faults of what sent them, m.
const FARTHEST: f64 = 1e6;

fn is_plausible(pose: &Pose2) -> bool {
    // Also false for what is no number.
    pose.x.abs() <= FARTHEST && pose.y.abs() <= FARTHEST && pose.theta.is_finite()
}
