//! Map of a building from a file.

use std::path::Path;

use serde::{Deserialize, Serialize};
use slate_interfaces::OccupancyGrid;
use slate_map_file::read_map;
use slate_mapek::prelude::*;
use slate_module::prelude::*;

use crate::MOST_CELLS;

/// Ports of [`MapServer`].
#[ports]
pub struct MapServerIo {
    /// Map of the file.
    #[capacity(4_194_304)]
    value: Measurement<OccupancyGrid>,
}

/// Parameters of [`MapServer`].
#[params]
pub struct MapServerParams {
    #[param(default = "map.yaml", doc = "file of the map")]
    yaml_filename: Text<252>,
}

/// Publishes the map of a `map.yaml`, as ROS has it. The file is read once, when the agent starts.
pub struct MapServer;

/// State of [`MapServer`].
#[derive(Default, Serialize, Deserialize)]
pub struct MapServerState {
    /// Whether the file was read, with success or not.
    was_read: bool,
}

impl Sensor for MapServer {
    const NAME: &'static str = "map_server";
    const DOC: &'static str = "Publishes the map of a map.yaml.";
    type Io = MapServerIo;
    type Params = MapServerParams;
    type State = MapServerState;
    type Value = InPlace<OccupancyGrid>;

    fn get_data(
        state: &mut MapServerState,
        io: &MapServerIo,
        params: &MapServerParams,
        now: &Tick,
    ) -> Option<InPlace<OccupancyGrid>> {
        if std::mem::replace(&mut state.was_read, true) {
            return None;
        }
        let file = params.yaml_filename.as_str();
        let map = match read_map(Path::new(file)) {
            Ok(map) if map.cells.len() <= MOST_CELLS => map,
            Ok(map) => {
                now.error(format_args!("{file}: {} cells, expected at most {MOST_CELLS}", map.cells.len()));
                return None;
            }
            Err(error) => {
                now.error(format_args!("{error}"));
                return None;
            }
        };
        Some(io.value.write(map.cells.len(), |grid| {
            grid.origin = map.geometry.origin();
            grid.resolution = map.geometry.resolution;
            (grid.width, grid.height) = (map.geometry.width as u32, map.geometry.height as u32);
            grid.data.copy_from_slice(&map.cells);
        }))
    }
}
