//! Worlds of the BARN challenge as files, and runs in them.

use std::fs;
use std::path::{Path, PathBuf};

use slate_evaluation::Evaluation;
use slate_evaluation::barn::read_folder;
use slate_evaluation::local_planning::{LocalPlannerKind, RunEnd, evaluate, run};

fn six_worlds() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

fn value(evaluation: &Evaluation, name: &str) -> f64 {
    evaluation.figures.iter().find(|figure| figure.name == name).unwrap().value
}

#[test]
fn mppi_reaches_the_goal_in_six_worlds() {
    let found = evaluate(&six_worlds(), LocalPlannerKind::Mppi, 1).unwrap();
    assert_eq!(value(&found, "worlds"), 6.0);
    assert!(value(&found, "success") >= 5.0 / 6.0, "{found:?}");
    assert!(value(&found, "score, at most 0.5") > 0.38, "{found:?}");
}

#[test]
fn the_same_world_gives_the_same_run() {
    let worlds = read_folder(&six_worlds()).unwrap();
    let first = run(&worlds[0], LocalPlannerKind::Dwa, 1).unwrap();
    assert_eq!(run(&worlds[0], LocalPlannerKind::Dwa, 1).unwrap(), first);
    assert!(first.end == RunEnd::Success && first.time > 9.0 / 0.5, "{first:?}");
}

#[test]
fn an_invalid_world_is_named_with_its_line() {
    let refused = |name: &str, cylinders: &str, lengths: &str| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("cylinders.csv"), cylinders).unwrap();
        fs::write(folder.join("path_lengths.json"), lengths).unwrap();
        let message = read_folder(&folder).unwrap_err().to_string();
        message.replace(&format!("{}/", folder.display()), "")
    };
    let lengths = r#"{"0": 12.5}"#;
    assert_eq!(
        refused("barn_columns", "world,x,y\n0,1.0\n", lengths),
        "cylinders.csv:2: expected three columns: world, x, y"
    );
    assert_eq!(
        refused("barn_length", "world,x,y\n0,1.0,2.0\n7,1.0,2.0\n", lengths),
        "cylinders.csv:3: world 7 has no length in path_lengths.json"
    );
    assert_eq!(refused("barn_empty", "world,x,y\n", lengths), "cylinders.csv: no cylinder in it");
    assert!(refused("barn_json", "world,x,y\n", "{").starts_with("path_lengths.json: "));
}
