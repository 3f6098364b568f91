//! Map of a building from a file.

use std::path::Path;

use serde::{Deserialize, Serialize};
use slate_grid::OccupancyMap;
use slate_interfaces::OccupancyGrid;
use slate_map_file::read_map;
use slate_mapek::SensorBlock;
use slate_mapek::prelude::*;
use slate_module::prelude::*;
use slate_module::{Spec, Stage};

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

/// Publishes the map of a `map.yaml`, in ROS's format.
/// The file is read when the agent starts, and when its name changes.
pub struct MapServer;

/// State of [`MapServer`].
#[derive(Default, Serialize, Deserialize)]
pub struct MapServerState {
    /// Name of the file that was read, with success or not.
    file: Option<String>,
    /// True if the map is invalid and can't be published.
    is_invalid: bool,
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
        let file = params.yaml_filename.as_str();
        if state.file.as_deref() == Some(file) {
            return None;
        }
        state.file = Some(file.into());
        let map = read(file);
        state.is_invalid = map.is_err();
        let map =
            map.map_err(|reason| now.error(format_args!("{reason}; name another `yaml_filename`"))).ok()?;
        Some(io.value.write(map.cells.len(), |grid| {
            grid.origin = map.geometry.origin();
            grid.resolution = map.geometry.resolution;
            (grid.width, grid.height) = (map.geometry.width as u32, map.geometry.height as u32);
            grid.data.copy_from_slice(&map.cells);
        }))
    }
}

/// Reads a map that the port has room for.
fn read(file: &str) -> Result<OccupancyMap, String> {
    let map = read_map(Path::new(file)).map_err(|error| error.to_string())?;
    match map.cells.len() {
        ..=MOST_CELLS => Ok(map),
        cells => Err(format!("{file}: {cells} cells, expected at most {MOST_CELLS}")),
    }
}

/// [`MapServer`] as a module.
/// A [`SensorBlock`] that is degraded while its file is not a valid map.
pub struct MapServerBlock;

impl Module for MapServerBlock {
    type Io = <SensorBlock<MapServer> as Module>::Io;
    type Params = MapServerParams;
    type State = MapServerState;

    const NAME: &'static str = <SensorBlock<MapServer> as Module>::NAME;
    const DOC: &'static str = <SensorBlock<MapServer> as Module>::DOC;
    const STAGE: Stage = <SensorBlock<MapServer> as Module>::STAGE;

    fn spec() -> Spec {
        SensorBlock::<MapServer>::spec()
    }

    fn create(setup: &Setup<'_>, params: &MapServerParams) -> Result<MapServerState, Refusal> {
        SensorBlock::<MapServer>::create(setup, params)
    }

    fn tick(state: &mut MapServerState, io: &Self::Io, params: &MapServerParams, now: &Tick) -> Outcome {
        match SensorBlock::<MapServer>::tick(state, io, params, now) {
            Outcome::Ok if state.is_invalid => Outcome::Degraded,
            outcome => outcome,
        }
    }
}
