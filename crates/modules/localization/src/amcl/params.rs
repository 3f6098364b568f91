//! Parameters of the block, with the names and defaults of Nav2.

use slate_interfaces::Pose2;
use slate_module::prelude::*;

use crate::frames::FrameNames;
use crate::inputs::{BeamSelection, VelocityLimits};
use crate::monte_carlo::FARTHEST;
use crate::{
    BeamSkip, Candidates, InvalidParameter, KldSampling, LaserModelType, MonteCarloParameters,
    OdometryAlphas, Recovery, SensorModel,
};

/// Parameters of [`Amcl`](super::Amcl).
#[params]
pub struct AmclParams {
    #[param(default = 0.2, range = 0.0..=100.0, doc = "variance of the odometry's rotation from rotation")]
    alpha1: f64,
    #[param(default = 0.2, range = 0.0..=100.0, unit = "rad^2/m^2", doc = "variance of rotation from translation")]
    alpha2: f64,
    #[param(default = 0.2, range = 0.0..=100.0, doc = "variance of translation from translation")]
    alpha3: f64,
    #[param(default = 0.2, range = 0.0..=100.0, unit = "m^2/rad^2", doc = "variance of translation from rotation")]
    alpha4: f64,
    #[param(default = 0.25, range = 0.0..=10.0, unit = "m", doc = "minimum translation between two updates")]
    update_min_d: f64,
    #[param(default = 0.2, range = 0.0..=3.2, unit = "rad", doc = "minimum rotation between two updates")]
    update_min_a: f64,
    #[param(default = 1, range = 1..=100, doc = "updates between two resamplings")]
    resample_interval: i64,
    #[param(
        default = false,
        doc = "resample particles only while their effective number is below half of theirs"
    )]
    selective_resampling: Bool,
    #[param(default = 500, range = 1..=20_000, doc = "minimum number of particles")]
    min_particles: i64,
    #[param(default = 2000, range = 1..=20_000, doc = "maximum number of particles")]
    max_particles: i64,
    #[param(default = 0.05, range = 0.001..=1.0, doc = "maximum error between true and estimated distribution")]
    pf_err: f64,
    #[param(default = 0.99, range = 0.0..=10.0, doc = "upper quantile for the probability that the error is less")]
    pf_z: f64,
    #[param(default = 0.0, range = 0.0..=1.0, doc = "rate of the likelihood's average over a long time; 0 for no recovery")]
    recovery_alpha_slow: f64,
    #[param(default = 0.0, range = 0.0..=1.0, doc = "rate of its average over a short time; 0 for no recovery")]
    recovery_alpha_fast: f64,
    #[param(default = 0, range = 0..=1_000_000, doc = "poses that the first scan of a global localization is compared with; 0 for none")]
    global_candidates: i64,
    #[param(default = 0, range = 0..=1_000_000, doc = "poses that random particles are chosen from by the scan; 0 for any pose")]
    recovery_candidates: i64,
    #[param(
        default = "likelihood_field",
        doc = "likelihood_field, or likelihood_field_prob: the product of the beams' likelihoods"
    )]
    laser_model_type: Text<28>,
    #[param(default = 60, range = 1..=2000, doc = "maximum number of beams of a scan that are used")]
    max_beams: i64,
    #[param(default = 100.0, range = 0.1..=1000.0, unit = "m", doc = "ranges from here on hit nothing")]
    laser_max_range: f64,
    #[param(default = 0.0, range = 0.0..=1000.0, unit = "m", doc = "ranges up to here are no measurement")]
    laser_min_range: f64,
    #[param(default = 2.0, range = 0.01..=100.0, unit = "m", doc = "distance to an obstacle from which all are equally unlikely")]
    laser_likelihood_max_dist: f64,
    #[param(default = 0.2, range = 0.001..=10.0, unit = "m", doc = "standard deviation of a beam's end")]
    sigma_hit: f64,
    #[param(default = 0.5, range = 0.0..=1.0, doc = "share of beams that end at an obstacle of the map")]
    z_hit: f64,
    #[param(default = 0.5, range = 0.0..=1.0, doc = "share of beams that end anywhere")]
    z_rand: f64,
    #[param(default = false, doc = "leave out beams that few particles explain")]
    do_beamskip: Bool,
    #[param(default = 0.5, range = 0.0..=10.0, unit = "m", doc = "distance up to which a particle explains a beam")]
    beam_skip_distance: f64,
    #[param(default = 0.3, range = 0.0..=1.0, doc = "minimum share of particles that explain a beam")]
    beam_skip_threshold: f64,
    #[param(default = 0.9, range = 0.0..=1.0, doc = "share of beams left out from which all count")]
    beam_skip_error_threshold: f64,
    #[param(default = false, doc = "true: begin at the initial pose; false: anywhere in the map")]
    set_initial_pose: Bool,
    #[param(default = 0.0, unit = "m", doc = "initial x in the map")]
    initial_pose_x: f64,
    #[param(default = 0.0, unit = "m", doc = "initial y in the map")]
    initial_pose_y: f64,
    #[param(default = 0.0, unit = "rad", doc = "initial heading in the map")]
    initial_pose_yaw: f64,
    #[param(default = 0.5, range = 0.0..=100.0, unit = "m", doc = "deviation of initial x and y, and those of a manual reset")]
    initial_position_stddev: f64,
    #[param(default = 0.26, range = 0.0..=3.2, unit = "rad", doc = "deviation of the initial heading, and that of a manual reset")]
    initial_heading_stddev: f64,
    #[param(default = 65, range = 1..=100, unit = "%", doc = "occupancy from which a cell is an obstacle")]
    occupied_threshold: i64,
    #[param(default = 1.0, range = 0.05..=60.0, unit = "s", doc = "age of the newest scan above which the laser counts as stopped")]
    scan_timeout: f64,
    #[param(default = 3.0, range = 0.1..=100.0, unit = "m/s", doc = "velocity above which the odometry counts as a jump")]
    max_linear_velocity: f64,
    #[param(default = 6.0, range = 0.1..=100.0, unit = "rad/s", doc = "angular velocity above which the odometry counts as a jump")]
    max_angular_velocity: f64,
    #[param(default = "laser", doc = "name of the laser in the robot model, which has its mount")]
    laser: Text<28>,
    #[param(default = true, doc = "publish the transform from map to odometry")]
    tf_broadcast: Bool,
    #[param(default = true, doc = "publish the transform from odometry to robot")]
    odom_broadcast: Bool,
    #[param(default = "map", doc = "frame of the map")]
    global_frame_id: Text<60>,
    #[param(default = "odom", doc = "frame of the odometry")]
    odom_frame_id: Text<60>,
    #[param(default = "base_link", doc = "frame of the robot")]
    base_frame_id: Text<60>,
}

impl AmclParams {
    pub(super) fn filter(&self) -> MonteCarloParameters {
        let beam_skip = BeamSkip {
            distance: self.beam_skip_distance,
            threshold: self.beam_skip_threshold,
            error_threshold: self.beam_skip_error_threshold,
        };
        MonteCarloParameters {
            alphas: OdometryAlphas {
                alpha1: self.alpha1,
                alpha2: self.alpha2,
                alpha3: self.alpha3,
                alpha4: self.alpha4,
            },
            update_min_d: self.update_min_d,
            update_min_a: self.update_min_a,
            resample_interval: count(self.resample_interval) as u32,
            selective_resampling: self.selective_resampling.get(),
            sampling: KldSampling {
                min_particles: count(self.min_particles),
                max_particles: count(self.max_particles),
                pf_err: self.pf_err,
                pf_z: self.pf_z,
            },
            recovery: Recovery { alpha_slow: self.recovery_alpha_slow, alpha_fast: self.recovery_alpha_fast },
            candidates: Candidates {
                global: count(self.global_candidates),
                recovery: count(self.recovery_candidates),
            },
            beam_skip: Some(beam_skip).filter(|_| self.do_beamskip.get()),
        }
    }

    /// Returns the sensor model.
    ///
    /// # Errors
    /// An unknown `laser_model_type`; `beam`, which Nav2 has too, is one.
    pub(super) fn sensor_model(&self) -> Result<SensorModel, InvalidParameter> {
        let laser_model_type = match self.laser_model_type.as_str() {
            "likelihood_field" => LaserModelType::LikelihoodField,
            "likelihood_field_prob" => LaserModelType::LikelihoodFieldProb,
            _ => {
                let expected = "likelihood_field or likelihood_field_prob";
                return Err(InvalidParameter { name: "laser_model_type", expected });
            }
        };
        Ok(SensorModel {
            laser_model_type,
            sigma_hit: self.sigma_hit,
            z_hit: self.z_hit,
            z_rand: self.z_rand,
            laser_max_range: self.laser_max_range,
            laser_likelihood_max_dist: self.laser_likelihood_max_dist,
        })
    }

    pub(super) fn beams(&self) -> BeamSelection {
        BeamSelection {
            max_beams: count(self.max_beams),
            min_range: self.laser_min_range,
            max_range: self.laser_max_range,
        }
    }

    pub(super) fn velocity_limits(&self) -> VelocityLimits {
        VelocityLimits { linear: self.max_linear_velocity, angular: self.max_angular_velocity }
    }

    pub(super) fn frames(&self) -> FrameNames<'_> {
        FrameNames {
            map: self.global_frame_id.as_str(),
            odom: self.odom_frame_id.as_str(),
            base: self.base_frame_id.as_str(),
        }
    }

    pub(super) fn initial_pose(&self) -> Option<Pose2> {
        let pose = Pose2 { x: self.initial_pose_x, y: self.initial_pose_y, theta: self.initial_pose_yaw };
        Some(pose).filter(|_| self.set_initial_pose.get())
    }

    pub(super) fn initial_stddev(&self) -> [f64; 3] {
        [self.initial_position_stddev, self.initial_position_stddev, self.initial_heading_stddev]
    }
}

/// Returns a number whose range the host has checked.
fn count(number: i64) -> usize {
    usize::try_from(number).unwrap_or(0)
}

/// Returns the defect of an initial pose that the filter refuses.
pub(super) fn invalid_initial_pose(pose: &Pose2) -> InvalidParameter {
    let is_far = |coordinate: f64| coordinate.is_nan() || coordinate.abs() > FARTHEST;
    let name = match () {
        () if is_far(pose.x) => "initial_pose_x",
        () if is_far(pose.y) => "initial_pose_y",
        () => "initial_pose_yaw",
    };
    InvalidParameter { name, expected: "a number of at most 1e6" }
}
