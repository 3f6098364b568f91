//! The block `map_server`: files that are maps, and others.

use std::path::{Path, PathBuf};

use slate_grid::{Geometry, OccupancyMap};
use slate_interfaces::OccupancyGrid;
use slate_localization::{MapServerBlock, MapServerParams};
use slate_map_file::{MapFileOptions, write_map};
use slate_module::testing::Fixture;
use slate_module::{Outcome, Text};

/// Writes a map of that many cells in a row.
fn map(name: &str, cells: usize) -> PathBuf {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let size = [0.1 * cells as f64, 0.1];
    let geometry = Geometry::new([0.0, 0.0], size, 0.1, cells).unwrap();
    write_map(&file, &OccupancyMap { geometry, cells: vec![0; cells] }, &MapFileOptions::default()).unwrap();
    file
}

fn server(file: &Path) -> Fixture<MapServerBlock> {
    Fixture::with(MapServerParams { yaml_filename: Text::new(file.to_str().unwrap()) }).unwrap()
}

/// Cells of the map that the newest tick has published.
fn cells(server: &Fixture<MapServerBlock>) -> Option<usize> {
    server.read::<OccupancyGrid, usize>("value", |map| map.data.len())
}

#[test]
fn a_map_is_published_once() {
    let mut server = server(&map("once.yaml", 5));
    assert_eq!((server.tick().outcome().unwrap(), cells(&server)), (Outcome::Ok, Some(5)));
    assert_eq!((server.tick().outcome().unwrap(), cells(&server)), (Outcome::Ok, None));
}

#[test]
fn a_file_that_is_no_map_degrades_until_another_is_named() {
    let mut server = server(Path::new("nowhere/map.yaml"));
    for _ in 0..3 {
        assert_eq!((server.tick().outcome().unwrap(), cells(&server)), (Outcome::Degraded, None));
    }
    server.params().yaml_filename = Text::new(map("another.yaml", 7).to_str().unwrap());
    assert_eq!((server.tick().outcome().unwrap(), cells(&server)), (Outcome::Ok, Some(7)));
    assert_eq!(server.tick(), Outcome::Ok);
}

#[test]
fn a_map_of_too_many_cells_is_refused() {
    let mut server = server(&map("large.yaml", (1 << 22) + 1));
    assert_eq!((server.tick().outcome().unwrap(), cells(&server)), (Outcome::Degraded, None));
}
