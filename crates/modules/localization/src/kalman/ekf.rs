//! Extended Kalman filter as a block.

use serde::{Deserialize, Serialize};
use slate_interfaces::{Imu, NavSatFix, Odometry, Orientation, Pose2, PoseEstimate, Position, Transform};
use slate_mapek::prelude::*;
use slate_module::prelude::*;

use super::filter::{MeasurementOutcome, PlanarFilter};
use super::landmarks::{LandmarkDetections, LandmarkMap};
use super::params::EkfParams;
use super::sources::{self, FilterSource, GatedMeasurement};
use super::tangent_plane::TangentPlane;
use crate::inputs::{FaultyInput, InputFault, OdometryCheck};

/// Number of inputs that measure.
const SOURCES: usize = FilterSource::ALL.len();

/// Ports of [`Ekf`].
/// Each input is optional; an input without a link has no measurements.
#[ports]
pub struct EkfIo {
    /// Odometry of the wheels.
    odometry: Observed<Odometry>,
    /// Angular velocity and heading of an IMU at the robot's origin.
    imu: Observed<Imu>,
    /// Heading of a compass in the frame of the estimate.
    orientation: Observed<Orientation>,
    /// Position of a positioning system in the frame of the estimate.
    position: Observed<Position>,
    /// Position on Earth; x is east and y north of the first fix, or of the datum.
    fix: Observed<NavSatFix>,
    /// Landmarks that the robot sees.
    landmarks: Observed<LandmarkDetections>,
    /// Map of the landmarks; detections of others are ignored.
    landmark_map: Input<LandmarkMap>,
    /// Manual pose reset, as RViz's `initialpose` or `robot_localization`'s `set_pose`.
    initial_pose: Inbox<Pose2>,
    /// Pose and twist, as `odometry/filtered`.
    filtered: Output<Odometry>,
    /// Frame of the odometry in that of the map, if the estimate is in the map's.
    map_to_odom: Output<Transform>,
    /// Frame of the robot in that of the odometry.
    odom_to_base: Output<Transform>,
    /// Number of measurements that were outliers.
    rejected: Output<RejectedMeasurements>,
}

/// Numbers of measurements that were outliers, since the start.
#[interface]
#[derive(PartialEq)]
pub struct RejectedMeasurements {
    /// Outliers of the odometry.
    pub odometry: u64,
    /// Outliers of the inertial measurement unit.
    pub imu: u64,
    /// Outliers of the compass.
    pub orientation: u64,
    /// Outliers of the positioning system.
    pub position: u64,
    /// Outliers of satellite fixes.
    pub fix: u64,
    /// Outliers of landmarks.
    pub landmarks: u64,
}

/// Extended Kalman filter that fuses any sensors into pose and twist.
/// It takes odometry, IMU, compass, positions, satellite fixes and landmarks, with the parameters of
/// `robot_localization`.
///
/// An invalid input is named in the log, and the block is degraded: its pose is not published, so that it becomes stale,
/// until the input has recovered.
pub struct Ekf;

/// State of [`Ekf`].
#[derive(Default, Serialize, Deserialize)]
pub struct EkfState {
    filter: Option<PlanarFilter>,
    odometry: OdometryCheck,
    /// Newest good pose of the odometry, and its time, ns.
    odometry_pose: Option<([f64; 3], u64)>,
    plane: Option<TangentPlane>,
    /// Newest time of each input, ns.
    times: [u64; SOURCES],
    /// Fault of the newest value of each input.
    faults: [Option<InputFault>; SOURCES],
    /// Outliers of each input, in all and in a row.
    rejected: [u64; SOURCES],
    in_a_row: [i64; SOURCES],
    fault: Option<InputFault>,
}

impl Analyze for Ekf {
    const NAME: &'static str = "ekf";
    const DOC: &'static str = "Estimates pose and twist with an extended Kalman filter.";
    type Observed = EkfIo;
    type Params = EkfParams;
    type State = EkfState;
    type Value = PoseEstimate;

    fn process(state: &mut EkfState, io: &EkfIo, params: &EkfParams, now: &Tick) -> Option<PoseEstimate> {
        let result = state.step(io, params, now);
        let is_new = result == Ok(true);
        InputFault::report(&mut state.fault, result.err(), now);
        if !is_new {
            return None;
        }
        let filter = state.filter.as_ref()?;
        let (estimate, filtered) = (filter.estimate()?, filter.odometry()?);
        io.filtered.set(filtered);
        io.rejected.set(state.rejections());
        state.publish_frames(io, params, &estimate.pose, now);
        Some(estimate)
    }

    fn is_degraded(state: &EkfState) -> bool {
        state.fault.is_some()
    }
}

impl EkfState {
    /// Takes new inputs; returns true if any is new.
    fn step(&mut self, io: &EkfIo, params: &EkfParams, now: &Tick) -> Result<bool, InputFault> {
        params.is_in_map().map_err(InputFault::parameter)?;
        self.prepare(params, now)?;
        let mut is_new = self.reset(io, params, now);
        let mut fresh = FilterSource::ALL.map(|source| (stamp(io, source), source));
        fresh.sort_unstable();
        for (time, source) in fresh.into_iter().filter_map(|(time, source)| Some((time?, source))) {
            is_new = true;
            let taken = self.take(source, time, io, params, now);
            self.times[source as usize] = u64::max(time, self.times[source as usize]);
            self.faults[source as usize] = taken.err();
        }
        if let Some(fault) = self.faults.iter().flatten().next() {
            return Err(fault.clone());
        }
        self.check_age(FilterSource::Odometry, FaultyInput::StoppedOdometry, params, now)?;
        self.check_age(FilterSource::Imu, FaultyInput::StoppedImu, params, now)?;
        Ok(is_new)
    }

    /// Creates the filter at its initial pose, or changes its parameters.
    fn prepare(&mut self, params: &EkfParams, now: &Tick) -> Result<(), InputFault> {
        let parameters = params.filter();
        match &mut self.filter {
            Some(filter) if *filter.parameters() == parameters => Ok(()),
            Some(filter) => filter.set_parameters(parameters).map_err(InputFault::parameter),
            None => {
                let mut filter = PlanarFilter::new(parameters).map_err(InputFault::parameter)?;
                if !filter.initialize(params.initial_pose(), params.initial_stddev(), now.now()) {
                    return Err(InputFault::new(
                        FaultyInput::Parameter,
                        "has an initial state that is not finite",
                    ));
                }
                self.filter = Some(filter);
                Ok(())
            }
        }
    }

    /// Resets the pose by hand; returns whether it was.
    fn reset(&mut self, io: &EkfIo, params: &EkfParams, now: &Tick) -> bool {
        let mut is_reset = false;
        for pose in io.initial_pose.iter() {
            let filter = self.filter.as_mut();
            if filter.is_some_and(|filter| filter.initialize(*pose, params.initial_stddev(), now.now())) {
                (is_reset, self.in_a_row) = (true, [0; SOURCES]);
            } else {
                let Pose2 { x, y, theta } = *pose;
                now.warn(format_args!("invalid initial pose ({x}, {y}, {theta}): expected numbers"));
                pose.refuse(1);
            }
        }
        is_reset
    }

    /// Corrects by the new value of an input.
    fn take(
        &mut self,
        source: FilterSource,
        time: u64,
        io: &EkfIo,
        params: &EkfParams,
        now: &Tick,
    ) -> Result<(), InputFault> {
        match source {
            FilterSource::Odometry => {
                let Some(odometry) = io.odometry.get() else { return Ok(()) };
                for measurement in self.odometry(odometry, time, params)?.into_iter().flatten() {
                    self.correct(source, measurement, time, params, now)?;
                }
            }
            FilterSource::Imu => {
                let Some(imu) = io.imu.get() else { return Ok(()) };
                let measurements = sources::imu(imu, params).map_err(InputFault::parameter)?;
                for measurement in measurements.into_iter().flatten() {
                    self.correct(source, measurement, time, params, now)?;
                }
            }
            FilterSource::Orientation => {
                let Some(orientation) = io.orientation.get() else { return Ok(()) };
                self.correct(source, sources::orientation(orientation.theta, params), time, params, now)?;
            }
            FilterSource::Position => {
                let Some(Position { x, y, .. }) = io.position.get() else { return Ok(()) };
                self.correct(source, sources::position([*x, *y], params), time, params, now)?;
            }
            FilterSource::Fix => {
                let Some(fix) = io.fix.get() else { return Ok(()) };
                let measurement = sources::fix(fix, &mut self.plane, params)?;
                self.correct(source, measurement, time, params, now)?;
            }
            FilterSource::Landmarks => self.see(io, time, params, now)?,
        }
        Ok(())
    }

    /// Checks odometry, and returns its measurement.
    fn odometry(
        &mut self,
        odometry: &Odometry,
        time: u64,
        params: &EkfParams,
    ) -> Result<[Option<GatedMeasurement>; 2], InputFault> {
        self.odometry.check(odometry, time, params.jump_velocities());
        let Pose2 { x, y, theta } = odometry.pose;
        let before = self.odometry_pose.replace(([x, y, theta], time));
        if let Err(fault) = self.odometry.fault() {
            // No motion has led to this pose.
            self.odometry_pose = self.odometry_pose.filter(|_| odometry.pose.is_known());
            return Err(fault);
        }
        let differential = before.filter(|_| params.odom0_differential.get());
        let before = differential.map(|(pose, before)| (pose, time.saturating_sub(before) as f64 * 1e-9));
        sources::odometry(odometry, before, params).map_err(InputFault::parameter)
    }

    /// Corrects by the landmarks in view.
    fn see(&mut self, io: &EkfIo, time: u64, params: &EkfParams, now: &Tick) -> Result<(), InputFault> {
        let Some(detections) = io.landmarks.get() else { return Ok(()) };
        let missing =
            || InputFault::new(FaultyInput::LandmarkMap, "has no value: set the places of landmarks");
        let map = io.landmark_map.get().ok_or_else(missing)?;
        for detection in detections.list.iter() {
            if let Some(measurement) = sources::landmark(detection, map, params) {
                self.correct(FilterSource::Landmarks, measurement, time, params, now)?;
            }
        }
        Ok(())
    }

    fn correct(
        &mut self,
        source: FilterSource,
        (measurement, gate): GatedMeasurement,
        time: u64,
        params: &EkfParams,
        now: &Tick,
    ) -> Result<(), InputFault> {
        let Some(filter) = &mut self.filter else { return Ok(()) };
        let fault = |reason: std::fmt::Arguments<'_>| Err(InputFault::with(source.input(), reason));
        let at = source as usize;
        match filter.update(&measurement, time, gate) {
            MeasurementOutcome::Accepted(_) => self.in_a_row[at] = 0,
            MeasurementOutcome::Rejected(_) => {
                self.rejected[at] += 1;
                self.in_a_row[at] += 1;
                if source.is_absolute() && self.in_a_row[at] >= params.max_rejections {
                    filter.widen(params.reset_stddev());
                    self.in_a_row[at] = 0;
                    now.warn(format_args!(
                        "{} was an outlier {} times in a row: the robot may have been kidnapped (moved by hand)",
                        source.input().name(),
                        params.max_rejections
                    ));
                }
            }
            MeasurementOutcome::TooLate(seconds) => {
                return fault(format_args!("went back in time, or is late, by {seconds:.3} s"));
            }
            MeasurementOutcome::Invalid => {
                return fault(format_args!("is NaN, or has no standard deviation"));
            }
            MeasurementOutcome::NoPose => {}
        }
        Ok(())
    }

    /// Checks that an input with measurements has not timed out.
    fn check_age(
        &self,
        source: FilterSource,
        input: FaultyInput,
        params: &EkfParams,
        now: &Tick,
    ) -> Result<(), InputFault> {
        let time = self.times[source as usize];
        let age = now.now().saturating_sub(time) as f64 * 1e-9;
        if time > 0 && age > params.sensor_timeout {
            let reason = format_args!("has stopped: the newest value is {age:.2} s old");
            return Err(InputFault::with(input, reason));
        }
        Ok(())
    }

    fn rejections(&self) -> RejectedMeasurements {
        let [odometry, imu, orientation, position, fix, landmarks] = self.rejected;
        RejectedMeasurements { odometry, imu, orientation, position, fix, landmarks }
    }

    fn publish_frames(&self, io: &EkfIo, params: &EkfParams, pose: &Pose2, now: &Tick) {
        if !params.publish_tf.get() {
            return;
        }
        if params.is_in_map() != Ok(true) {
            io.odom_to_base.set(params.frames().odom_to_base(pose, now));
        } else if let Some(([x, y, theta], _)) = self.odometry_pose {
            let odometry = Pose2 { x, y, theta };
            io.map_to_odom.set(params.frames().map_to_odom(pose, &odometry, now));
            io.odom_to_base.set(params.frames().odom_to_base(&odometry, now));
        }
    }
}

/// Returns the time of an input's new value, ns; `None` without one.
fn stamp(io: &EkfIo, source: FilterSource) -> Option<u64> {
    let (is_new, stamp) = match source {
        FilterSource::Odometry => (io.odometry.is_new(), io.odometry.stamp()),
        FilterSource::Imu => (io.imu.is_new(), io.imu.stamp()),
        FilterSource::Orientation => (io.orientation.is_new(), io.orientation.stamp()),
        FilterSource::Position => (io.position.is_new(), io.position.stamp()),
        FilterSource::Fix => (io.fix.is_new(), io.fix.stamp()),
        FilterSource::Landmarks => (io.landmarks.is_new(), io.landmarks.stamp()),
    };
    is_new.then_some(stamp.time)
}
