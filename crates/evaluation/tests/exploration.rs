//! Buildings as files, and runs in them.

use std::fs;
use std::path::{Path, PathBuf};

use slate_evaluation::exploration::evaluate;
use slate_evaluation::{DataError, Evaluation};

/// Cells along each side, of half a meter.
const SIDE: usize = 50;

/// A folder with a building, whose cells are those of the function.
fn folder(name: &str, is_wall: impl Fn(usize, usize) -> bool) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(folder.join("maps")).unwrap();
    let cells = (0..SIDE * SIDE).map(|cell| if is_wall(cell % SIDE, cell / SIDE) { 0 } else { 254 });
    let image: Vec<u8> = format!("P5 {SIDE} {SIDE} 255\n").bytes().chain(cells).collect();
    fs::write(folder.join("maps/explorebench_small.pgm"), image).unwrap();
    folder
}

/// Three rooms side by side, with a door between each.
fn is_wall(column: usize, row: usize) -> bool {
    let is_edge = [column, row].iter().any(|at| *at == 0 || *at == SIDE - 1);
    is_edge || column == 16 && row != 5 || column == 33 && row != 44
}

fn value(evaluation: &Evaluation, name: &str) -> f64 {
    evaluation.figures.iter().find(|figure| figure.name == name).unwrap().value
}

#[test]
fn a_building_is_explored_from_every_start() {
    let folder = folder("explored", is_wall);
    let evaluations = evaluate(&folder, 3).unwrap();
    assert_eq!(evaluations[0].name, "explorebench_small");
    for name in ["nearest frontier", "next best view"] {
        assert_eq!(value(&evaluations[0], &format!("{name}: runs that end below 99 %")), 0.0);
        assert!(value(&evaluations[0], &format!("{name}: mean T99, s")) > 60.0);
    }
    // The same runs have the same figures.
    assert_eq!(evaluate(&folder, 3).unwrap(), evaluations);
}

#[test]
fn folders_without_a_building_are_refused() {
    let refused =
        |folder: &Path| evaluate(folder, 1).map_err(|error: DataError| error.to_string()).unwrap_err();
    assert!(refused(Path::new("nowhere")).starts_with("nowhere/maps: can't be read"));
    let full = refused(&folder("full", |_, _| true));
    assert!(full.contains("no free cell in which a robot fits"), "{full}");
}
