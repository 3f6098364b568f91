//! Costs of the map, for the global planner.

use serde::{Deserialize, Serialize};
use slate_grid::Geometry;
use slate_planning::{CostGrid, Costmap, GridCell, Inflation};
use slate_plugin::interfaces::{OccupancyGrid, Pose2};
use slate_plugin::module::Stamp;
use slate_plugin::prelude::*;

use crate::MOST_CELLS;
use crate::costs::to_percent;
use crate::frames::PlanarTransform;
use crate::obstacles::ObstaclePoints;

/// Rectangle of a map that a robot keeps out of.
#[interface]
#[derive(PartialEq)]
pub struct KeepOutZone {
    /// Least x in the map frame.
    #[unit("m")]
    pub min_x: f64,
    /// Least y.
    #[unit("m")]
    pub min_y: f64,
    /// Greatest x.
    #[unit("m")]
    pub max_x: f64,
    /// Greatest y.
    #[unit("m")]
    pub max_y: f64,
}

/// Ports of [`GlobalCostmap`].
#[ports]
pub struct GlobalCostmapIo {
    /// Map of the building, as of a `map_server`.
    map: Input<OccupancyGrid>,
    /// Pose of the robot in the map frame, from Knowledge.
    #[stale(after = "500ms")]
    pose: Input<Pose2>,
    /// Obstacles around the robot, from Knowledge.
    #[stale(after = "500ms")]
    obstacles: Input<ObstaclePoints>,
    /// Costs in percent: 100 an obstacle, 99 too near to one, -1 unknown.
    #[capacity(1_048_576)]
    change: Change<OccupancyGrid>,
}

/// Parameters of [`GlobalCostmap`], with the names of Nav2.
#[params]
#[derive(PartialEq)]
pub struct GlobalCostmapParams {
    #[param(default = 0.5, range = 0.05..=60.0, unit = "s", doc = "time between two costmaps")]
    update_period: f64,
    #[param(default = 0.28, range = 0.0..=5.0, unit = "m", doc = "distance to an obstacle up to which the robot's middle may not come")]
    robot_radius: f64,
    #[param(default = 0.75, range = 0.0..=10.0, unit = "m", doc = "inflation radius around obstacles")]
    inflation_radius: f64,
    #[param(default = 4.0, range = 0.0..=100.0, unit = "1/m", doc = "decay rate of the cost with the distance")]
    cost_scaling_factor: f64,
    #[param(default = 4.0, range = 0.0..=100.0, unit = "m", doc = "distance from the robot up to which seen obstacles count")]
    obstacle_max_range: f64,
    #[param(default = Sequence::default(), doc = "rectangles that the robot keeps out of, meters")]
    keep_out_zones: Sequence<KeepOutZone, 8>,
}

/// Layered global costmap: map, observed obstacles, keep-out zones, inflation.
pub struct GlobalCostmap;

/// State of [`GlobalCostmap`].
#[derive(Default, Serialize, Deserialize)]
pub struct GlobalCostmapState {
    /// Time of the newest costmap, ns.
    updated: Option<u64>,
    /// True if the map is invalid.
    is_invalid: bool,
    /// Layers and their source; rebuilt after a restart.
    #[serde(skip)]
    layers: Option<(Stamp, GlobalCostmapParams, Costmap)>,
    #[serde(skip)]
    hits: Vec<[f64; 2]>,
}

impl Analyze for GlobalCostmap {
    const NAME: &'static str = "global_costmap";
    const DOC: &'static str = "Computes a costmap from a map and observed obstacles.";
    type Observed = GlobalCostmapIo;
    type Params = GlobalCostmapParams;
    type State = GlobalCostmapState;
    type Value = InPlace<OccupancyGrid>;

    fn process(
        state: &mut GlobalCostmapState,
        io: &GlobalCostmapIo,
        params: &GlobalCostmapParams,
        now: &Tick,
    ) -> Option<InPlace<OccupancyGrid>> {
        let map = io.map.get()?;
        let is_due = state
            .updated
            .is_none_or(|at| now.now().saturating_sub(at) as f64 >= params.update_period * 1e9 - 1.0);
        if !is_due && !io.map.is_new() {
            return None;
        }
        state.updated = Some(now.now());
        if let Err(reason) = state.prepare(map, io.map.stamp(), params) {
            if !std::mem::replace(&mut state.is_invalid, true) {
                now.warn(format_args!("`map` is invalid: {reason}; the robot stops until the map is valid"));
            }
            return None;
        }
        if std::mem::replace(&mut state.is_invalid, false) {
            now.info(format_args!("`map` has recovered"));
        }
        let GlobalCostmapState { layers, hits, .. } = state;
        let (_, _, costmap) = layers.as_mut()?;
        costmap.clear_observations();
        if let (Some(pose), Some(obstacles)) =
            (io.pose.fresh().filter(|pose| pose.is_known()), io.obstacles.fresh())
        {
            let robot = PlanarTransform::of(&obstacles.pose);
            hits.clear();
            hits.extend(
                obstacles
                    .points
                    .iter()
                    .map(|point| robot.inverse_point([point.x, point.y]))
                    .filter(|[x, y]| math::hypot(*x, *y) <= params.obstacle_max_range),
            );
            costmap.insert_scan(pose, hits, &[]);
        }
        let grid = costmap.update();
        Some(io.change.write(map.data.len(), |costs| {
            (costs.origin, costs.resolution) = (map.origin, map.resolution);
            (costs.width, costs.height) = (map.width, map.height);
            write_costs(grid, costs);
        }))
    }

    fn is_degraded(state: &GlobalCostmapState) -> bool {
        state.is_invalid
    }
}

fn write_costs(grid: &CostGrid, costs: &mut OccupancyGrid) {
    let width = costs.width as usize;
    for (row, cells) in costs.data.chunks_mut(width.max(1)).enumerate() {
        for (column, cell) in cells.iter_mut().enumerate() {
            *cell = to_percent(grid.cost(GridCell::new(column as u32, row as u32)));
        }
    }
}

impl GlobalCostmapState {
    /// Creates the layers when missing or outdated.
    /// They are outdated when the map or the parameters have changed.
    fn prepare(
        &mut self,
        map: &OccupancyGrid,
        stamp: Stamp,
        params: &GlobalCostmapParams,
    ) -> Result<(), &'static str> {
        if self.layers.as_ref().is_some_and(|(made, with, _)| (made, with) == (&stamp, params)) {
            return Ok(());
        }
        // None is left of an earlier map if this one is invalid.
        self.layers = None;
        let geometry =
            Geometry::of(map, MOST_CELLS).ok_or("expected 1 to 1048576 cells, and as much data")?;
        if !map.data.iter().any(|occupancy| (0..65).contains(occupancy)) {
            return Err("expected a free cell, found none");
        }
        let inflation = Inflation {
            inscribed_radius: params.robot_radius,
            inflation_radius: math::max(params.robot_radius, params.inflation_radius),
            cost_scaling_factor: params.cost_scaling_factor,
        };
        let mut costmap =
            Costmap::new(geometry, inflation).map_err(|_| "expected a map that can be searched")?;
        costmap.set_static(|cell| map.data[cell]);
        let zones = params.keep_out_zones;
        costmap.keep_out(|cell| {
            let middle = geometry.center(cell % geometry.width, cell / geometry.width);
            zones.iter().any(|zone| {
                (zone.min_x..=zone.max_x).contains(&middle.x) && (zone.min_y..=zone.max_y).contains(&middle.y)
            })
        });
        self.layers = Some((stamp, *params, costmap));
        Ok(())
    }
}
