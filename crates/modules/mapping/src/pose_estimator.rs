use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use slate_interfaces::{Odometry, Orientation, Pose2, PoseEstimate, Position};
use slate_module::prelude::*;

/// Ports of [`PoseEstimator`].
#[ports]
pub struct PoseEstimatorIo {
    /// Odometry of the wheels.
    odometry: Input<Odometry>,
    /// Position in the map frame from a positioning system; optional.
    position: Input<Position>,
    /// Heading in the map frame from a compass; optional.
    orientation: Input<Orientation>,
    /// Manual pose reset, as RViz's `initialpose`.
    initial_pose: Inbox<Pose2>,
    /// Estimated pose in the map frame, with its covariance.
    estimate: Output<PoseEstimate>,
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

/// Belief of a planar pose: mean (x, y, heading) and covariance.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct PoseFilter {
    mean: Vector3<f64>,
    covariance: Matrix3<f64>,
}

/// The largest coordinate, m, and heading, rad, of a manual reset: half of the earth's circumference.
const LARGEST: f64 = 2e7;

#[module(stage = SensorProcess)]
impl Module for PoseEstimator {
    type Io = PoseEstimatorIo;
    type Params = PoseEstimatorParams;
    type State = PoseEstimatorState;

    fn tick(
        state: &mut PoseEstimatorState,
        io: &PoseEstimatorIo,
        params: &PoseEstimatorParams,
        now: &Tick,
    ) -> Outcome {
        let start = [params.start_x, params.start_y, params.start_theta];
        let filter = state.filter.get_or_insert_with(|| PoseFilter::new(start, params));
        let mut is_new = false;
        if let Some(Odometry { pose: Pose2 { x, y, theta }, .. }) = io.odometry.updated()
            && [x, y, theta].iter().all(|number| number.is_finite())
        {
            let pose = [*x, *y, *theta];
            if let Some(from) = state.odometry.replace(pose) {
                filter.predict(from, pose, params);
            }
            is_new = true;
        }
        if let Some(position) = io.position.updated() {
            let variance = params.position_stddev * params.position_stddev;
            for (axis, measured) in [position.x, position.y].into_iter().enumerate() {
                filter.update(axis, measured - filter.mean[axis], variance);
            }
            is_new = true;
        }
        if let Some(orientation) = io.orientation.updated() {
            let variance = params.orientation_stddev * params.orientation_stddev;
            filter.update(2, math::angle_between(filter.mean[2], orientation.theta), variance);
            is_new = true;
        }
        for reset in io.initial_pose.iter() {
            let pose = [reset.x, reset.y, reset.theta];
            // NaN is not below the limit either.
            if pose.iter().all(|number| number.abs() <= LARGEST) {
                *filter = PoseFilter::new(pose, params);
                is_new = true;
            } else {
                now.warn(format_args!(
                    "invalid initial pose ({}, {}, {}): expected numbers of at most {LARGEST}",
                    reset.x, reset.y, reset.theta
                ));
                reset.refuse(1);
            }
        }
        if is_new {
            io.estimate.set(filter.estimate());
        }
        Outcome::Ok
    }
}

impl PoseFilter {
    /// Belief at a start or after a manual reset.
    fn new([x, y, theta]: [f64; 3], params: &PoseEstimatorParams) -> Self {
        let stddev = Vector3::new(
            params.start_position_stddev,
            params.start_position_stddev,
            params.start_heading_stddev,
        );
        Self {
            mean: Vector3::new(x, y, math::wrap_angle(theta)),
            covariance: Matrix3::from_diagonal(&stddev.component_mul(&stddev)),
        }
    }

    /// EKF prediction from an odometry increment, between two poses of the odometry frame.
    fn predict(&mut self, from: [f64; 3], to: [f64; 3], params: &PoseEstimatorParams) {
        let increment = Vector2::new(to[0] - from[0], to[1] - from[1]);
        let axes = rotation(self.mean[2]);
        let translation = axes * rotation(from[2]).transpose() * increment;
        let turn = math::angle_between(from[2], to[2]);
        self.mean += Vector3::new(translation.x, translation.y, turn);
        self.mean[2] = math::wrap_angle(self.mean[2]);
        // Jacobian of the motion model.
        let jacobian = Matrix3::new(1.0, 0.0, -translation.y, 0.0, 1.0, translation.x, 0.0, 0.0, 1.0);
        let mut covariance = jacobian * self.covariance * jacobian.transpose();
        // Variances grow with the path's length, so that the number of increments makes no difference.
        let length = math::hypot(increment.x, increment.y);
        let along = params.odometry_translation_stddev * params.odometry_translation_stddev * length;
        let noise = axes * Matrix2::from_diagonal(&Vector2::new(along, along / 4.0)) * axes.transpose();
        let mut position = covariance.fixed_view_mut::<2, 2>(0, 0);
        position += noise;
        covariance[(2, 2)] +=
            params.odometry_rotation_stddev * params.odometry_rotation_stddev * (length + turn.abs());
        // Rounding must not make it asymmetric.
        self.covariance = (covariance + covariance.transpose()) * 0.5;
    }

    /// EKF update by a measurement of x (axis 0), y (1) or the heading (2).
    fn update(&mut self, axis: usize, innovation: f64, variance: f64) {
        let innovation_variance = self.covariance[(axis, axis)] + variance;
        if !innovation.is_finite() || innovation_variance <= 0.0 {
            return;
        }
        let row = self.covariance.row(axis).into_owned();
        let gain = row.transpose() / innovation_variance;
        self.mean += gain * innovation;
        self.mean[2] = math::wrap_angle(self.mean[2]);
        self.covariance -= gain * row;
    }

    fn estimate(&self) -> PoseEstimate {
        let mut covariance = [0.0; 9];
        // Row by row, where nalgebra stores columns.
        covariance.copy_from_slice(self.covariance.transpose().as_slice());
        PoseEstimate { pose: Pose2 { x: self.mean.x, y: self.mean.y, theta: self.mean.z }, covariance }
    }
}

/// Rotation matrix of an angle, by the deterministic functions of `math`.
fn rotation(angle: f64) -> Matrix2<f64> {
    let (sine, cosine) = (math::sin(angle), math::cos(angle));
    Matrix2::new(cosine, -sine, sine, cosine)
}
