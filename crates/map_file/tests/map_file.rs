//! Maps as files.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use slate_grid::{Geometry, OccupancyMap};
use slate_interfaces::Pose2;
use slate_map_file::{MapFileOptions, MapMode, read_map, write_map};

const YAML: &str = "image: map.pgm\nresolution: 0.05\norigin: [-1.0, -2.5, 0.5]\nnegate: 0\n\
    occupied_thresh: 0.65\nfree_thresh: 0.196\n";

fn folder(name: &str) -> PathBuf {
    // All crates of a workspace have that folder, and runs before this one have left files.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("map_file").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Reads files with that text and image.
fn read(name: &str, yaml: &str, image: &[u8]) -> Result<OccupancyMap, String> {
    let folder = folder(name);
    fs::write(folder.join("map.yaml"), yaml).unwrap();
    fs::write(folder.join("map.pgm"), image).unwrap();
    read_map(&folder.join("map.yaml"))
        .map_err(|error| error.to_string().replace(&format!("{}/", folder.display()), ""))
}

fn refused(name: &str, yaml: &str, image: &[u8]) -> String {
    read(name, yaml, image).unwrap_err()
}

#[test]
fn first_row_of_the_image_is_the_top_of_the_map() {
    let map = read("rows", YAML, b"P5 # by hand\n3 2\n255\n\x00\xfe\xcd\xfe\xfe\x00").unwrap();
    assert_eq!(map.cells, [0, 0, 100, 100, 0, -1]);
    let Geometry { resolution, width, height, .. } = map.geometry;
    assert_eq!((resolution, width, height), (0.05, 3, 2));
    assert_eq!(map.geometry.origin(), Pose2 { x: -1.0, y: -2.5, theta: 0.5 });
}

#[test]
fn yaml_of_other_writers_is_read() {
    let yaml = "---\n# a map\nimage: \"map.pgm\"   # beside it\nextra: 1\nresolution: 0.05\norigin:\n- -1\n- -2.5\n\
        - 0.5\nnegate: false\noccupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n";
    let image = b"P5 1 1 255 \x00";
    assert_eq!(read("block", yaml, image).unwrap(), read("flow", YAML, image).unwrap());
    let split = YAML.replace("[-1.0, -2.5, 0.5]", "[-1.0,\n  -2.5, 0.5]");
    assert_eq!(read("split", &split, image).unwrap(), read("flow", YAML, image).unwrap());
}

#[test]
fn modes_and_negate_are_those_of_map_server() {
    let image = b"P5 5 1 255 \x00\x32\x64\x96\xff";
    let cells = |name: &str, yaml: &str| read(name, yaml, image).unwrap().cells;
    assert_eq!(cells("trinary", YAML), [100, 100, -1, -1, 0]);
    assert_eq!(cells("negate", &YAML.replace("negate: 0", "negate: 1")), [0, -1, -1, -1, 100]);
    assert_eq!(cells("scale", &format!("{YAML}mode: scale\n")), [100, 100, 91, 48, 0]);
    assert_eq!(cells("raw", &format!("{YAML}mode: raw\n")), [0, 50, 100, -1, -1]);
}

#[test]
fn errors_have_file_and_line() {
    let image = b"P5 1 1 255 \x00";
    let with = |from: &str, to: &str| refused("wrong", &YAML.replace(from, to), image);
    assert_eq!(
        with("0.05", "-1"),
        "map.yaml:2: invalid `resolution` `-1`: expected a length above 0 m per cell"
    );
    assert_eq!(
        with("[-1.0, -2.5, 0.5]", "[1, 2]"),
        "map.yaml:3: invalid `origin` `[1, 2]`: expected `[x, y, yaw]` of the lower left corner, m and rad"
    );
    assert_eq!(with("negate: 0", "negate: 2"), "map.yaml:4: invalid `negate` `2`: expected 0 or 1");
    assert_eq!(
        with("0.65", "1.5"),
        "map.yaml:5: invalid `occupied_thresh` `1.5`: expected a number from 0 to 1"
    );
    assert_eq!(
        with("0.196", "0.7"),
        "map.yaml:6: invalid `free_thresh` `0.7`: expected a number below occupied_thresh"
    );
    assert_eq!(with("negate: 0\n", ""), "map.yaml: no `negate`: expected 0 or 1");
    assert_eq!(with("negate: 0", "negate 0"), "map.yaml:4: expected `key: value`");
    assert_eq!(with("negate: 0", "image: b.pgm"), "map.yaml:4: `image` is there twice");
    let mode = refused("wrong", &format!("{YAML}mode: dual\n"), image);
    assert_eq!(mode, "map.yaml:7: invalid `mode` `dual`: expected `trinary`, `scale` or `raw`");
    assert_eq!(
        with("map.pgm", "map.bmp"),
        "map.yaml:1: image `map.bmp` can't be read: No such file or directory (os error 2)"
    );
    let other = with("map.pgm", "map.yaml");
    assert_eq!(other, "map.yaml:1: image `map.yaml`: expected a .pgm or .png file");
}

#[test]
fn damaged_images_are_refused() {
    let image = |bytes: &[u8]| refused("damaged", YAML, bytes);
    assert_eq!(image(b"P2 1 1 255 0"), "map.pgm: no binary PGM: expected `P5` at the start");
    assert_eq!(image(b"P5 1 x 255 0"), "map.pgm: invalid height `x` in the header: expected 1 to 4294967295");
    assert_eq!(
        image(b"P5 1 1 65535 00"),
        "map.pgm: invalid brightest value `65535` in the header: expected 1 to 255"
    );
    assert_eq!(image(b"P5 2 2 255 abc"), "map.pgm: ends before its last pixel: expected 2 x 2 bytes");
    let folder = folder("damaged-png");
    fs::write(folder.join("map.png"), b"no png").unwrap();
    fs::write(folder.join("map.yaml"), YAML.replace("map.pgm", "map.png")).unwrap();
    let message = read_map(&folder.join("map.yaml")).unwrap_err().to_string();
    assert!(message.contains("map.png: no PNG: "), "{message}");
}

#[test]
fn map_too_large_is_refused_with_its_memory() {
    let message = refused("large", YAML, b"P5 20000 20000 255 ");
    assert_eq!(
        message,
        "map.pgm: a map of 20000 x 20000 cells, which takes 800 MB: expected 1 to 67108864 cells"
    );
}

#[test]
fn cells_that_do_not_match_are_not_written() {
    let geometry = Geometry::new([0.0, 0.0], [1.0, 1.0], 0.5, 100).unwrap();
    let map = OccupancyMap { geometry, cells: vec![0; 3] };
    let message = write_map(&folder("few").join("map.yaml"), &map, &MapFileOptions::default());
    assert!(message.unwrap_err().to_string().ends_with("map.yaml: 3 cells: expected 4"));
}

#[test]
fn map_is_written_under_a_name_of_yaml_alone() {
    let folder = folder("names");
    let geometry = Geometry::new([0.0, 0.0], [1.5, 0.5], 0.5, 100).unwrap();
    let map = OccupancyMap { geometry, cells: vec![-1, 0, 100] };
    for name in ["map.pgm", "map.png", "map"] {
        let file = folder.join(name);
        let message = write_map(&file, &map, &MapFileOptions::default()).unwrap_err().to_string();
        let expected = "expected a .yaml or .yml file, whose image is written beside it";
        assert_eq!(message, format!("{}: {expected}", file.display()));
        assert!(!file.exists());
    }
    for name in
        ["map.yml", "map.v2.YAML", "floor #2: \"it's\" \\ here\t.yaml", "'a'.yaml", "- b.yaml", "x: y.yaml"]
    {
        let file = folder.join(name);
        write_map(&file, &map, &MapFileOptions::default()).unwrap();
        assert_eq!(read_map(&file).unwrap(), map, "{name}");
    }
    let is_left = |entry: fs::DirEntry| entry.path().extension().is_some_and(|extension| extension == "tmp");
    assert!(!fs::read_dir(&folder).unwrap().any(|entry| is_left(entry.unwrap())));
}

#[test]
fn quoted_names_of_images_are_read() {
    let image = b"P5 1 1 255 \x00";
    let with = |name: &str| read("quoted", &YAML.replace("map.pgm", name), image);
    for name in ["'map.pgm' # it's one", "\"map.pgm\" # \"it\"", "\"m\\x61p.pgm\"", "\"./map.pgm\""] {
        assert_eq!(with(name).unwrap().cells, [100], "{name}");
    }
    let missing = with("'it''s #1.pgm'").unwrap_err();
    assert!(missing.starts_with("map.yaml:1: image `it's #1.pgm` can't be read"), "{missing}");
    for name in ["\"map.pgm", "'map.pgm' x", "\"\\q\"", "\""] {
        assert_eq!(
            with(name).unwrap_err(),
            "map.yaml:1: invalid quoted text: expected matching quotes",
            "{name}"
        );
    }
}

#[test]
fn unknown_cells_stay_unknown_with_any_threshold() {
    // Nav2's threshold, by which shade 205 is free.
    let options = MapFileOptions { free_thresh: 0.25, ..MapFileOptions::default() };
    let geometry = Geometry::new([0.0, 0.0], [1.5, 0.5], 0.5, 100).unwrap();
    let map = OccupancyMap { geometry, cells: vec![-1, 0, 100] };
    let file = folder("threshold").join("map.yaml");
    write_map(&file, &map, &options).unwrap();
    assert_eq!(read_map(&file).unwrap(), map);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn written_data_is_read_back(
        x in -90.0..90.0_f64, y in -90.0..90.0_f64, theta in -3.0..3.0_f64, width in 1..12_usize, height in 1..9_usize,
        mode in prop::sample::select(vec![MapMode::Trinary, MapMode::Scale, MapMode::Raw]), negate: bool,
        cells in prop::collection::vec(-1..=100_i8, 12 * 9), exact: bool,
    ) {
        let geometry = Geometry::with_origin(Pose2 { x, y, theta }, 0.05, [width, height], 1_000).unwrap();
        // A trinary map has no percents.
        let three = |cell: i8| match cell {
            _ if mode != MapMode::Trinary => cell,
            ..30 => 0,
            30..60 => 100,
            60.. => -1,
        };
        let known = |cell: i8| if exact && cell < 0 { 0 } else { cell };
        let cells = cells[..width * height].iter().map(|cell| known(three(*cell))).collect();
        let map = OccupancyMap { geometry, cells };
        let file = folder("written").join("map.yaml");
        write_map(&file, &map, &MapFileOptions { mode, negate, ..MapFileOptions::default() }).unwrap();
        prop_assert_eq!(read_map(&file).unwrap(), map);
    }

    #[test]
    fn no_file_makes_it_panic(
        yaml in "(image: map.pgm\n|resolution: [0-9.]{0,3}\n|- [a-z0-9]{1,3}\n|[ -~]{0,9}\n){0,8}",
        image in prop::collection::vec(any::<u8>(), 0..60),
    ) {
        let _ = read("hostile", &yaml, &image);
        let _ = read("hostile", YAML, &[b"P5 ".as_slice(), &image].concat());
    }
}
