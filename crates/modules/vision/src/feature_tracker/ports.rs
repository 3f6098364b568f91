//! Ports and parameters of the tracker.

use slate_interfaces::{CameraInfo, OccupancyGrid, PanTiltState, Pose2, Transform};
use slate_module::prelude::*;

use crate::detection::ImageDetections;

/// Ports of [`FeatureTracker`](super::FeatureTracker).
#[ports]
pub struct FeatureTrackerIo {
    /// Features of the newest image.
    pub(super) features: Input<ImageDetections>,
    /// Calibration of the camera.
    pub(super) camera_info: Input<CameraInfo>,
    /// Mount of the camera's head on the robot.
    pub(super) camera_base: Input<Transform>,
    /// State of the head; without it, the camera looks ahead.
    #[stale(after = "500ms")]
    pub(super) head: Input<PanTiltState>,
    /// Pose of the robot in the map frame.
    #[stale(after = "1s")]
    pub(super) robot_pose: Input<Pose2>,
    /// Map, for ranges and places to look from.
    pub(super) map: Input<OccupancyGrid>,
    /// Switch of the mission that has the candidate examined.
    pub(super) examine: Input<ExaminationSwitch>,
    /// Victims found so far.
    pub(super) victims: Output<FoundVictims>,
    /// Candidate for an examination: the nearest track that is not sure.
    pub(super) candidate: Output<FeatureCandidate>,
    /// Pose from which to look at the candidate.
    pub(super) view_pose: Output<Pose2>,
    /// Result of the examination.
    pub(super) result: Output<ExaminationResult>,
}

/// Switch of an examination.
#[interface]
#[derive(PartialEq)]
pub struct ExaminationSwitch {
    /// True while the candidate is examined.
    pub is_active: Bool,
}

/// Result of an examination.
#[interface]
#[derive(PartialEq)]
pub struct ExaminationResult {
    /// True if the candidate is reported.
    pub has_succeeded: Bool,
    /// True if it is rejected.
    pub has_failed: Bool,
}

/// A feature that is not sure yet.
#[interface]
#[derive(PartialEq)]
pub struct FeatureCandidate {
    /// x in the map frame.
    #[unit("m")]
    pub x: f64,
    /// y in the map frame.
    #[unit("m")]
    pub y: f64,
    /// Height of its middle above the floor.
    #[unit("m")]
    pub z: f64,
    /// Images that it was seen in.
    pub hits: u32,
    /// True if a candidate exists.
    pub is_there: Bool,
}

/// A victim that was found.
#[interface]
#[derive(PartialEq)]
pub struct FoundVictim {
    /// When it was reported.
    #[unit("ns")]
    pub time: u64,
    /// x in the map frame.
    #[unit("m")]
    pub x: f64,
    /// y in the map frame.
    #[unit("m")]
    pub y: f64,
    /// Height of its middle above the floor.
    #[unit("m")]
    pub z: f64,
    /// Standard deviation of its position along the worse direction.
    #[unit("m")]
    pub position_stddev: f64,
    /// Number of the report, from 1.
    pub id: u32,
    /// Images that it was seen in.
    pub hits: u32,
}

/// Victims in the order of their reports.
#[interface]
#[derive(PartialEq)]
pub struct FoundVictims {
    /// The victims.
    pub list: Sequence<FoundVictim, 32>,
}

/// Parameters of [`FeatureTracker`](super::FeatureTracker).
#[params]
pub struct FeatureTrackerParams {
    #[param(default = "victim", doc = "label of the features")]
    label: Text<60>,
    #[param(default = 5.0, range = 0.1..=100.0, unit = "m", doc = "range up to which a feature is placed")]
    max_range: f64,
    #[param(default = 1.0, range = 0.05..=10.0, unit = "m", doc = "distance from a track up to which a feature belongs to it")]
    merge_distance: f64,
    #[param(default = 3, range = 1..=1000, doc = "images from which a track is a candidate")]
    candidate_hits: u32,
    #[param(default = 8, range = 1..=1000, doc = "images from which a candidate may be reported")]
    report_hits: u32,
    #[param(default = 2.8, range = 0.1..=100.0, unit = "m", doc = "range from within which a victim must have been seen")]
    report_range: f64,
    #[param(default = 0.2, range = 0.01..=10.0, unit = "m", doc = "maximum standard deviation of a reported position")]
    report_stddev: f64,
    #[param(default = 8.0, range = 0.1..=600.0, unit = "s", doc = "time after which a track with fewer images than a candidate is dropped")]
    spurious_after: f64,
    #[param(default = 25.0, range = 0.1..=600.0, unit = "s", doc = "duration of an examination after which a candidate is rejected")]
    examination_timeout: f64,
    #[param(default = 1.4, range = 0.1..=20.0, unit = "m", doc = "distance from which a candidate is looked at")]
    view_distance: f64,
    #[param(default = 0.45, range = 0.0..=5.0, unit = "m", doc = "minimum distance of that place to occupied cells")]
    viewpoint_clearance: f64,
}
