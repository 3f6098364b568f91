//! Pose from odometry, positioning system and compass, for Knowledge.

use serde::{Deserialize, Serialize};
use slate_mapping::{OdometryNoise, PoseBelief};
use slate_plugin::interfaces::{Odometry, Orientation, Pose2, PoseEstimate, Position, SensorAccuracy};
use slate_plugin::prelude::*;

use crate::knowledge::WheeledModel;

/// Percepts, the robot model, and the estimate for Knowledge.
#[ports]
pub struct ObservedMotion {
    position: Observed<Position>,
    orientation: Observed<Orientation>,
    odometry: Observed<Odometry>,
    /// Robot model with the accuracy of its sensors, from Knowledge.
    /// It is that of the previous cycle, as Knowledge reads the estimate.
    robot: Input<WheeledModel>,
    /// Estimate, written with every measurement; NaN while the pose is unknown.
    estimate: Output<PoseEstimate>,
}

/// Parameters of [`EstimatePose`].
#[params]
pub struct EstimatePoseParams {
    #[param(default = 0.05, range = 0.0..=10.0, doc = "displacement (m) or rotation (rad) that is reported")]
    min_change: f64,
    #[param(default = 2.0, range = 0.0..=3600.0, unit = "s", doc = "time without a position or a heading after which the pose is unknown, if the sensors err")]
    fix_timeout: f64,
    #[param(default = 4.0, range = 1.0..=100.0, doc = "standard deviations beyond which a measurement is an outlier")]
    gate: f64,
    #[param(default = 1.0, range = 0.0..=3600.0, unit = "s", doc = "time of outliers alone after which the filter restarts from them")]
    restart_time: f64,
}

/// Timeout of the pose with exact sensors, seconds.
/// After it the pose is unknown: odometry replaces no exact sensor.
const EXACT_TIMEOUT: f64 = 0.2;

/// State of the pose estimation: belief and times of accepted measurements.
#[derive(Default, Serialize, Deserialize)]
pub struct PoseEstimation {
    belief: PoseBelief,
    /// Times of the newest accepted position and heading, seconds.
    times: [f64; 2],
    /// Newest report.
    reported: Option<[f64; 3]>,
}

/// Estimates the pose with an extended Kalman filter.
/// Odometry predicts, positioning system and compass update.
///
/// The accuracy of the sensors comes from the robot model. With exact sensors the estimate equals their measurements, bit for bit.
pub struct EstimatePose;

impl Analyze for EstimatePose {
    const NAME: &'static str = "estimate_pose";
    const DOC: &'static str = "Estimates the pose from odometry, positioning system and compass.";
    type Observed = ObservedMotion;
    type Params = EstimatePoseParams;
    type State = PoseEstimation;
    type Value = Pose2;

    fn process(
        estimation: &mut PoseEstimation,
        observed: &ObservedMotion,
        params: &EstimatePoseParams,
        now: &Tick,
    ) -> Option<Pose2> {
        let accuracy = observed.robot.get().map(|robot| &robot.accuracy);
        if let Some(odometry) = observed.odometry.updated() {
            estimation.belief.predict(odometry.pose, accuracy.map(odometry_noise).as_ref());
        }
        let position = observed.position.updated().map(|position| [position.x, position.y]);
        let heading = observed.orientation.updated().map(|orientation| orientation.theta);
        estimation.update(position, heading, accuracy?, params, now.seconds());
        let timeout = if is_exact(accuracy?) { EXACT_TIMEOUT } else { params.fix_timeout };
        let estimate = estimation.belief.estimate()?;
        if estimation.age(now.seconds()) > timeout {
            // Knowledge must not wait until this is stale.
            observed.estimate.set(PoseEstimate { pose: Pose2::UNKNOWN, ..PoseEstimate::default() });
            return None;
        }
        observed.estimate.set(estimate);
        let pose = estimate.pose;
        let changed = estimation.reported.is_none_or(|[x, y, theta]| {
            math::hypot(pose.x - x, pose.y - y) >= params.min_change
                || math::angle_between(theta, pose.theta).abs() >= params.min_change
        });
        changed.then(|| {
            estimation.reported = Some([pose.x, pose.y, pose.theta]);
            pose
        })
    }
}

/// Returns true for exact sensors, which need no estimation.
fn is_exact(accuracy: &SensorAccuracy) -> bool {
    accuracy.position_stddev == 0.0 && accuracy.orientation_stddev == 0.0
}

fn odometry_noise(accuracy: &SensorAccuracy) -> OdometryNoise {
    OdometryNoise {
        translation_stddev: accuracy.odometry_translation_stddev,
        rotation_stddev: accuracy.odometry_rotation_stddev,
    }
}

impl PoseEstimation {
    /// Updates by measurements at a time, seconds.
    fn update(
        &mut self,
        position: Option<[f64; 2]>,
        heading: Option<f64>,
        accuracy: &SensorAccuracy,
        params: &EstimatePoseParams,
        time: f64,
    ) {
        let SensorAccuracy { position_stddev, orientation_stddev, .. } = *accuracy;
        if position.is_some_and(|place| self.belief.update_position(place, position_stddev, params.gate)) {
            self.times[0] = time;
        }
        if heading.is_some_and(|theta| self.belief.update_heading(theta, orientation_stddev, params.gate)) {
            self.times[1] = time;
        }
        // Outliers alone: the robot was kidnapped, or the belief is wrong.
        if let (Some([x, y]), Some(theta)) = (position, heading)
            && (!self.belief.is_known() || self.age(time) > params.restart_time)
        {
            self.belief.begin(Pose2 { x, y, theta }, [position_stddev, orientation_stddev]);
            self.times = [time; 2];
        }
    }

    /// Returns the time since measurements gave both position and heading, seconds.
    fn age(&self, time: f64) -> f64 {
        let [position, heading] = self.times;
        time - math::min(position, heading)
    }
}
