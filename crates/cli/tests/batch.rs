//! Batches: on all cores, with the same figures for any number of them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use common::{exp1, folder, json, slate, text};

/// Runs that end soon, without having reached anything.
const SHORT: &str = "modules.referee.params.time_limit=1";

#[test]
fn the_number_of_jobs_changes_no_byte() {
    let folder = folder("jobs");
    let printed = |jobs: &str| {
        let arguments = ["batch", "exp1", "--runs", "5", "--seed", "3", "--json", "--jobs", jobs];
        let output = slate(&folder, &arguments);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        text(&output.stdout)
    };
    let alone = printed("1");
    assert!(alone.contains("5 of 5 runs succeeded"), "{alone}");
    assert!(!alone.contains("interrupted") && !alone.contains("runs_asked"), "{alone}");
    for jobs in ["2", "16"] {
        assert_eq!(printed(jobs), alone, "{jobs} jobs");
    }
}

#[test]
fn a_busy_machine_is_no_hang_in_a_batch() {
    let folder = folder("busy");
    let text = include_str!("../../../examples/exp1/exp1.toml");
    // No machine makes a simulator as fast as that.
    let hasty = text.replacen("hang = \"1s\"", "hang = \"20us\"", 1);
    assert_ne!(hasty, text);
    std::fs::write(folder.join("hasty.toml"), hasty).unwrap();
    let run = slate(&folder, &["run", "hasty.toml", "--headless", "--set", SHORT]);
    assert_eq!(run.status.code(), Some(2), "{run:?}");
    let batch = |more: &[&str]| {
        let batch = ["batch", "hasty.toml", "--runs", "3", "--seed", "1", "--json"];
        slate(&folder, &[&batch[..], more].concat())
    };
    let raised = batch(&[]);
    assert_eq!(raised.status.code(), Some(0), "{raised:?}");
    // An explicit limit holds.
    let own = batch(&["--set", "loop.hang=20us"]);
    assert_ne!(own.status.code(), Some(0), "{own:?}");
}

/// EXP1 with a second judge, whose robot is R1.
fn with_two_judges() -> String {
    let text = include_str!("../../../examples/exp1/exp1.toml");
    let judge = "[modules.second_judge]\nkind = \"referee\"\nparams = { robot = \"r1\" }\n\n[links]\n\
                 \"second_judge/truth\" = \"simulator/r1/truth\"\n\
                 \"second_judge/clearance\" = \"simulator/r1/clearance\"\n\
                 \"second_judge/contacts\" = \"simulator/contacts\"\n";
    text.replacen("[links]\n", judge, 1).replace(
        "metrics = \"/referee/metrics\"",
        "metrics = [\"/referee/metrics\", \"/second_judge/metrics\"]",
    )
}

#[test]
fn further_judged_robots_have_figures_under_their_names() {
    let folder = folder("judges");
    std::fs::write(folder.join("two.toml"), with_two_judges()).unwrap();
    let output = slate(&folder, &["run", "two.toml", "--headless", "--json", "--seed", "1"]);
    let run = json(&output);
    let (alone, _) = exp1(&folder, &["--seed", "1"]);
    for name in ["outcome", "path_length_m", "min_clearance_m", "collisions"] {
        assert_eq!(run[name], alone[name], "those of the first judge: {output:?}");
    }
    let length = run["robots"]["r1"]["path_length"].as_f64().unwrap();
    assert!(length > 0.0 && run["units"]["path_length"] == "m", "{run}");
    assert!(text(&output.stdout).contains(&format!("r1: path length {length:.3} m")), "{output:?}");
    assert!(alone.get("robots").is_none() && alone.get("units").is_none(), "{alone}");

    let batch = json(&slate(&folder, &["batch", "two.toml", "--runs", "1", "--seed", "1", "--json"]));
    assert_eq!(batch["robots"]["r1"]["kilometres"].as_f64(), Some(length / 1000.0), "{batch}");
    assert_eq!(batch["robots"]["r1"]["figures"]["path_length"]["median"].as_f64(), Some(length));
    let bound = batch["collisions_caused_per_km_bound"].as_f64().unwrap();
    assert!((bound * batch["kilometres"].as_f64().unwrap() - 2.9957).abs() < 0.0001, "{batch}");
}

#[test]
fn a_judge_that_is_not_there_is_named() {
    let metrics = "report.metrics=[\"/referee/metrics\", \"/referee_r3/metrics\"]";
    let output = slate(&folder("no_judge"), &["batch", "exp1", "--runs", "2", "--set", metrics]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(text(&output.stderr).contains("referee_r3/metrics"), "{output:?}");
}

#[test]
fn unloadable_plugin_is_reported_once() {
    let arguments = ["batch", "exp1", "--runs", "50", "--jobs", "8", "--set", "world.layout=none"];
    let output = slate(&folder("refused_batch"), &arguments);
    let stderr = text(&output.stderr);
    assert_eq!((output.status.code(), text(&output.stdout).as_str()), (Some(2), ""), "{output:?}");
    assert_eq!(stderr.matches("unknown layout `none`").count(), 1, "{stderr}");
}

#[test]
fn wall_clock_run_is_no_batch() {
    let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/exp1/pioneer.toml");
    for mode in ["staged", "threaded"] {
        let output = slate(&folder("real_batch"), &["batch", robot, "--runs", "2", "--mode", mode]);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        for word in ["pioneer.toml", "wall clock", "slate run", "time.source"] {
            assert!(stderr.contains(word), "{word}: {stderr}");
        }
    }
}

#[test]
fn application_without_mission_is_no_batch() {
    let output = slate(&folder("open_batch"), &["batch", "mapping", "--runs", "2"]);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    for word in ["`mapping` has none", "[mission]", "slate run mapping"] {
        assert!(stderr.contains(word), "{word}: {stderr}");
    }
}

#[test]
fn remaining_lines_show_progress() {
    let output = slate(&folder("progress"), &["batch", "exp1", "--runs", "20", "--set", SHORT]);
    let stderr = text(&output.stderr);
    let lines: Vec<&str> = stderr.lines().collect();
    assert!(lines[0].starts_with("2 of 20 runs, 0 succeeded, 0 collisions caused, "), "{stderr}");
    assert!(lines.iter().all(|line| line.contains(" of 20 runs, ") && line.ends_with(" left")), "{stderr}");
    assert!((9..20).contains(&lines.len()), "one in ten, and those after a silence: {stderr}");
}

#[test]
fn interrupted_batch_prints_figures_of_finished_runs() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_slate"))
        .args(["batch", "exp1", "--runs", "300", "--seed", "10", "--json", "--set", SHORT])
        .current_dir(folder("interrupted"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    stderr.read_line(&mut line).unwrap();
    assert!(line.contains(" of 300 runs, "), "{line}");
    let done = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(done.success());
    let mut rest = String::new();
    stderr.read_to_string(&mut rest).unwrap();
    let output = child.wait_with_output().unwrap();
    let batch = json(&output);
    let runs = batch["runs"].as_u64().unwrap();
    assert!((1..300).contains(&runs), "{batch}");
    assert_eq!((&batch["interrupted"], &batch["runs_asked"]), (&true.into(), &300.into()), "{batch}");
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(rest.ends_with(&format!("interrupted: {runs} of 300 runs are done\n")), "{rest}");
    // Every run that is counted continued to its end.
    assert_eq!(batch["failed_seeds"].as_array().unwrap().len() as u64, runs, "{batch}");
    assert!(batch["sim_time_s"]["minimum"].as_f64().unwrap() >= 1.0, "{batch}");
}
