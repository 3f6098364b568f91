//! Referee of an exploration.

use std::fmt::Write as _;
use std::path::Path;

use serde::{Deserialize, Serialize};
use slate_grid::{Geometry, OccupancyMap};
use slate_interfaces::{MissionOutcome, MissionState, OccupancyGrid, Point2, Verdict};
use slate_map_file::read_map;
use slate_module::prelude::*;

use crate::explorer::ExplorationProgress;
use crate::frontier::is_free;

/// Period of checks of the map, s.
const PERIOD: f64 = 1.0;
/// Largest number of cells of a map.
const MOST_CELLS: usize = 1 << 22;

/// Ports of [`ExplorationReferee`].
#[ports]
pub struct ExplorationRefereeIo {
    /// Map of the robot, in the frame of the true one.
    map: Input<OccupancyGrid>,
    /// Progress that the robot reports.
    progress: Input<ExplorationProgress>,
    /// Verdict: ends when the robot has nothing left to see, or the time is up.
    verdict: Output<Verdict>,
    /// Coverage of the exploration.
    coverage: Output<ExplorationCoverage>,
}

/// Coverage of a building by an exploration.
#[interface]
#[derive(PartialEq)]
pub struct ExplorationCoverage {
    /// Share of the free area that is free in the map of the robot, 0 to 1.
    pub known_share: f64,
    /// Free area of the building.
    #[unit("m^2")]
    pub free_area: f64,
    /// Time since the first map.
    #[unit("s")]
    pub time: f64,
}

/// Parameters of [`ExplorationReferee`].
#[params]
pub struct ExplorationRefereeParams {
    #[param(default = "map.yaml", doc = "file of the true map")]
    yaml_filename: Text<252>,
    #[param(default = 0.95, range = 0.0..=1.0, doc = "minimum share of the free area that a success has seen")]
    min_known_share: f64,
    #[param(default = 900.0, range = 1.0..=1e9, unit = "s", doc = "time limit, from the first map on")]
    time_limit: f64,
}

/// Referee of an exploration by the true map.
/// It measures the share of the free area that is known when no frontier is left.
///
/// Free area is the largest connected one of the true map.
pub struct ExplorationReferee;

/// State of [`ExplorationReferee`].
#[derive(Default, Serialize, Deserialize)]
pub struct ExplorationRefereeState {
    began: Option<f64>,
    looked: Option<f64>,
    has_decided: bool,
    /// Middles of the free cells, and the area of one, m²; read again after a restart.
    #[serde(skip)]
    free: Option<(Vec<Point2>, f64)>,
    /// Name of the file that was read, with success or not.
    #[serde(skip)]
    file: Option<String>,
}

/// Judges how much of a building an exploration has seen.
#[module(stage = PostLoop)]
impl Module for ExplorationReferee {
    type Io = ExplorationRefereeIo;
    type Params = ExplorationRefereeParams;
    type State = ExplorationRefereeState;

    fn tick(
        state: &mut ExplorationRefereeState,
        io: &ExplorationRefereeIo,
        params: &ExplorationRefereeParams,
        now: &Tick,
    ) -> Outcome {
        state.read(params, now);
        if state.free.is_none() {
            return Outcome::Degraded;
        }
        let (Some(map), Some(progress), false) = (io.map.get(), io.progress.get(), state.has_decided) else {
            return Outcome::Ok;
        };
        let time = now.seconds() - *state.began.get_or_insert(now.seconds());
        let is_over = progress.is_done.get() || time >= params.time_limit;
        if !is_over && state.looked.is_some_and(|looked| now.seconds() - looked < PERIOD) {
            return Outcome::Ok;
        }
        state.looked = Some(now.seconds());
        let Some(coverage) = state.coverage(map, time) else { return Outcome::Degraded };
        io.coverage.set(coverage);
        io.verdict.set(verdict(&coverage, progress.is_done.get(), is_over, params));
        state.has_decided = is_over;
        Outcome::Ok
    }
}

impl ExplorationRefereeState {
    fn read(&mut self, params: &ExplorationRefereeParams, now: &Tick) {
        let file = params.yaml_filename.as_str();
        if self.file.as_deref() == Some(file) {
            return;
        }
        self.file = Some(file.into());
        let map = read_map(Path::new(file))
            .map_err(|error| now.error(format_args!("{error}; name another `yaml_filename`")));
        self.free = map.ok().map(|map| {
            let area = map.geometry.resolution * map.geometry.resolution;
            (largest_free_area(&map), area)
        });
    }

    fn coverage(&self, map: &OccupancyGrid, time: f64) -> Option<ExplorationCoverage> {
        let geometry = Geometry::of(map, MOST_CELLS)?;
        let (free, area) = self.free.as_ref()?;
        let is_known = |point: &&Point2| {
            let cell = geometry.cell(point.x, point.y);
            cell.is_some_and(|(column, row)| is_free(map.data[geometry.index(column, row)]))
        };
        let known = free.iter().filter(is_known).count() as f64;
        let count = math::max(free.len() as f64, 1.0);
        Some(ExplorationCoverage { known_share: known / count, free_area: count * area, time })
    }
}

fn verdict(
    coverage: &ExplorationCoverage,
    is_done: bool,
    is_over: bool,
    params: &ExplorationRefereeParams,
) -> Verdict {
    let ExplorationCoverage { known_share, free_area, time } = *coverage;
    let mut reason = Text::default();
    // A text that does not fit is cut.
    let _ = write!(reason, "explored {:.1} % of {free_area:.0} m2 in {time:.0} s", 100.0 * known_share);
    let is_success = known_share >= params.min_known_share;
    let (state, outcome) = match (is_over, is_done) {
        (false, _) => (MissionState::RUNNING, MissionOutcome::OTHER),
        (true, true) if is_success => (MissionState::SUCCEEDED, MissionOutcome::GOAL_REACHED),
        (true, true) => (MissionState::FAILED, MissionOutcome::OTHER),
        (true, false) => (MissionState::FAILED, MissionOutcome::TIMED_OUT),
    };
    Verdict { state, outcome, reason }
}

/// Middles of the cells of the largest connected free area.
fn largest_free_area(map: &OccupancyMap) -> Vec<Point2> {
    let Geometry { width, height, .. } = map.geometry;
    let mut is_seen: Vec<bool> = map.cells.iter().map(|cell| !is_free(*cell)).collect();
    let mut largest = Vec::new();
    for first in 0..map.cells.len() {
        if std::mem::replace(&mut is_seen[first], true) {
            continue;
        }
        let mut area = vec![first];
        let mut at = 0;
        while at < area.len() {
            let (column, row) = (area[at] % width, area[at] / width);
            let mut visit = |is_inside: bool, cell: usize| {
                if is_inside && !std::mem::replace(&mut is_seen[cell], true) {
                    area.push(cell);
                }
            };
            let cell = row * width + column;
            visit(column > 0, cell.wrapping_sub(1));
            visit(column + 1 < width, cell + 1);
            visit(row > 0, cell.wrapping_sub(width));
            visit(row + 1 < height, cell + width);
            at += 1;
        }
        if area.len() > largest.len() {
            largest = area;
        }
    }
    largest.into_iter().map(|cell| map.geometry.center(cell % width, cell / width)).collect()
}
