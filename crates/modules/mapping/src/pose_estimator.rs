use serde::{Deserialize, Serialize};
use slate_interfaces::{Odometry, Orientation, Pose2, PoseEstimate, Position};
use slate_mapek::prelude::*;
use slate_module::prelude::*;

use crate::pose_filter::{Axis, OdometryNoise, PoseFilter};

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
    #[param(default = 0.05, range = 0.0..=3.2, unit = "rad/sqrt(m)", doc = "odometry's rotation by a metre, or a radian")]
    odometry_rotation_stddev: f64,
    #[param(default = 0.05, range = 0.0001..=100.0, unit = "m", doc = "x and y of the positioning system")]
    position_stddev: f64,
    #[param(default = 0.05, range = 0.0001..=3.2, unit = "rad", doc = "heading of the compass")]
    orientation_stddev: f64,
}

impl PoseEstimatorParams {
    fn start_stddev(&self) -> [f64; 3] {
        [self.start_position_stddev, self.start_position_stddev, self.start_heading_stddev]
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

/// State of [`PoseEstimator`].
#[derive(Default, Serialize, Deserialize)]
pub struct PoseEstimatorState {
    filter: Option<PoseFilter>,
    /// The newest pose of the odometry.
    odometry: Option<[f64; 3]>,
}

/// The largest coordinate, m, and heading, rad, of a manual reset: half of the earth's circumference.
const LARGEST: f64 = 2e7;

impl Analyze for PoseEstimator {
    const NAME: &'static str = "pose_estimator";
    const DOC: &'static str = "Estimates the pose in the map frame, with its covariance.";
    type Observed = PoseEstimatorIo;
    type Params = PoseEstimatorParams;
    type State = PoseEstimatorState;
    type Value = PoseEstimate;

    fn process(
        state: &mut PoseEstimatorState,
        io: &PoseEstimatorIo,
        params: &PoseEstimatorParams,
        now: &Tick,
    ) -> Option<PoseEstimate> {
        let start = [params.start_x, params.start_y, params.start_theta];
        let filter = state.filter.get_or_insert_with(|| PoseFilter::new(start, params.start_stddev()));
        let mut is_new = false;
        if let Some(Odometry { pose: Pose2 { x, y, theta }, .. }) = io.odometry.updated()
            && [x, y, theta].iter().all(|number| number.is_finite())
        {
            let pose = [*x, *y, *theta];
            if let Some(from) = state.odometry.replace(pose) {
                filter.predict(from, pose, &params.odometry_noise());
            }
            is_new = true;
        }
        if let Some(position) = io.position.updated() {
            filter.update(Axis::X, position.x, params.position_stddev);
            filter.update(Axis::Y, position.y, params.position_stddev);
            is_new = true;
        }
        if let Some(orientation) = io.orientation.updated() {
            filter.update(Axis::Heading, orientation.theta, params.orientation_stddev);
            is_new = true;
        }
        for reset in io.initial_pose.iter() {
            let pose = [reset.x, reset.y, reset.theta];
            // NaN is not below the limit either.
            if pose.iter().all(|number| number.abs() <= LARGEST) {
                *filter = PoseFilter::new(pose, params.start_stddev());
                is_new = true;
            } else {
                now.warn(format_args!(
                    "invalid initial pose ({}, {}, {}): expected numbers of at most {LARGEST}",
                    reset.x, reset.y, reset.theta
                ));
                reset.refuse(1);
            }
        }
        is_new.then(|| filter.estimate())
    }
}
