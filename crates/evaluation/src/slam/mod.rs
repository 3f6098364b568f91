//! SLAM on the log of the Intel Research Lab.

pub mod relations;
mod trajectory;

use std::path::Path;

use slate_grid::OccupancyMap;
use slate_interfaces::Pose2;
use slate_map_file::{MOST_MAP_CELLS, MapFileOptions, write_map};
use slate_module::{Random, math};
use slate_slam::carmen::{LaserLog, LogFormat, LoggedScan, read_log};
use slate_slam::{GraphSlam, GraphSlamParameters, ParticleSlam, ParticleSlamParameters, occupancy_map};

use crate::planning::timed;
use crate::{DataError, Evaluation, Figure, FigureGoal};
use relations::{Relation, RelationErrors};

pub use trajectory::{is_one_line, trajectory};

/// Offset of the relations' times from the log's, s.
const TIME_OFFSET: f64 = 976_052_857.337;
/// Edge length of a cell of a map that is written, m.
const MAP_RESOLUTION: f64 = 0.05;

/// Method of SLAM.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlamMethod {
    /// Pose graph with loop closure.
    Graph,
    /// Rao-Blackwellized particle filter.
    ParticleFilter,
}

/// Evaluates a method on `intel/` of a folder.
/// It reads `intel.gfs.log` and `intel.relations`, and writes the map to a file, if one is given.
///
/// # Errors
/// A file that can't be read or written, or is not what its format says.
pub fn evaluate(folder: &Path, method: SlamMethod, map: Option<&Path>) -> Result<Evaluation, DataError> {
    let folder = folder.join("intel");
    let log = read_log(&folder.join("intel.gfs.log"), &LogFormat::INTEL)?;
    let relations = relations::read_relations(&folder.join("intel.relations"), TIME_OFFSET)?;
    let (poses, took) = timed(|| run(&log, method));
    if let Some(file) = map {
        write(file, &log, &poses)?;
    }
    let name = match method {
        SlamMethod::Graph => "graph",
        SlamMethod::ParticleFilter => "particle filter",
    };
    Ok(Evaluation {
        name: format!("Intel Research Lab, {name}"),
        figures: figures(&log, &relations, &poses, took, method),
        notes: Vec::new(),
    })
}

fn figures(
    log: &LaserLog,
    relations: &[Relation],
    poses: &[Pose2],
    took: f64,
    method: SlamMethod,
) -> Vec<Figure> {
    let found = trajectory(log, poses);
    let RelationErrors { translation, rotation } = relations::errors(&found, relations);
    let is_certain = |relation: &&Relation| relation.times.iter().all(|time| is_one_line(log, *time));
    let certain: Vec<Relation> = relations.iter().filter(is_certain).copied().collect();
    let of = |pose: fn(&LoggedScan) -> Pose2| {
        let poses: Vec<Pose2> = log.scans.iter().map(pose).collect();
        relations::errors(&trajectory(log, &poses), relations).translation[0]
    };
    let times = log.odometry.iter().map(|line| line.time);
    let duration = times.clone().fold(0.0, math::max) - times.fold(f64::INFINITY, math::min);
    let goal = match method {
        SlamMethod::Graph => 0.031,
        SlamMethod::ParticleFilter => 0.070,
    };
    let error = "absolute translational error, m";
    vec![
        Figure::new("scans", log.scans.len() as f64),
        Figure::new("relations", relations.len() as f64),
        Figure::new(format!("raw odometry: {error}"), of(|scan| scan.odometry)),
        Figure::new("GMapping's poses in the log: translational error, m", of(|scan| scan.corrected)),
        Figure::new(error, translation[0]).with_goal(FigureGoal::AtMost(goal)),
        Figure::new("its standard deviation, m", translation[1]),
        Figure::new("absolute rotational error, degrees", rotation[0].to_degrees()),
        Figure::new("its standard deviation, degrees", rotation[1].to_degrees()),
        Figure::new("relations whose times are each of one line", certain.len() as f64),
        Figure::new(format!("these: {error}"), relations::errors(&found, &certain).translation[0]),
        Figure::new("times faster than real time", 1e3 * duration / took)
            .with_goal(FigureGoal::AtLeast(100.0)),
    ]
}

/// Returns the poses of the scans.
fn run(log: &LaserLog, method: SlamMethod) -> Vec<Pose2> {
    match method {
        SlamMethod::Graph => {
            let Ok(mut slam) = GraphSlam::new(GraphSlamParameters::default()) else { return Vec::new() };
            for scan in &log.scans {
                slam.insert(scan.odometry, &scan.points());
            }
            slam.finish();
            slam.poses().to_vec()
        }
        SlamMethod::ParticleFilter => {
            let Ok(mut slam) = ParticleSlam::new(ParticleSlamParameters::default()) else {
                return Vec::new();
            };
            let mut random = Random::new(1, "slam");
            for scan in &log.scans {
                slam.insert(scan.odometry, &scan.points(), &mut random);
            }
            slam.poses().to_vec()
        }
    }
}

fn write(file: &Path, log: &LaserLog, poses: &[Pose2]) -> Result<(), DataError> {
    let most = slate_slam::MatchingParameters::default().max_laser_range;
    let near = |points: &[[f64; 2]]| -> Vec<[f64; 2]> {
        points.iter().filter(|[x, y]| x * x + y * y <= most * most).copied().collect()
    };
    let points: Vec<Vec<[f64; 2]>> = log.scans.iter().map(|scan| near(&scan.points())).collect();
    let scans = poses.iter().copied().zip(points.iter().map(Vec::as_slice));
    let map: Option<OccupancyMap> = occupancy_map(scans, MAP_RESOLUTION, MOST_MAP_CELLS);
    let map = map.ok_or_else(|| DataError::new(file, "the map has no cells, or too many"))?;
    write_map(file, &map, &MapFileOptions::default()).map_err(|error| DataError::new(file, error.to_string()))
}
