//! Extended Kalman filter with a history.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use slate_interfaces::{Odometry, Pose2, PoseEstimate};
use slate_module::math;

use super::belief::{Innovation, PlanarBelief, ProcessNoise, StateMatrix, StateVariable};
use super::measurement::FilterMeasurement;
use super::parameters::PlanarFilterParameters;
use crate::InvalidParameter;

/// Measurements that the history has room for.
const MOST_LAGGED: usize = 256;

/// Extended Kalman filter of a robot in the plane.
/// It estimates the pose, the twist in the robot's frame, and a calibration of its sensors: the bias of the gyroscope
/// and the scales of odometry and landmarks.
///
/// Between measurements the twist is constant but for its process noise (`robot_localization` with `two_d_mode`;
/// Thrun, Burgard and Fox, *Probabilistic Robotics*, table 3.3). With a `history_length`, a measurement that comes late is
/// taken in at its time, and the later ones again after it (`smooth_lagged_data`). Times are in nanoseconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanarFilter {
    parameters: PlanarFilterParameters,
    belief: Option<PlanarBelief>,
    /// Oldest first.
    history: VecDeque<LaggedEntry>,
    rejected: u64,
}

/// Measurement, with the belief after it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct LaggedEntry {
    belief: PlanarBelief,
    measurement: Option<(FilterMeasurement, f64)>,
}

/// Outcome of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MeasurementOutcome {
    /// Accepted, with its Mahalanobis distance: the belief was updated.
    Accepted(f64),
    /// Rejected as an outlier, with its Mahalanobis distance.
    Rejected(f64),
    /// Left out: older than the history, by this time in seconds.
    TooLate(f64),
    /// Invalid: numbers that are not finite, or no positive standard deviation.
    Invalid,
    /// Left out, as the filter has no pose yet.
    NoPose,
}

impl PlanarFilter {
    /// Returns a filter without a pose.
    ///
    /// # Errors
    /// A parameter that is out of its range.
    pub fn new(parameters: PlanarFilterParameters) -> Result<Self, InvalidParameter> {
        parameters.check()?;
        let history = VecDeque::with_capacity(MOST_LAGGED);
        Ok(Self { parameters, belief: None, history, rejected: 0 })
    }

    /// Parameters.
    pub fn parameters(&self) -> &PlanarFilterParameters {
        &self.parameters
    }

    /// Changes the parameters; the belief stays.
    ///
    /// # Errors
    /// A parameter that is out of its range; nothing changes.
    pub fn set_parameters(&mut self, parameters: PlanarFilterParameters) -> Result<(), InvalidParameter> {
        parameters.check()?;
        self.parameters = parameters;
        Ok(())
    }

    /// Initializes at a pose with standard deviations of x, y (m) and heading (rad).
    /// Twist and bias begin at 0 and scales at 1, with the initial standard deviations of the parameters. Returns
    /// false, and changes nothing, if a number is not finite.
    pub fn initialize(&mut self, pose: Pose2, stddev: [f64; 3], time: u64) -> bool {
        if !pose.is_known() || stddev.iter().any(|stddev| !stddev.is_finite() || *stddev < 0.0) {
            return false;
        }
        let (mut mean, mut deviations) = self.parameters.initial();
        (mean[0], mean[1], mean[2]) = (pose.x, pose.y, math::wrap_angle(pose.theta));
        deviations.as_mut_slice()[..3].copy_from_slice(&stddev);
        let covariance = StateMatrix::from_diagonal(&deviations.component_mul(&deviations));
        self.restart(PlanarBelief { mean, covariance, time });
        true
    }

    /// Widens the belief of the pose to standard deviations.
    /// They are of x, y (m) and heading (rad). It is for a robot that may have been kidnapped; twist and calibration
    /// stay.
    pub fn widen(&mut self, stddev: [f64; 3]) {
        let Some(mut belief) = self.belief else { return };
        for (at, stddev) in stddev.into_iter().enumerate() {
            belief.covariance.row_mut(at).fill(0.0);
            belief.covariance.column_mut(at).fill(0.0);
            belief.covariance[(at, at)] = stddev * stddev;
        }
        self.restart(belief);
    }

    fn restart(&mut self, belief: PlanarBelief) {
        self.belief = Some(belief);
        self.history.clear();
        self.history.push_back(LaggedEntry { belief, measurement: None });
    }

    /// Predicts to a time; one before the newest changes nothing.
    pub fn predict(&mut self, time: u64) {
        let noise = self.parameters.process_noise();
        if let Some(belief) = &mut self.belief {
            advance(belief, time, &noise);
        }
    }

    /// Updates by a measurement of a time.
    /// It is rejected beyond a Mahalanobis distance of `gate`; an infinite gate lets all pass.
    pub fn update(&mut self, measurement: &FilterMeasurement, time: u64, gate: f64) -> MeasurementOutcome {
        if !measurement.is_valid() {
            return MeasurementOutcome::Invalid;
        }
        let Some(newest) = self.belief else { return MeasurementOutcome::NoPose };
        // Entries after the measurement; only a late measurement has any.
        let later = self.history.iter().rev().take_while(|entry| entry.belief.time > time).count();
        if later == self.history.len() || seconds(time, newest.time) > self.parameters.history_length {
            return MeasurementOutcome::TooLate(seconds(time, newest.time));
        }
        let at = self.history.len() - later;
        let mut belief = if time >= newest.time { newest } else { self.history[at - 1].belief };
        let Innovation { distance, is_accepted } = self.step(&mut belief, Some((*measurement, gate)), time);
        if !is_accepted {
            self.rejected += 1;
            return MeasurementOutcome::Rejected(distance);
        }
        self.history.insert(at, LaggedEntry { belief, measurement: Some((*measurement, gate)) });
        for later in at + 1..self.history.len() {
            let LaggedEntry { belief: before, measurement } = self.history[later];
            self.step(&mut belief, measurement, before.time);
            self.history[later].belief = belief;
        }
        advance(&mut belief, newest.time, &self.parameters.process_noise());
        self.belief = Some(belief);
        self.forget();
        MeasurementOutcome::Accepted(distance)
    }

    /// Predicts to a time, and corrects there.
    fn step(
        &self,
        belief: &mut PlanarBelief,
        measurement: Option<(FilterMeasurement, f64)>,
        time: u64,
    ) -> Innovation {
        advance(belief, time, &self.parameters.process_noise());
        let unmeasured = Innovation { distance: 0.0, is_accepted: true };
        measurement.map_or(unmeasured, |(measurement, gate)| {
            measurement.apply(belief, gate, self.parameters.iterations)
        })
    }

    /// Drops entries older than the history.
    /// One entry before it stays, for measurements after that.
    fn forget(&mut self) {
        let Some(newest) = self.belief else { return };
        let is_old =
            |entry: &LaggedEntry| seconds(entry.belief.time, newest.time) > self.parameters.history_length;
        while self.history.len() >= MOST_LAGGED
            || self.history.len() > 1 && self.history.get(1).is_some_and(is_old)
        {
            self.history.pop_front();
        }
    }

    /// Returns the pose with its covariance, at the newest time.
    /// `None` before [`initialize`](Self::initialize).
    pub fn estimate(&self) -> Option<PoseEstimate> {
        self.belief.map(|belief| belief.estimate())
    }

    /// Returns the pose and twist at the newest time.
    pub fn odometry(&self) -> Option<Odometry> {
        self.belief.map(|belief| belief.odometry())
    }

    /// Returns mean and standard deviation of a variable.
    pub fn variable(&self, variable: StateVariable) -> Option<(f64, f64)> {
        let at = variable as usize;
        self.belief.map(|belief| (belief.mean[at], belief.covariance[(at, at)].sqrt()))
    }

    /// Returns the covariance of the variables in the order of [`StateVariable`].
    /// They are row by row.
    pub fn covariance(&self) -> Option<[[f64; 10]; 10]> {
        // The matrix is symmetric, so its columns are its rows.
        self.belief.map(|belief| belief.covariance.into())
    }

    /// Returns the number of measurements that were outliers.
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Returns the newest time, ns.
    pub fn time(&self) -> Option<u64> {
        self.belief.map(|belief| belief.time)
    }
}

/// Predicts to a time; one before the belief's changes nothing.
fn advance(belief: &mut PlanarBelief, time: u64, process_noise: &ProcessNoise) {
    let passed = seconds(belief.time, time);
    if passed > 0.0 {
        belief.predict(passed, process_noise);
        belief.time = time;
    }
}

/// Returns the time between two times in ns, s; 0 if the second is not later.
fn seconds(from: u64, to: u64) -> f64 {
    to.saturating_sub(from) as f64 * 1e-9
}
