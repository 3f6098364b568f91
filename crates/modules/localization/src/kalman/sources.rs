//! Measurements of the inputs.

use serde::{Deserialize, Serialize};
use slate_interfaces::{FixStatus, Imu, NavSatFix, Odometry, Pose2, Quaternion};
use slate_module::{InvalidParameter, math};

use super::belief::StateVariable::{Vx, Vy, Vyaw, X, Y, Yaw};
use super::landmarks::{LandmarkDetection, LandmarkMap};
use super::measurement::{FilterMeasurement, MeasuredLandmark, MeasuredVariables, RangeKind};
use super::params::{EkfParams, UsedVariables};
use super::tangent_plane::TangentPlane;
use crate::estimate::relative;
use crate::inputs::{FaultyInput, InputFault};

/// Input that measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) enum FilterSource {
    Odometry = 0,
    Imu = 1,
    Orientation = 2,
    Position = 3,
    Fix = 4,
    Landmarks = 5,
}

impl FilterSource {
    /// All sources, in their order at equal times.
    pub const ALL: [Self; 6] =
        [Self::Odometry, Self::Imu, Self::Orientation, Self::Position, Self::Fix, Self::Landmarks];

    pub const fn input(self) -> FaultyInput {
        match self {
            Self::Odometry => FaultyInput::Odometry,
            Self::Imu => FaultyInput::Imu,
            Self::Orientation => FaultyInput::Orientation,
            Self::Position => FaultyInput::Position,
            Self::Fix => FaultyInput::Fix,
            Self::Landmarks => FaultyInput::Landmarks,
        }
    }

    /// Returns true if its outliers indicate that the robot was kidnapped.
    pub const fn is_absolute(self) -> bool {
        !matches!(self, Self::Odometry | Self::Imu)
    }
}

/// Measurement with its gate.
pub(super) type GatedMeasurement = (FilterMeasurement, f64);

/// Returns pose and twist of the odometry as a measurement.
/// Velocities are those since an earlier pose, if one is given with the seconds since.
pub(super) fn odometry(
    odometry: &Odometry,
    before: Option<([f64; 3], f64)>,
    params: &EkfParams,
) -> Result<[Option<GatedMeasurement>; 2], InvalidParameter> {
    let used = params.odometry_variables()?;
    let Pose2 { x, y, theta } = odometry.pose;
    let velocities = match before {
        None if params.odom0_differential.get() => None,
        None => Some([odometry.twist.linear, 0.0, odometry.twist.angular]),
        Some(([x, y, theta], seconds)) => {
            let moved = relative(&Pose2 { x, y, theta }, &odometry.pose);
            // On the chord of an arc the robot looks ahead at its middle.
            let half = 0.5 * moved.theta;
            let (sine, cosine) = (math::sin(half), math::cos(half));
            let (forward, left) = (moved.x * cosine + moved.y * sine, moved.y * cosine - moved.x * sine);
            (seconds > 0.0).then(|| [forward / seconds, left / seconds, moved.theta / seconds])
        }
    };
    let [position, heading] = [params.odom0_position_stddev, params.odom0_yaw_stddev];
    let pose = [(X, x, position), (Y, y, position), (Yaw, theta, heading)];
    let pose = variables(used, pose)
        .map(|pose| (FilterMeasurement::Variables(pose), params.odom0_pose_rejection_threshold));
    let [linear, angular] = [params.odom0_linear_velocity_stddev, params.odom0_angular_velocity_stddev];
    let twist = velocities.and_then(|[vx, vy, vyaw]| {
        let twist = [(Vx, vx, linear), (Vy, vy, linear), (Vyaw, vyaw, angular)];
        variables(used, twist)
            .map(|twist| (FilterMeasurement::Odometry(twist), params.odom0_twist_rejection_threshold))
    });
    Ok([pose, twist])
}

/// Returns heading and angular velocity of an IMU, as far as it measures them.
pub(super) fn imu(imu: &Imu, params: &EkfParams) -> Result<[Option<GatedMeasurement>; 2], InvalidParameter> {
    let used = params.imu_variables()?;
    let stddev = |covariance: &[f64; 9], unknown: f64| {
        let is_measured = covariance[0] >= 0.0;
        is_measured.then(|| if covariance[8] > 0.0 { covariance[8].sqrt() } else { unknown })
    };
    let yaw = stddev(&imu.orientation_covariance, params.imu0_yaw_stddev);
    let heading = yaw.filter(|_| used[Yaw as usize]).map(|stddev| {
        let measured = MeasuredVariables::default().with(Yaw, heading(&imu.orientation), stddev);
        (FilterMeasurement::Variables(measured), params.imu0_pose_rejection_threshold)
    });
    let rate = stddev(&imu.angular_velocity_covariance, params.imu0_angular_velocity_stddev);
    let rate = rate.filter(|_| used[Vyaw as usize]).map(|stddev| {
        let measured = FilterMeasurement::Gyroscope { angular_velocity: imu.angular_velocity.z, stddev };
        (measured, params.imu0_twist_rejection_threshold)
    });
    Ok([heading, rate])
}

/// Returns the position of a satellite fix in a tangent plane.
/// It touches at the datum or at the first fix.
pub(super) fn fix(
    fix: &NavSatFix,
    plane: &mut Option<TangentPlane>,
    params: &EkfParams,
) -> Result<GatedMeasurement, InputFault> {
    let fault = |reason| Err(InputFault::new(FaultyInput::Fix, reason));
    if fix.status == FixStatus::NO_FIX {
        return fault("has no position");
    }
    let [latitude, longitude] = match params.wait_for_datum.get() {
        true => [params.datum_latitude, params.datum_longitude],
        false => [fix.latitude, fix.longitude],
    };
    let Some(plane) =
        plane.or_else(|| TangentPlane::new(latitude, longitude)).map(|made| *plane.insert(made))
    else {
        return fault("is not on Earth");
    };
    let [xx, xy, yx, yy] = [0, 1, 3, 4].map(|at| fix.position_covariance[at]);
    let unknown = params.fix_stddev * params.fix_stddev;
    let covariance = if xx > 0.0 && yy > 0.0 { [xx, xy, yx, yy] } else { [unknown, 0.0, 0.0, unknown] };
    let position = plane.project(fix.latitude, fix.longitude);
    Ok((FilterMeasurement::Position { position, covariance }, params.fix_rejection_threshold))
}

/// Returns the measurement of a mapped landmark.
pub(super) fn landmark(
    detection: &LandmarkDetection,
    map: &LandmarkMap,
    params: &EkfParams,
) -> Option<GatedMeasurement> {
    let landmark = map.landmarks.iter().find(|landmark| landmark.id == detection.id)?;
    let measured = MeasuredLandmark {
        landmark: [landmark.x, landmark.y],
        range: detection.range,
        range_kind: if params.landmark_range_is_depth.get() { RangeKind::Depth } else { RangeKind::Distance },
        bearing: detection.bearing,
        range_stddev: params.landmark_range_stddev + params.landmark_range_relative_stddev * detection.range,
        bearing_stddev: params.landmark_bearing_stddev,
    };
    Some((FilterMeasurement::Landmark(measured), params.landmark_rejection_threshold))
}

/// Returns the measurement of the compass: heading.
pub(super) fn orientation(theta: f64, params: &EkfParams) -> GatedMeasurement {
    let measured = MeasuredVariables::default().with(Yaw, theta, params.orientation_stddev);
    (FilterMeasurement::Variables(measured), params.orientation_rejection_threshold)
}

/// Returns the measurement of the positioning system: position.
pub(super) fn position([x, y]: [f64; 2], params: &EkfParams) -> GatedMeasurement {
    let stddev = params.position_stddev;
    let measured = MeasuredVariables::default().with(X, x, stddev).with(Y, y, stddev);
    (FilterMeasurement::Variables(measured), params.position_rejection_threshold)
}

/// Returns the variables that are used; `None` of none.
fn variables(
    used: UsedVariables,
    measured: [(super::belief::StateVariable, f64, f64); 3],
) -> Option<MeasuredVariables> {
    let mut variables = MeasuredVariables::default();
    for (variable, value, stddev) in measured.into_iter().filter(|(variable, ..)| used[*variable as usize]) {
        variables = variables.with(variable, value, stddev);
    }
    (variables != MeasuredVariables::default()).then_some(variables)
}

/// Returns the heading of a rotation, about z after those about y and x.
fn heading(Quaternion { x, y, z, w }: &Quaternion) -> f64 {
    math::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
}
