//! Parameters of the block.

use slate_interfaces::Pose2;
use slate_localization::frames::FrameNames;
use slate_localization::inputs::{BeamSelection, VelocityLimits};
use slate_module::prelude::*;

use crate::live_map::MapSettings;
use crate::parameters::{
    GraphSlamParameters, InvalidSlamParameter, LoopClosureParameters, MatchingParameters, OdometryDrift,
    ParticleSlamParameters,
};

/// Largest number of cells of a map.
const MOST_CELLS: usize = 1 << 22;

/// Parameters of [`Slam`](super::Slam).
/// Those of the method hold from the first scan on.
#[params]
pub struct SlamParams {
    #[param(default = "graph", doc = "graph, or particle_filter")]
    method: Text<28>,
    #[param(default = 0.2, range = 0.0..=10.0, unit = "m", doc = "translation after which a scan is inserted")]
    minimum_travel_distance: f64,
    #[param(default = 0.2, range = 0.0..=3.2, unit = "rad", doc = "rotation after which a scan is inserted")]
    minimum_travel_heading: f64,
    #[param(default = 0.05, range = 0.01..=1.0, unit = "m", doc = "edge length of a cell, of the map and of scan matching")]
    resolution: f64,
    #[param(default = 360, range = 1..=4000, doc = "maximum number of beams of a scan that are used")]
    max_beams: i64,
    #[param(default = 20.0, range = 0.1..=1000.0, unit = "m", doc = "ranges from here on hit nothing")]
    max_laser_range: f64,
    #[param(default = 0.0, range = 0.0..=1000.0, unit = "m", doc = "ranges up to here are no measurement")]
    min_laser_range: f64,
    #[param(default = 0.1, range = 0.001..=10.0, unit = "m/sqrt(m)", doc = "standard deviation of the odometry's translation per meter")]
    odometry_translation_stddev: f64,
    #[param(default = 0.1, range = 0.001..=10.0, unit = "rad/sqrt(rad)", doc = "standard deviation of its rotation per radian")]
    odometry_rotation_stddev: f64,
    #[param(default = 0.1, range = 0.001..=10.0, unit = "rad/sqrt(m)", doc = "standard deviation of its rotation per meter")]
    odometry_drift_stddev: f64,
    #[param(default = 0.4, range = 0.0..=10.0, unit = "m", doc = "maximum odometry error between two scans")]
    search_distance: f64,
    #[param(default = 0.35, range = 0.0..=3.1, unit = "rad", doc = "maximum odometry heading error between two scans")]
    search_angle: f64,
    #[param(default = 40, range = 2..=1000, doc = "scans of a submap")]
    scans_per_submap: i64,
    #[param(default = 4.0, range = 0.1..=100.0, unit = "m", doc = "distance of submaps within which loops are searched")]
    loop_max_distance: f64,
    #[param(default = 3.0, range = 0.0..=50.0, unit = "m", doc = "maximum position error between two submaps")]
    loop_search_distance: f64,
    #[param(default = 0.4, range = 0.0..=3.1, unit = "rad", doc = "maximum heading error between two submaps")]
    loop_search_angle: f64,
    #[param(default = 0.5, range = 0.0..=1.0, doc = "minimum match score of a loop closure")]
    loop_min_score: f64,
    #[param(default = 30, range = 1..=1000, doc = "number of particles of the particle filter")]
    particles: i64,
    #[param(default = 1, range = 1..=1000, doc = "units of loop closure in a step, of some milliseconds each")]
    background_units: i64,
    #[param(default = 0.0, range = 0.0..=3600.0, unit = "s", doc = "time without an inserted scan after which all scans are matched with all submaps; 0: never")]
    finish_after: f64,
    #[param(default = 0.5, range = 0.02..=60.0, unit = "s", doc = "time between two published maps")]
    map_update_interval: f64,
    #[param(default = 25, range = 1..=100, unit = "%", doc = "minimum share of beams that end in a cell for it to be occupied")]
    occupied_threshold: i64,
    #[param(default = 10, range = 1..=10_000, doc = "scans redrawn per step after poses have changed")]
    redrawn_scans: i64,
    #[param(default = 0.0, unit = "m", doc = "x in the map at the first scan")]
    map_start_x: f64,
    #[param(default = 0.0, unit = "m", doc = "y in the map at the first scan")]
    map_start_y: f64,
    #[param(default = 0.0, unit = "rad", doc = "heading in the map at the first scan")]
    map_start_yaw: f64,
    #[param(default = 1.0, range = 0.05..=3600.0, unit = "s", doc = "age of the newest scan above which the laser counts as stopped")]
    scan_timeout: f64,
    #[param(default = 3.0, range = 0.1..=1000.0, unit = "m/s", doc = "velocity above which the odometry counts as a jump")]
    max_linear_velocity: f64,
    #[param(default = 6.0, range = 0.1..=1000.0, unit = "rad/s", doc = "angular velocity above which the odometry counts as a jump")]
    max_angular_velocity: f64,
    #[param(default = "laser", doc = "name of the laser in the robot model, which has its mount")]
    laser: Text<28>,
    #[param(default = true, doc = "publish the transform from map to odometry")]
    tf_broadcast: Bool,
    #[param(default = true, doc = "publish the transform from odometry to robot")]
    odom_broadcast: Bool,
    #[param(default = "map", doc = "frame of the map")]
    global_frame_id: Text<60>,
    #[param(default = "odom", doc = "frame of the odometry")]
    odom_frame_id: Text<60>,
    #[param(default = "base_link", doc = "frame of the robot")]
    base_frame_id: Text<60>,
}

/// Parameters of one of the methods.
pub(super) enum MethodParameters {
    Graph(GraphSlamParameters),
    ParticleFilter(ParticleSlamParameters),
}

impl SlamParams {
    /// Returns the method with its parameters.
    ///
    /// # Errors
    /// An unknown method.
    pub(super) fn method(&self) -> Result<MethodParameters, InvalidSlamParameter> {
        let (matching, odometry) = (self.matching(), self.odometry());
        match self.method.as_str() {
            "graph" => Ok(MethodParameters::Graph(GraphSlamParameters {
                matching,
                odometry,
                scans_per_submap: count(self.scans_per_submap),
                loops: LoopClosureParameters {
                    max_distance: self.loop_max_distance,
                    search_distance: self.loop_search_distance,
                    search_angle: self.loop_search_angle,
                    min_score: self.loop_min_score,
                    ..LoopClosureParameters::default()
                },
            })),
            "particle_filter" => Ok(MethodParameters::ParticleFilter(ParticleSlamParameters {
                matching,
                odometry,
                particles: count(self.particles),
                ..ParticleSlamParameters::default()
            })),
            _ => Err(InvalidSlamParameter { name: "method", expected: "graph or particle_filter" }),
        }
    }

    fn matching(&self) -> MatchingParameters {
        MatchingParameters {
            resolution: self.resolution,
            max_laser_range: self.max_laser_range,
            search_distance: self.search_distance,
            search_angle: self.search_angle,
            ..MatchingParameters::default()
        }
    }

    fn odometry(&self) -> OdometryDrift {
        OdometryDrift {
            translation_stddev: self.odometry_translation_stddev,
            rotation_stddev: self.odometry_rotation_stddev,
            drift_stddev: self.odometry_drift_stddev,
        }
    }

    pub(super) fn map(&self) -> MapSettings {
        MapSettings {
            resolution: self.resolution,
            most_cells: MOST_CELLS,
            occupied_threshold: i8::try_from(self.occupied_threshold).unwrap_or(i8::MAX),
            redrawn_scans: count(self.redrawn_scans),
        }
    }

    /// Returns the pose of the first scan in the map.
    pub(super) fn start(&self) -> Pose2 {
        Pose2 { x: self.map_start_x, y: self.map_start_y, theta: self.map_start_yaw }
    }

    /// Returns translation, m, and rotation, rad, after which a scan is inserted.
    pub(super) fn minimum_travel(&self) -> [f64; 2] {
        [self.minimum_travel_distance, self.minimum_travel_heading]
    }

    pub(super) fn background_units(&self) -> usize {
        count(self.background_units)
    }

    /// Returns the time without an inserted scan after which the graph is finished, ns.
    pub(super) fn finish_after(&self) -> Option<u64> {
        (self.finish_after > 0.0).then_some((self.finish_after * 1e9) as u64)
    }

    /// Returns the time between two maps, ns.
    /// It is a rounding below the parameter, so that no map is a cycle late.
    pub(super) fn map_interval(&self) -> u64 {
        (self.map_update_interval * 1e9 - 1.0) as u64
    }

    pub(super) fn beams(&self) -> BeamSelection {
        BeamSelection {
            max_beams: count(self.max_beams),
            min_range: self.min_laser_range,
            max_range: self.max_laser_range,
        }
    }

    pub(super) fn velocity_limits(&self) -> VelocityLimits {
        VelocityLimits { linear: self.max_linear_velocity, angular: self.max_angular_velocity }
    }

    pub(super) fn frames(&self) -> FrameNames<'_> {
        FrameNames {
            map: self.global_frame_id.as_str(),
            odom: self.odom_frame_id.as_str(),
            base: self.base_frame_id.as_str(),
        }
    }
}

/// Returns a number whose range the host has checked.
fn count(number: i64) -> usize {
    usize::try_from(number).unwrap_or(0)
}
