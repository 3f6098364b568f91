//! Maps of ROS: `map.yaml` and its image.

use std::path::PathBuf;
use std::sync::OnceLock;

use slate_map_file::{MOST_MAP_CELLS, MapFileOptions, read_map, write_map};

use crate::input::Input;
use crate::memory::within;

/// Reads a script: the text of a `map.yaml`, and its image.
/// The image is `map.pgm` or `map.png`.
pub fn run(script: &[u8]) {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = crate::folder().join("fuzz-map");
        std::fs::create_dir_all(&folder).expect("there is room");
        folder
    });
    let mut script = Input(script);
    std::fs::write(folder.join("map.yaml"), script.counted()).expect("there is room");
    let image = script.counted();
    for name in ["map.pgm", "map.png"] {
        std::fs::write(folder.join(name), image).expect("there is room");
    }
    // A PNG packs a thousand to one.
    let most = (1 << 20) + 8 * 1024 * image.len().min(MOST_MAP_CELLS);
    let Ok(map) = within(most, || read_map(&folder.join("map.yaml"))) else { return };
    assert_eq!(map.cells.len(), map.geometry.cells(), "cells are missing");
    let file = folder.join("again.yaml");
    write_map(&file, &map, &MapFileOptions::default()).expect("there is room");
    let again = read_map(&file).expect("it was written here");
    assert_eq!(again.geometry, map.geometry, "another geometry came out");
    // Percents become one of three values.
    let is_trinary = map.cells.iter().all(|cell| matches!(cell, -1 | 0 | 100));
    assert!(!is_trinary || again.cells == map.cells, "other cells came out");
}
