//! The blocks `map_server` and `map_saver`: files that are maps, and others.

use std::path::{Path, PathBuf};

use slate_grid::{Geometry, OccupancyMap};
use slate_interfaces::{MissionOutcome, MissionState, OccupancyGrid, Verdict};
use slate_localization::{MapSaver, MapSaverParams, MapServerBlock, MapServerParams, SaveMap};
use slate_map_file::{MapFileOptions, read_map, write_map};
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

fn saver(map_file: &str) -> Fixture<MapSaver> {
    let mut saver = Fixture::<MapSaver>::with(MapSaverParams { map_file: Text::new(map_file) }).unwrap();
    saver.write::<OccupancyGrid>("map", 6, |map| {
        (map.resolution, map.width, map.height) = (0.1, 3, 2);
        map.data.copy_from_slice(&[0, 100, -1, 0, 0, 100]);
    });
    saver
}

fn file(name: &str) -> String {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_file(&file);
    file.to_str().unwrap().to_owned()
}

#[test]
fn map_is_saved_on_request() {
    let (mut saver, file) = (saver(""), file("asked.yaml"));
    assert_eq!(saver.tick(), Outcome::Ok);
    saver.push("save_map", SaveMap { file: Text::new(&file) });
    assert_eq!(saver.tick(), Outcome::Ok);
    assert_eq!(read_map(Path::new(&file)).unwrap().cells, [0, 100, -1, 0, 0, 100]);
}

#[test]
fn a_map_is_saved_once_at_the_end_of_a_mission() {
    let file = file("end.yaml");
    let mut saver = saver(&file);
    let mut judge = |state| {
        saver.set("verdict", Verdict { state, outcome: MissionOutcome::OTHER, reason: Text::new("") });
        assert_eq!(saver.tick(), Outcome::Ok);
        Path::new(&file).exists()
    };
    assert!(!judge(MissionState::RUNNING));
    assert!(judge(MissionState::SUCCEEDED));
    std::fs::remove_file(&file).unwrap();
    assert!(!judge(MissionState::SUCCEEDED));
}

#[test]
fn a_map_that_can_not_be_saved_degrades_the_saver() {
    let mut saver = saver("");
    saver.push("save_map", SaveMap { file: Text::new("nowhere/map.yaml") });
    assert_eq!(saver.tick(), Outcome::Degraded);
    saver.push("save_map", SaveMap { file: Text::new(&file("again.yaml")) });
    assert_eq!(saver.tick(), Outcome::Ok);
}
