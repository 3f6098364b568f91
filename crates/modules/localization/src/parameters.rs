//! Parameters, with the names and defaults of Nav2.

use serde::{Deserialize, Serialize};
use slate_module::InvalidParameter;

use crate::motion_model::OdometryAlphas;

/// Parameters of [`MonteCarloLocalization`](crate::MonteCarloLocalization).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MonteCarloParameters {
    /// Noise of the odometry, `alpha1` to `alpha4`.
    pub alphas: OdometryAlphas,
    /// Least translation between two updates by a scan, `update_min_d`, m.
    pub update_min_d: f64,
    /// Least rotation between two updates by a scan, `update_min_a`, rad.
    pub update_min_a: f64,
    /// Updates between two resamplings, `resample_interval`.
    pub resample_interval: u32,
    /// Selective resampling, `selective_resampling`.
    /// If true, particles are resampled only while their effective number is below half of theirs.
    pub selective_resampling: bool,
    /// Number of particles.
    pub sampling: KldSampling,
    /// Random particles after the robot has been moved by hand.
    pub recovery: Recovery,
    /// Poses that random particles are chosen from; any pose by default, as in Nav2.
    pub candidates: Candidates,
    /// Skipping of beams that hit unmapped objects, `do_beamskip`.
    /// `None` by default.
    pub beam_skip: Option<BeamSkip>,
}

/// KLD sampling.
/// Fox, 2003, *Adapting the sample size in particle filters through KLD-sampling*.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct KldSampling {
    /// `min_particles`.
    pub min_particles: usize,
    /// `max_particles`.
    pub max_particles: usize,
    /// Largest error between the true and the estimated distribution, `pf_err`.
    pub pf_err: f64,
    /// Upper standard normal quantile for the error bound, `pf_z`.
    /// Its probability is that of an error below the bound.
    pub pf_z: f64,
}

/// Augmented recovery by random particles.
/// Thrun, Burgard and Fox, *Probabilistic Robotics*, table 8.3: random particles come in while the likelihood of scans,
/// averaged over a short time, falls below that over a long time. Rates of 0 switch it off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Recovery {
    /// Rate of the average over a long time, `recovery_alpha_slow`.
    pub alpha_slow: f64,
    /// Rate of the average over a short time, `recovery_alpha_fast`.
    pub alpha_fast: f64,
}

/// Candidate poses anywhere in the map for sensor resetting.
/// The newest scan is compared with them, and random particles are drawn from them by its likelihood (Lenser and
/// Veloso, 2000, *Sensor resetting localization for poorly modelled mobile robots*). With 0, random particles are
/// anywhere, whatever the laser sees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Candidates {
    /// Number at the first scan of a global localization.
    pub global: usize,
    /// Number at each resampling with random particles.
    pub recovery: usize,
}

/// Beam skipping: leaves out beams that most particles can't explain.
/// All count if those are most of the beams.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BeamSkip {
    /// Distance to an obstacle that explains a beam, `beam_skip_distance`, m.
    /// A particle explains a beam up to this distance.
    pub distance: f64,
    /// Least share of particles to explain a beam, `beam_skip_threshold`.
    /// Other beams are left out.
    pub threshold: f64,
    /// Share of skipped beams above which all count, `beam_skip_error_threshold`.
    /// The particles are then at a wrong place.
    pub error_threshold: f64,
}

impl Default for BeamSkip {
    fn default() -> Self {
        Self { distance: 0.5, threshold: 0.3, error_threshold: 0.9 }
    }
}

impl Default for MonteCarloParameters {
    fn default() -> Self {
        Self {
            alphas: OdometryAlphas::default(),
            update_min_d: 0.25,
            update_min_a: 0.2,
            resample_interval: 1,
            selective_resampling: false,
            sampling: KldSampling { min_particles: 500, max_particles: 2_000, pf_err: 0.05, pf_z: 0.99 },
            recovery: Recovery::default(),
            candidates: Candidates::default(),
            beam_skip: None,
        }
    }
}

impl MonteCarloParameters {
    pub(crate) fn check(&self) -> Result<(), InvalidParameter> {
        let OdometryAlphas { alpha1, alpha2, alpha3, alpha4 } = self.alphas;
        let alphas = [("alpha1", alpha1), ("alpha2", alpha2), ("alpha3", alpha3), ("alpha4", alpha4)];
        let distances = [("update_min_d", self.update_min_d), ("update_min_a", self.update_min_a)];
        for (name, value) in alphas.into_iter().chain(distances) {
            InvalidParameter::unless(value.is_finite() && value >= 0.0, name, "a number from 0")?;
        }
        let KldSampling { min_particles, max_particles, pf_err, pf_z } = self.sampling;
        InvalidParameter::unless((1..=1_000_000).contains(&max_particles), "max_particles", "1 to 1000000")?;
        let is_least = (1..=max_particles).contains(&min_particles);
        InvalidParameter::unless(is_least, "min_particles", "1 to max_particles")?;
        InvalidParameter::unless(pf_err > 0.0 && pf_err <= 1.0, "pf_err", "a number above 0, up to 1")?;
        InvalidParameter::unless(pf_z.is_finite() && pf_z >= 0.0, "pf_z", "a number from 0")?;
        for (name, count) in
            [("global_candidates", self.candidates.global), ("recovery_candidates", self.candidates.recovery)]
        {
            InvalidParameter::unless(count <= 10_000_000, name, "0 to 10000000")?;
        }
        let rates = [
            ("recovery_alpha_slow", self.recovery.alpha_slow),
            ("recovery_alpha_fast", self.recovery.alpha_fast),
        ];
        rates.into_iter().try_for_each(|(name, rate)| {
            InvalidParameter::unless((0.0..=1.0).contains(&rate), name, "a number from 0 to 1")
        })
    }
}

impl KldSampling {
    /// Returns how many particles that many occupied bins need (Fox, 2003, equation 7).
    pub(crate) fn particles(&self, bins: usize) -> usize {
        if bins < 2 {
            return self.min_particles;
        }
        let freedom = (bins - 1) as f64;
        let share = 2.0 / (9.0 * freedom);
        let root = 1.0 - share + share.sqrt() * self.pf_z;
        let needed = (freedom / (2.0 * self.pf_err) * root * root * root).ceil();
        (needed as usize).max(self.min_particles).min(self.max_particles)
    }
}
