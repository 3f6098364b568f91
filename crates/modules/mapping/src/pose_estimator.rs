use serde::{Deserialize, Serialize};
use slate_interfaces::{Odometry, Orientation, Pose2, PoseEstimate, Position};
use slate_module::prelude::*;

/// Ports of [`PoseEstimator`].
#[ports]
pub struct PoseEstimatorIo {
    /// How the wheels have turned.
    odometry: Input<Odometry>,
    /// Where a positioning system sees the robot, if there is one.
    position: Input<Position>,
    /// Which way a compass says that it looks, if there is one.
    orientation: Input<Orientation>,
    /// Where it is, as a person says who sees it.
    place: Inbox<Pose2>,
    /// Where it is, and how sure that is.
    estimate: Output<PoseEstimate>,
}

/// Parameters of [`PoseEstimator`]. What is measured is off by its deviation, or as much in the mean.
#[params]
pub struct PoseEstimatorParams {
    #[param(default = 0.0, unit = "m", doc = "start, to the east")]
    start_x: f64,
    #[param(default = 0.0, unit = "m", doc = "start, to the north")]
    start_y: f64,
    #[param(default = 0.0, range = -3.2..=3.2, unit = "rad", doc = "where it looks at the start")]
    start_theta: f64,
    #[param(default = 0.05, range = 0.0..=10.0, unit = "m", doc = "deviation of a start, and of where a person puts it")]
    start_deviation: f64,
    #[param(default = 0.05, range = 0.0..=3.2, unit = "rad", doc = "deviation of the heading at a start")]
    start_turn_deviation: f64,
    #[param(default = 0.05, range = 0.0..=10.0, unit = "m", doc = "deviation of the odometry after a metre")]
    way_deviation: f64,
    #[param(default = 0.05, range = 0.0..=3.2, unit = "rad", doc = "deviation of its heading after a metre, or a radian")]
    turn_deviation: f64,
    #[param(default = 0.05, range = 0.0001..=100.0, unit = "m", doc = "deviation of the positioning system")]
    position_deviation: f64,
    #[param(default = 0.05, range = 0.0001..=3.2, unit = "rad", doc = "deviation of the compass")]
    orientation_deviation: f64,
}

/// Tells where the robot is, and how sure that is, from odometry, and from a positioning system and a compass where there
/// are some: an extended Kalman filter.
pub struct PoseEstimator;

/// State of [`PoseEstimator`].
#[derive(Default, Serialize, Deserialize)]
pub struct PoseEstimatorState {
    belief: Option<Belief>,
    /// The odometry's pose when it was heard last.
    heard: Option<[f64; 3]>,
}

type Matrix = [[f64; 3]; 3];

/// A pose with its covariance.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Belief {
    pose: [f64; 3],
    covariance: Matrix,
}

/// No place is farther away, m, and nobody turns a heading more often, rad.
const FARTHEST: f64 = 2e7;

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
        let belief = state.belief.get_or_insert_with(|| Belief::at(start, params));
        let mut is_new = false;
        if let Some(Odometry { pose: Pose2 { x, y, theta }, .. }) = io.odometry.new()
            && [x, y, theta].iter().all(|number| number.is_finite())
        {
            let pose = [*x, *y, *theta];
            if let Some(before) = state.heard.replace(pose) {
                belief.go(before, pose, params);
            }
            is_new = true;
        }
        if let Some(position) = io.position.new() {
            let variance = params.position_deviation * params.position_deviation;
            for (axis, measured) in [position.x, position.y].into_iter().enumerate() {
                belief.learn(axis, measured - belief.pose[axis], variance);
            }
            is_new = true;
        }
        if let Some(orientation) = io.orientation.new() {
            let variance = params.orientation_deviation * params.orientation_deviation;
            belief.learn(2, math::angle_between(belief.pose[2], orientation.theta), variance);
            is_new = true;
        }
        for place in io.place.iter() {
            let pose = [place.x, place.y, place.theta];
            // A robot that is farther away than the other side of the earth is nowhere, and so is NaN.
            if pose.iter().all(|number| number.abs() <= FARTHEST) {
                *belief = Belief::at(pose, params);
                is_new = true;
            } else {
                now.warn(format_args!(
                    "the pose ({}, {}, {}) is refused: no number of it may be beyond {FARTHEST}",
                    place.x, place.y, place.theta
                ));
                place.refuse(1);
            }
        }
        if is_new {
            io.estimate.set(belief.told());
        }
        Outcome::Ok
    }
}

impl Belief {
    /// As somebody says who sees it.
    fn at([x, y, theta]: [f64; 3], params: &PoseEstimatorParams) -> Self {
        let (place, turn) = (params.start_deviation, params.start_turn_deviation);
        let mut covariance = Matrix::default();
        (covariance[0][0], covariance[1][1], covariance[2][2]) = (place * place, place * place, turn * turn);
        Self { pose: [x, y, math::wrap_angle(theta)], covariance }
    }

    /// It has moved as the odometry says, from one pose of its to another.
    fn go(&mut self, before: [f64; 3], after: [f64; 3], params: &PoseEstimatorParams) {
        let (dx, dy) = (after[0] - before[0], after[1] - before[1]);
        let (sine, cosine) = (math::sin(before[2]), math::cos(before[2]));
        let (ahead, left) = (dx * cosine + dy * sine, dy * cosine - dx * sine);
        let turn = math::angle_between(before[2], after[2]);
        let way = math::hypot(ahead, left);
        let (sine, cosine) = (math::sin(self.pose[2]), math::cos(self.pose[2]));
        let (east, north) = (ahead * cosine - left * sine, ahead * sine + left * cosine);
        self.pose[0] += east;
        self.pose[1] += north;
        self.pose[2] = math::wrap_angle(self.pose[2] + turn);
        // How its own heading turns the way.
        let step: Matrix = [[1.0, 0.0, -north], [0.0, 1.0, east], [0.0, 0.0, 1.0]];
        self.covariance = product(&product(&step, &self.covariance), &transposed(&step));
        // What a way adds grows with its length, so that it does not matter in how many parts it is heard.
        let along = params.way_deviation * params.way_deviation * way;
        let across = along / 4.0;
        let heading = params.turn_deviation * params.turn_deviation * (way + turn.abs());
        self.covariance[0][0] += along * cosine * cosine + across * sine * sine;
        self.covariance[1][1] += along * sine * sine + across * cosine * cosine;
        self.covariance[0][1] += (along - across) * sine * cosine;
        self.covariance[1][0] = self.covariance[0][1];
        self.covariance[2][2] += heading;
    }

    /// One of x, y and theta is measured, by so much more than was believed.
    fn learn(&mut self, axis: usize, surprise: f64, variance: f64) {
        let certainty = self.covariance[axis][axis] + variance;
        if !surprise.is_finite() || certainty <= 0.0 {
            return;
        }
        let row = self.covariance[axis];
        let gain = row.map(|with| with / certainty);
        for (place, gain) in gain.into_iter().enumerate() {
            self.pose[place] += gain * surprise;
            for (column, with) in row.into_iter().enumerate() {
                self.covariance[place][column] -= gain * with;
            }
        }
        self.pose[2] = math::wrap_angle(self.pose[2]);
    }

    fn told(&self) -> PoseEstimate {
        let [x, y, theta] = self.pose;
        let mut covariance = [0.0; 9];
        for (place, number) in covariance.iter_mut().enumerate() {
            *number = self.covariance[place / 3][place % 3];
        }
        PoseEstimate { pose: Pose2 { x, y, theta }, covariance }
    }
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let mut product = Matrix::default();
    for (row, line) in product.iter_mut().enumerate() {
        for (column, number) in line.iter_mut().enumerate() {
            *number = a[row][0] * b[0][column] + a[row][1] * b[1][column] + a[row][2] * b[2][column];
        }
    }
    product
}

fn transposed(matrix: &Matrix) -> Matrix {
    let mut transposed = Matrix::default();
    for (row, line) in transposed.iter_mut().enumerate() {
        for (column, number) in line.iter_mut().enumerate() {
            *number = matrix[column][row];
        }
    }
    transposed
}
