//! Benchmarks as files.

use std::fs;
use std::path::{Path, PathBuf};

use slate_evaluation::{Evaluation, planning};

const MAP: &str = "type octile\nheight 4\nwidth 5\nmap\n.....\n.@@@.\n.@T@.\n.....\n";
const SCENARIO: &str = "version 1\n\
    0\ttiny.map\t5\t4\t0\t0\t4\t3\t7\n\
    0\ttiny.map\t5\t4\t0\t0\t3\t0\t3\n";

fn folder(name: &str, map: &str, scenario: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("tiny.map"), map).unwrap();
    fs::write(folder.join("tiny.map.scen"), scenario).unwrap();
    folder
}

fn value(evaluation: &Evaluation, name: &str) -> f64 {
    evaluation.figures.iter().find(|figure| figure.name == name).unwrap().value
}

#[test]
fn lengths_are_compared_with_the_files() {
    let wrong = "A*: lengths that are not the file's";
    let [right] = &planning::evaluate(&folder("right", MAP, SCENARIO)).unwrap()[..] else { panic!() };
    assert_eq!((value(right, "problems"), value(right, wrong)), (2.0, 0.0));
    assert!(value(right, "Theta*: mean excess over the shortest path, %").abs() < 1e-9);
    let other = SCENARIO.replace("\t7\n", "\t6.41421\n");
    let [other] = &planning::evaluate(&folder("other", MAP, &other)).unwrap()[..] else { panic!() };
    assert_eq!(value(other, wrong), 1.0);
    let missed: Vec<&str> = other
        .figures
        .iter()
        .filter(|figure| !figure.is_reached())
        .map(|figure| figure.name.as_str())
        .collect();
    assert!(missed.contains(&wrong), "{missed:?}");
}

#[test]
fn errors_name_their_line() {
    let refused = |name: &str, map: &str, scenario: &str| {
        let folder = folder(name, map, scenario);
        let message = planning::evaluate(&folder).unwrap_err().to_string();
        message.replace(&format!("{}/", folder.display()), "")
    };
    assert_eq!(refused("row", &MAP.replace(".@T@.", ".@T@"), SCENARIO), "tiny.map:7: 4 cells, expected 5");
    assert_eq!(refused("rows", &MAP.replace(".@T@.\n", ""), SCENARIO), "tiny.map: 3 rows, expected 4");
    assert_eq!(
        refused("size", &MAP.replace("width 5", "width 90000"), SCENARIO),
        "tiny.map:3: `90000` is not a size: expected 1 to 4500 cells"
    );
    assert_eq!(
        refused("wall", MAP, &SCENARIO.replace("\t4\t3\t7", "\t1\t1\t7")),
        "tiny.map.scen:2: cell 1 1 is not free in the map"
    );
    let column = refused("column", MAP, &SCENARIO.replace("\t3\n", "\n"));
    assert!(column.starts_with("tiny.map.scen:3: expected nine columns"), "{column}");
    assert_eq!(refused("none", MAP, "version 1\n"), "tiny.map.scen: no problem in it");
    let empty = Path::new(env!("CARGO_TARGET_TMPDIR")).join("empty");
    fs::create_dir_all(&empty).unwrap();
    let nothing = planning::evaluate(&empty).unwrap_err().to_string();
    assert!(nothing.ends_with("no NAME.map with its NAME.map.scen, as MovingAI has them"), "{nothing}");
}
