//! Map of a building from a file.

use std::path::Path;

use serde::{Deserialize, Serialize};
use slate_grid::OccupancyMap;
use slate_interfaces::OccupancyGrid;
use slate_map_file::read_map;
use slate_module::prelude::*;
use slate_module::{Refusal, Setup};

/// Ports of [`MapServer`].
#[ports]
pub struct MapServerIo {
    /// Map of the file.
    #[capacity(4_194_304)]
    map: Output<OccupancyGrid>,
}

/// Parameters of [`MapServer`].
#[params]
pub struct MapServerParams {
    #[param(default = "map.yaml", doc = "file of the map")]
    yaml_filename: Text<252>,
}

/// Publishes the map of a `map.yaml`, as ROS has it. The file is read when the agent starts.
pub struct MapServer;

/// State of [`MapServer`].
#[derive(Default, Serialize, Deserialize)]
pub struct MapServerState {
    is_published: bool,
    #[serde(skip)]
    map: Option<OccupancyMap>,
}

#[module(stage = PreLoop)]
impl Module for MapServer {
    type Io = MapServerIo;
    type Params = MapServerParams;
    type State = MapServerState;

    fn create(_: &Setup<'_>, params: &MapServerParams) -> Result<MapServerState, Refusal> {
        let map =
            read_map(Path::new(params.yaml_filename.as_str())).map_err(|error| Refusal(error.to_string()))?;
        if map.cells.len() > crate::MOST_CELLS {
            return Err(format!(
                "{}: {} cells, expected at most {}",
                params.yaml_filename.as_str(),
                map.cells.len(),
                crate::MOST_CELLS
            )
            .into());
        }
        Ok(MapServerState { is_published: false, map: Some(map) })
    }

    fn tick(state: &mut MapServerState, io: &MapServerIo, _: &MapServerParams, _: &Tick) -> Outcome {
        if state.is_published {
            return Outcome::Ok;
        }
        let Some(map) = state.map.take() else { return Outcome::Failed };
        let is_written = io.map.write(map.cells.len(), |grid| {
            grid.origin = map.geometry.origin();
            grid.resolution = map.geometry.resolution;
            (grid.width, grid.height) = (map.geometry.width as u32, map.geometry.height as u32);
            grid.data.copy_from_slice(&map.cells);
        });
        state.is_published = is_written;
        if is_written { Outcome::Ok } else { Outcome::Failed }
    }
}
