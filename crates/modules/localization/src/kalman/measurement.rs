//! Measurement models.

use nalgebra::{Matrix1, Matrix2, SMatrix, SVector, Vector1, Vector2};
use serde::{Deserialize, Serialize};
use slate_module::math;

use super::belief::{Innovation, Linearization, PlanarBelief, SIZE, StateVariable};

/// Range below which the bearing of a landmark is unknown, m.
const NEAREST: f64 = 1e-6;

/// Measurement that corrects a [`PlanarFilter`](super::PlanarFilter).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum FilterMeasurement {
    /// Variables of the state.
    Variables(MeasuredVariables),
    /// Variables measured by odometry.
    /// Its velocities have the scales of the state.
    Odometry(MeasuredVariables),
    /// Position in the filter's frame, m, with its covariance row by row, m².
    Position {
        /// x and y.
        position: [f64; 2],
        /// Covariance of x and y.
        covariance: [f64; 4],
    },
    /// Angular velocity of a gyroscope, counter-clockwise, rad/s.
    /// It includes the gyroscope's bias.
    Gyroscope {
        /// Measured angular velocity, rad/s.
        angular_velocity: f64,
        /// Standard deviation.
        stddev: f64,
    },
    /// Range and bearing of a landmark whose place is known.
    Landmark(MeasuredLandmark),
}

/// Values of some variables of the state, whose errors are independent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeasuredVariables {
    /// Values and standard deviations of x to angular velocity.
    /// They are in the order of [`StateVariable`].
    values: [Option<(f64, f64)>; 6],
}

/// Kind of a landmark's range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum RangeKind {
    /// Distance from the robot's origin.
    #[default]
    Distance,
    /// Distance along the robot's x axis.
    /// As measured by a camera that knows the landmark's size.
    Depth,
}

/// Range and bearing of a landmark.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredLandmark {
    /// Place of the landmark in the filter's frame, m.
    pub landmark: [f64; 2],
    /// Range, m.
    pub range: f64,
    /// Kind of the range.
    pub range_kind: RangeKind,
    /// Bearing from the robot's front, counter-clockwise, rad.
    pub bearing: f64,
    /// Standard deviation of the range, m.
    pub range_stddev: f64,
    /// Standard deviation of the bearing, rad.
    pub bearing_stddev: f64,
}

/// Scale of each variable in an odometry.
const SCALES: [Option<StateVariable>; 6] = [
    None,
    None,
    None,
    Some(StateVariable::OdometryLinearScale),
    Some(StateVariable::OdometryLinearScale),
    Some(StateVariable::OdometryAngularScale),
];

impl MeasuredVariables {
    /// Adds a variable, with its standard deviation.
    /// The bias of a gyroscope can't be measured.
    #[must_use]
    pub fn with(mut self, variable: StateVariable, value: f64, stddev: f64) -> Self {
        if let Some(measured) = self.values.get_mut(variable as usize) {
            *measured = Some((value, stddev));
        }
        self
    }

    fn apply(&self, belief: &mut PlanarBelief, gate: f64, has_scales: bool) -> Innovation {
        // A variable that is not measured is one that meets its expectation and tells nothing.
        let noise = SVector::from(self.values.map(|value| value.map_or(1.0, |(_, stddev)| stddev * stddev)));
        belief.correct(&SMatrix::<f64, 6, 6>::from_diagonal(&noise), gate, 1, |state| {
            let mut residual = SVector::<f64, 6>::zeros();
            let mut jacobian = SMatrix::<f64, 6, SIZE>::zeros();
            for (at, value) in self.values.iter().enumerate() {
                let Some((value, _)) = value else { continue };
                let scale = SCALES[at].filter(|_| has_scales).map(|scale| scale as usize);
                let factor = scale.map_or(1.0, |scale| state[scale]);
                jacobian[(at, at)] = factor;
                if let Some(scale) = scale {
                    jacobian[(at, scale)] = state[at];
                }
                residual[at] = match at == StateVariable::Yaw as usize {
                    true => math::angle_between(state[at], *value),
                    false => value - factor * state[at],
                };
            }
            Linearization { residual, jacobian }
        })
    }
}

impl MeasuredLandmark {
    /// Corrects a belief by a landmark, without its signature.
    /// *Probabilistic Robotics*, table 7.2.
    fn apply(&self, belief: &mut PlanarBelief, gate: f64, iterations: u32) -> Innovation {
        let stddev = Vector2::new(self.range_stddev, self.bearing_stddev);
        let noise = Matrix2::from_diagonal(&stddev.component_mul(&stddev));
        belief.correct(&noise, gate, iterations, |state| {
            let (right, up) = (self.landmark[0] - state[0], self.landmark[1] - state[1]);
            let range = math::max(math::hypot(right, up), NEAREST);
            let (along, across) = (right / range, up / range);
            let bearing = math::wrap_angle(math::atan2(up, right) - state[2]);
            let scale = StateVariable::LandmarkRangeScale as usize;
            let mut jacobian = SMatrix::<f64, 2, SIZE>::zeros();
            let expected = match self.range_kind {
                RangeKind::Distance => {
                    (jacobian[(0, 0)], jacobian[(0, 1)]) = (-along, -across);
                    range
                }
                RangeKind::Depth => {
                    let (sine, cosine) = (math::sin(state[2]), math::cos(state[2]));
                    (jacobian[(0, 0)], jacobian[(0, 1)]) = (-cosine, -sine);
                    jacobian[(0, 2)] = up * cosine - right * sine;
                    right * cosine + up * sine
                }
            };
            (0..3).for_each(|at| jacobian[(0, at)] *= state[scale]);
            jacobian[(0, scale)] = expected;
            (jacobian[(1, 0)], jacobian[(1, 1)]) = (across / range, -along / range);
            jacobian[(1, 2)] = -1.0;
            let residual = Vector2::new(
                self.range - state[scale] * expected,
                math::angle_between(bearing, self.bearing),
            );
            Linearization { residual, jacobian }
        })
    }
}

impl FilterMeasurement {
    /// Corrects a belief; changes nothing outside of the gate.
    /// The gate is a Mahalanobis distance.
    pub(super) fn apply(&self, belief: &mut PlanarBelief, gate: f64, iterations: u32) -> Innovation {
        match self {
            Self::Variables(variables) => variables.apply(belief, gate, false),
            Self::Odometry(variables) => variables.apply(belief, gate, true),
            Self::Landmark(landmark) => landmark.apply(belief, gate, iterations),
            Self::Position { position, covariance } => {
                let noise = Matrix2::from_row_slice(covariance);
                belief.correct(&noise, gate, 1, |state| {
                    let residual = Vector2::new(position[0] - state[0], position[1] - state[1]);
                    let mut jacobian = SMatrix::<f64, 2, SIZE>::zeros();
                    (jacobian[(0, 0)], jacobian[(1, 1)]) = (1.0, 1.0);
                    Linearization { residual, jacobian }
                })
            }
            Self::Gyroscope { angular_velocity, stddev } => {
                belief.correct(&Matrix1::new(stddev * stddev), gate, 1, |state| {
                    let (rate, bias) = (StateVariable::Vyaw as usize, StateVariable::GyroscopeBias as usize);
                    let mut jacobian = SMatrix::<f64, 1, SIZE>::zeros();
                    (jacobian[rate], jacobian[bias]) = (1.0, 1.0);
                    Linearization {
                        residual: Vector1::new(angular_velocity - state[rate] - state[bias]),
                        jacobian,
                    }
                })
            }
        }
    }

    /// Returns true if all numbers are finite and all standard deviations positive.
    pub fn is_valid(&self) -> bool {
        let is_deviation = |stddev: &f64| stddev.is_finite() && *stddev > 0.0;
        match self {
            Self::Variables(MeasuredVariables { values }) | Self::Odometry(MeasuredVariables { values }) => {
                values.iter().flatten().all(|(value, stddev)| value.is_finite() && is_deviation(stddev))
            }
            Self::Position { position, covariance: [xx, xy, yx, yy] } => {
                let is_finite = position.iter().chain([xy, yx]).all(|number| number.is_finite());
                is_finite && is_deviation(xx) && is_deviation(yy) && xx * yy > xy * yx
            }
            Self::Gyroscope { angular_velocity, stddev } => {
                angular_velocity.is_finite() && is_deviation(stddev)
            }
            Self::Landmark(MeasuredLandmark {
                landmark,
                range,
                bearing,
                range_stddev,
                bearing_stddev,
                ..
            }) => {
                let is_finite = landmark.iter().chain([bearing]).all(|number| number.is_finite());
                is_finite && is_deviation(range) && is_deviation(range_stddev) && is_deviation(bearing_stddev)
            }
        }
    }
}
