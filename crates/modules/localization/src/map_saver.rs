//! Map to a file.

use std::path::Path;

use serde::{Deserialize, Serialize};
use slate_grid::{Geometry, OccupancyMap};
use slate_interfaces::{MissionState, OccupancyGrid, Verdict};
use slate_map_file::{MOST_MAP_CELLS, MapFileOptions, write_map};
use slate_module::prelude::*;

/// Ports of [`MapSaver`].
#[ports]
pub struct MapSaverIo {
    /// Map that is saved.
    map: Input<OccupancyGrid>,
    /// Verdict on the mission, at whose end the map is saved to `map_file`.
    verdict: Input<Verdict>,
    /// Requests: each saves the map of its time.
    save_map: Inbox<SaveMap>,
}

/// Request to save a map.
#[interface]
#[derive(PartialEq)]
pub struct SaveMap {
    /// Path of a `.yaml` file, beside which the image is written.
    pub file: Text<252>,
}

impl SaveMap {
    /// Refusal: there is no map, or the file can't be written; the log has the reason.
    pub const NOT_SAVED: u16 = 1;
}

/// Parameters of [`MapSaver`].
#[params]
pub struct MapSaverParams {
    #[param(default = "", doc = "file of the map at the end of the mission; empty for none")]
    map_file: Text<252>,
}

/// Saves a map as `map.yaml` with its image, as Nav2's `map_saver`.
/// It saves on request, and at the end of a mission.
///
/// Paths are relative to the folder that the agent runs in.
pub struct MapSaver;

/// State of [`MapSaver`].
#[derive(Default, Serialize, Deserialize)]
pub struct MapSaverState {
    /// True if the mission has ended.
    has_ended: bool,
    /// True if the newest map could not be saved.
    has_failed: bool,
}

/// Saves a map as map.yaml with its image.
#[module(stage = PostLoop)]
impl Module for MapSaver {
    type Io = MapSaverIo;
    type Params = MapSaverParams;
    type State = MapSaverState;

    fn tick(state: &mut MapSaverState, io: &MapSaverIo, params: &MapSaverParams, now: &Tick) -> Outcome {
        for request in io.save_map.iter() {
            state.has_failed = !save(io.map.get(), request.file.as_str(), now);
            if state.has_failed {
                request.refuse(SaveMap::NOT_SAVED);
            }
        }
        let is_ended = io.verdict.get().is_some_and(|verdict| verdict.state != MissionState::RUNNING);
        if is_ended
            && !std::mem::replace(&mut state.has_ended, is_ended)
            && !params.map_file.as_str().is_empty()
        {
            state.has_failed = !save(io.map.get(), params.map_file.as_str(), now);
        }
        if state.has_failed { Outcome::Degraded } else { Outcome::Ok }
    }
}

/// Saves a map; returns whether it could.
fn save(map: Option<&OccupancyGrid>, file: &str, now: &Tick) -> bool {
    let saved = map.ok_or_else(|| "no map to save: link `map` to one".to_owned()).and_then(|map| {
        let geometry =
            Geometry::of(map, MOST_MAP_CELLS).ok_or("invalid map: expected as many cells as data")?;
        let map = OccupancyMap { geometry, cells: map.data.to_vec() };
        write_map(Path::new(file), &map, &MapFileOptions::default()).map_err(|error| error.to_string())
    });
    match &saved {
        Ok(()) => now.info(format_args!("map saved to {file}")),
        Err(reason) => now.error(format_args!("map not saved: {reason}")),
    }
    saved.is_ok()
}
