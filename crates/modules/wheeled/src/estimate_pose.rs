//! Pose from odometry, positioning system and compass, for Knowledge.

use serde::{Deserialize, Serialize};
use slate_mapping::{Axis, OdometryNoise, PoseFilter};
use slate_plugin::interfaces::{Odometry, Orientation, Pose2, PoseEstimate, Position, SensorAccuracy};
use slate_plugin::prelude::*;

use crate::knowledge::WheeledModel;

/// Percepts, the robot model, and the estimate for Knowledge.
#[ports]
pub struct ObservedMotion {
    position: Observed<Position>,
    orientation: Observed<Orientation>,
    odometry: Observed<Odometry>,
    /// Robot model with the accuracy of its sensors, from Knowledge; of the previous cycle, as Knowledge reads the estimate.
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

/// Time without a measurement after which the pose is unknown if the sensors are exact, seconds: odometry replaces none of them.
const EXACT_TIMEOUT: f64 = 0.2;

/// Belief, and what it was updated by.
#[derive(Default, Serialize, Deserialize)]
pub struct PoseBelief {
    filter: Option<PoseFilter>,
    /// Newest pose of the odometry.
    odometry: Option<[f64; 3]>,
    /// When a position and a heading were believed last, seconds.
    times: [f64; 2],
    /// Newest report.
    reported: Option<[f64; 3]>,
}

/// Estimates the pose with an extended Kalman filter: odometry predicts, positioning system and compass update.
///
/// The accuracy of the sensors comes from the robot model. With exact sensors the estimate is what they measure, bit for bit.
pub struct EstimatePose;

impl Analyze for EstimatePose {
    const NAME: &'static str = "estimate_pose";
    const DOC: &'static str = "Estimates the pose from odometry, positioning system and compass.";
    type Observed = ObservedMotion;
    type Params = EstimatePoseParams;
    type State = PoseBelief;
    type Value = Pose2;

    fn process(
        belief: &mut PoseBelief,
        observed: &ObservedMotion,
        params: &EstimatePoseParams,
        now: &Tick,
    ) -> Option<Pose2> {
        let accuracy = observed.robot.get().map(|robot| &robot.accuracy);
        if let Some(Odometry { pose: Pose2 { x, y, theta }, .. }) = observed.odometry.updated() {
            belief.predict([*x, *y, *theta], accuracy);
        }
        let position = observed.position.updated().map(|position| [position.x, position.y]);
        let heading = observed.orientation.updated().map(|orientation| orientation.theta);
        belief.update(position, heading, accuracy?, params, now.seconds());
        let timeout = if is_exact(accuracy?) { EXACT_TIMEOUT } else { params.fix_timeout };
        let filter = belief.filter.as_ref()?;
        if belief.age(now.seconds()) > timeout {
            // Knowledge must not wait until this is stale.
            observed.estimate.set(PoseEstimate { pose: Pose2::UNKNOWN, ..PoseEstimate::default() });
            return None;
        }
        observed.estimate.set(filter.estimate());
        let pose = filter.pose();
        let changed = belief.reported.is_none_or(|[x, y, theta]| {
            math::hypot(pose.x - x, pose.y - y) >= params.min_change
                || math::angle_between(theta, pose.theta).abs() >= params.min_change
        });
        changed.then(|| {
            belief.reported = Some([pose.x, pose.y, pose.theta]);
            pose
        })
    }
}

/// Whether nothing is to be estimated.
fn is_exact(accuracy: &SensorAccuracy) -> bool {
    accuracy.position_stddev == 0.0 && accuracy.orientation_stddev == 0.0
}

impl PoseBelief {
    fn predict(&mut self, pose: [f64; 3], accuracy: Option<&SensorAccuracy>) {
        let before = self.odometry.replace(pose);
        if let (Some(filter), Some(before), Some(accuracy)) = (&mut self.filter, before, accuracy) {
            let noise = OdometryNoise {
                translation_stddev: accuracy.odometry_translation_stddev,
                rotation_stddev: accuracy.odometry_rotation_stddev,
            };
            filter.predict(before, pose, &noise);
        }
    }

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
        if let Some(filter) = &mut self.filter {
            let fits = |filter: &PoseFilter, axis, measured, stddev| {
                !filter.is_outlier(axis, measured, stddev, params.gate)
            };
            if let Some([x, y]) = position
                && fits(filter, Axis::X, x, position_stddev)
                && fits(filter, Axis::Y, y, position_stddev)
            {
                filter.update(Axis::X, x, position_stddev);
                filter.update(Axis::Y, y, position_stddev);
                self.times[0] = time;
            }
            if let Some(theta) = heading
                && fits(filter, Axis::Heading, theta, orientation_stddev)
            {
                filter.update(Axis::Heading, theta, orientation_stddev);
                self.times[1] = time;
            }
        }
        // Outliers alone: the robot was carried away, or the belief is wrong.
        if let (Some([x, y]), Some(theta)) = (position, heading)
            && (self.filter.is_none() || self.age(time) > params.restart_time)
        {
            let stddev = [position_stddev, position_stddev, orientation_stddev];
            self.filter = Some(PoseFilter::new([x, y, theta], stddev));
            self.times = [time; 2];
        }
    }

    /// Time since position and heading were both known by measurements, seconds.
    fn age(&self, time: f64) -> f64 {
        let [position, heading] = self.times;
        time - math::min(position, heading)
    }
}
