use slate_interfaces::{Odometry, Orientation, Pose2, PoseEstimate, Position};
use slate_mapek::prelude::*;
use slate_module::prelude::*;

use crate::pose_belief::PoseBelief;
use crate::pose_filter::OdometryNoise;

/// Ports of [`PoseEstimator`].
#[ports]
pub struct PoseEstimatorIo {
    /// Odometry of the wheels.
    odometry: Observed<Odometry>,
    /// Position in the map frame from a positioning system; optional.
    position: Observed<Position>,
    /// Heading in the map frame from a compass; optional.
    orientation: Observed<Orientation>,
    /// Manual pose reset, as RViz's `initialpose`.
    initial_pose: Inbox<Pose2>,
}

/// Parameters of [`PoseEstimator`]; `stddev` is a standard deviation.
#[params]
pub struct PoseEstimatorParams {
    #[param(default = 0.0, unit = "m", doc = "initial x")]
    start_x: f64,
    #[param(default = 0.0, unit = "m", doc = "initial y")]
    start_y: f64,
    #[param(default = 0.0, range = -3.2..=3.2, unit = "rad", doc = "initial heading")]
    start_theta: f64,
    #[param(default = 0.05, range = 0.0..=10.0, unit = "m", doc = "initial x and y, and those of a manual reset")]
    start_position_stddev: f64,
    #[param(default = 0.05, range = 0.0..=3.2, unit = "rad", doc = "initial heading, and that of a manual reset")]
    start_heading_stddev: f64,
    #[param(default = 0.05, range = 0.0..=10.0, unit = "m/sqrt(m)", doc = "odometry's translation along the path; half as much across")]
    odometry_translation_stddev: f64,
    #[param(default = 0.05, range = 0.0..=3.2, unit = "rad/sqrt(m)", doc = "odometry's rotation by a meter, or a radian")]
    odometry_rotation_stddev: f64,
    #[param(default = 0.05, range = 0.0001..=100.0, unit = "m", doc = "x and y of the positioning system")]
    position_stddev: f64,
    #[param(default = 0.05, range = 0.0001..=3.2, unit = "rad", doc = "heading of the compass")]
    orientation_stddev: f64,
}

impl PoseEstimatorParams {
    fn start_stddev(&self) -> [f64; 2] {
        [self.start_position_stddev, self.start_heading_stddev]
    }

    fn odometry_noise(&self) -> OdometryNoise {
        OdometryNoise {
            translation_stddev: self.odometry_translation_stddev,
            rotation_stddev: self.odometry_rotation_stddev,
        }
    }
}

/// Estimates a planar pose with an extended Kalman filter.
///
/// Odometry predicts; a positioning system and a compass, if linked, update (Thrun, Burgard and Fox, *Probabilistic Robotics*, 3.3).
pub struct PoseEstimator;

/// Without a gate: a person corrects it.
const NO_GATE: f64 = f64::INFINITY;

/// Largest coordinate (m) and heading (rad) of a manual reset.
/// Half of the earth's circumference.
const LARGEST: f64 = 2e7;

impl Analyze for PoseEstimator {
    const NAME: &'static str = "pose_estimator";
    const DOC: &'static str = "Estimates the pose in the map frame, with its covariance.";
    type Observed = PoseEstimatorIo;
    type Params = PoseEstimatorParams;
    type State = PoseBelief;
    type Value = PoseEstimate;

    fn process(
        belief: &mut PoseBelief,
        io: &PoseEstimatorIo,
        params: &PoseEstimatorParams,
        now: &Tick,
    ) -> Option<PoseEstimate> {
        if !belief.is_known() {
            let start = Pose2 { x: params.start_x, y: params.start_y, theta: params.start_theta };
            belief.begin(start, params.start_stddev());
        }
        let mut is_new = false;
        if let Some(odometry) = io.odometry.updated() {
            is_new |= belief.predict(odometry.pose, Some(&params.odometry_noise()));
        }
        if let Some(position) = io.position.updated() {
            is_new |= belief.update_position([position.x, position.y], params.position_stddev, NO_GATE);
        }
        if let Some(orientation) = io.orientation.updated() {
            is_new |= belief.update_heading(orientation.theta, params.orientation_stddev, NO_GATE);
        }
        for reset in io.initial_pose.iter() {
            let pose = [reset.x, reset.y, reset.theta];
            // NaN is not below the limit either.
            if pose.iter().all(|number| number.abs() <= LARGEST) {
                belief.begin(*reset, params.start_stddev());
                is_new = true;
            } else {
                now.warn(format_args!(
                    "invalid initial pose ({}, {}, {}): expected numbers of at most {LARGEST}",
                    reset.x, reset.y, reset.theta
                ));
                reset.refuse(1);
            }
        }
        belief.estimate().filter(|_| is_new)
    }
}
