//! Analyzes that report relevant changes to the Plan.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Pose2, Position, SonarScan};
use slate_plugin::prelude::*;

use crate::knowledge::WheeledModel;
use crate::median::MedianRing;

/// Free space around the robot.
#[interface]
#[derive(PartialEq)]
pub struct Surroundings {
    /// Shortest range of the sonars.
    #[unit("m")]
    pub nearest: f64,
    /// True if an obstacle is closer than the crowded distance.
    pub crowded: Bool,
}

/// Percept of the sonars.
#[ports]
pub struct ObservedRange {
    range: Observed<SonarScan>,
    /// Robot model with the accuracy of its sensors, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Parameters of [`PassRange`].
#[params]
pub struct PassRangeParams {
    #[param(default = 0.6, range = 0.0..=10.0, unit = "m", doc = "range below which the surroundings become crowded")]
    crowded_distance: f64,
    #[param(default = 0.8, range = 0.0..=10.0, unit = "m", doc = "range above which they become free again (hysteresis)")]
    free_distance: f64,
    #[param(default = 5, range = 1..=9, doc = "scans over which the median of each range is taken, if the sonars err")]
    median_scans: u32,
}

/// State of [`PassRange`].
#[derive(Default, Serialize, Deserialize)]
pub struct RangeState {
    /// Newest report.
    crowded: Option<bool>,
    /// Newest scans.
    ring: MedianRing,
}

/// Reports when the surroundings become crowded or free.
pub struct PassRange;

impl Analyze for PassRange {
    const NAME: &'static str = "pass_range";
    const DOC: &'static str = "Reports when the surroundings become crowded or free.";
    type Observed = ObservedRange;
    type Params = PassRangeParams;
    type State = RangeState;
    type Value = Surroundings;

    fn process(
        state: &mut RangeState,
        observed: &ObservedRange,
        params: &PassRangeParams,
        _: &Tick,
    ) -> Option<Surroundings> {
        let scan = observed.range.updated()?;
        // An exact sonar needs no second scan.
        let errs = observed.robot.get().is_some_and(|robot| robot.accuracy.sonar_outliers > 0.0);
        let scans = if errs { params.median_scans as usize } else { 1 };
        let nearest = state.ring.nearest(scan, scans);
        let was = state.crowded;
        let limit = if was == Some(true) { params.free_distance } else { params.crowded_distance };
        let is = nearest < limit;
        state.crowded = Some(is);
        (was != Some(is)).then(|| Surroundings { nearest, crowded: is.into() })
    }
}

/// Percept of the position.
#[ports]
pub struct ObservedPosition {
    position: Observed<Position>,
    /// Robot model with the estimated pose, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Parameters of [`PassPosition`].
#[params]
pub struct PassPositionParams {
    #[param(default = 0.05, range = 0.0..=10.0, unit = "m", doc = "displacement that is reported")]
    min_displacement: f64,
}

/// Newest report.
#[derive(Default, Serialize, Deserialize)]
pub struct LastPosition {
    last: Option<(f64, f64)>,
}

/// Reports when the robot has moved.
pub struct PassPosition;

impl Analyze for PassPosition {
    const NAME: &'static str = "pass_position";
    const DOC: &'static str = "Reports when the robot has moved.";
    type Observed = ObservedPosition;
    type Params = PassPositionParams;
    type State = LastPosition;
    type Value = Position;

    fn process(
        reported: &mut LastPosition,
        observed: &ObservedPosition,
        params: &PassPositionParams,
        _: &Tick,
    ) -> Option<Position> {
        let measured = *observed.position.updated()?;
        let known = observed.robot.get().map(|robot| robot.robot.pose).filter(Pose2::is_known);
        let position = known.map_or(measured, |Pose2 { x, y, .. }| Position { x, y, ..measured });
        let moved = reported
            .last
            .is_none_or(|(x, y)| math::hypot(position.x - x, position.y - y) >= params.min_displacement);
        moved.then(|| {
            reported.last = Some((position.x, position.y));
            position
        })
    }
}

/// Percept of the orientation.
#[ports]
pub struct ObservedOrientation {
    orientation: Observed<Orientation>,
    /// Robot model with the estimated pose, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Parameters of [`PassOrientation`].
#[params]
pub struct PassOrientationParams {
    #[param(default = 0.1, range = 0.0..=3.2, unit = "rad", doc = "rotation that is reported")]
    min_rotation: f64,
}

/// Reports when the robot has turned.
pub struct PassOrientation;

impl Analyze for PassOrientation {
    const NAME: &'static str = "pass_orientation";
    const DOC: &'static str = "Reports when the robot has turned.";
    type Observed = ObservedOrientation;
    type Params = PassOrientationParams;
    type State = Option<f64>;
    type Value = Orientation;

    fn process(
        reported: &mut Option<f64>,
        observed: &ObservedOrientation,
        params: &PassOrientationParams,
        _: &Tick,
    ) -> Option<Orientation> {
        let measured = *observed.orientation.updated()?;
        let known = observed.robot.get().map(|robot| robot.robot.pose).filter(Pose2::is_known);
        let orientation = known.map_or(measured, |Pose2 { theta, .. }| Orientation { theta });
        let turned = reported
            .is_none_or(|last| math::angle_between(last, orientation.theta).abs() >= params.min_rotation);
        turned.then(|| {
            *reported = Some(orientation.theta);
            orientation
        })
    }
}
