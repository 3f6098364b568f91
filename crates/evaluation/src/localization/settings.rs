//! Parameters of the localization that is evaluated.

use slate_localization::{
    Candidates, KldSampling, LaserModelType, MonteCarloParameters, OdometryAlphas, Recovery, SensorModel,
};

/// Beams of a scan, `max_beams`.
pub const BEAMS: usize = 60;

/// Returns the sensor model.
pub fn sensor_model(range_max: f64) -> SensorModel {
    SensorModel {
        laser_model_type: LaserModelType::LikelihoodFieldProb,
        sigma_hit: 0.1,
        laser_max_range: range_max,
        ..SensorModel::default()
    }
}

/// Returns the parameters of the filter.
pub fn parameters() -> MonteCarloParameters {
    MonteCarloParameters {
        alphas: OdometryAlphas { alpha1: 0.05, alpha2: 0.02, alpha3: 0.02, alpha4: 0.02 },
        selective_resampling: true,
        sampling: KldSampling { max_particles: 20_000, ..MonteCarloParameters::default().sampling },
        recovery: Recovery { alpha_slow: 0.001, alpha_fast: 0.1 },
        candidates: Candidates { global: 500_000, recovery: 50_000 },
        ..MonteCarloParameters::default()
    }
}
