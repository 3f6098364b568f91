//! Guarantees of the command: exit codes, files, the same bytes again, and errors that say what to do.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::path::Path;
use std::process::Command;

use common::{folder, slate, text};
use serde_json::Value;

/// The summary of a headless run.
fn summary(folder: &Path, arguments: &[&str]) -> Value {
    let mut all = vec!["run", "exp1", "--headless", "--json"];
    all.extend(arguments);
    let output = slate(folder, &all);
    let stdout = text(&output.stdout);
    serde_json::from_str(stdout.lines().last().unwrap_or_default()).unwrap_or_else(|_| panic!("{output:?}"))
}

#[test]
fn a_run_reaches_its_goal_and_leaves_its_report() {
    let folder = folder("report");
    let output = slate(&folder, &["run", "exp1", "--headless", "--json", "--seed", "3"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let summary: Value = serde_json::from_str(text(&output.stdout).lines().last().unwrap()).unwrap();
    for key in [
        "example",
        "seed",
        "outcome",
        "sim_time_s",
        "wall_time_s",
        "path_length_m",
        "shortest_path_m",
        "collisions",
        "min_clearance_m",
        "route_switches",
        "reflexes",
        "ticks",
        "digest",
    ] {
        assert!(summary.get(key).is_some_and(|value| !value.is_null()), "{key} is missing in {summary}");
    }
    assert_eq!((summary["example"].as_str(), summary["seed"].as_u64()), (Some("exp1"), Some(3)));
    // From any directory, the report goes to runs/<name>-<seed>.
    let report = folder.join("runs/exp1-3");
    let csv = std::fs::read_to_string(report.join("trajectory.csv")).unwrap();
    assert_eq!(csv.lines().next(), Some("time_s,robot,x_m,y_m,theta_rad,route,action"));
    assert!(csv.contains(",deliberative,") && csv.contains(",reactive,"));
    for picture in ["animation.svg", "scene.svg", "trajectory.svg", "timeline.svg"] {
        assert!(std::fs::read_to_string(report.join(picture)).unwrap().contains("</svg>"), "{picture}");
    }
    let saved: Value =
        serde_json::from_str(&std::fs::read_to_string(report.join("summary.json")).unwrap()).unwrap();
    assert_eq!(saved["digest"], summary["digest"]);
}

#[test]
fn the_same_seed_gives_the_same_bytes_for_any_workers_and_rate() {
    let folder = folder("digest");
    let digest = |arguments: &[&str]| summary(&folder, arguments)["digest"].clone();
    let first = digest(&["--seed", "5"]);
    for other in [&["--workers", "1"][..], &["--workers", "2"], &["--rate", "40"], &["--rate", "max"]] {
        let arguments: Vec<_> = ["--seed", "5"].iter().chain(other).copied().collect();
        assert_eq!(digest(&arguments), first, "{other:?}");
    }
    assert_ne!(digest(&["--seed", "6"]), first);
}

#[test]
fn debug_and_release_builds_give_the_same_bytes() {
    // What the release build prints, as shown in the README; a change of behavior changes both.
    let readme = include_str!("../../../README.md");
    let digest = summary(&folder("build"), &["--seed", "0"])["digest"].as_str().unwrap().to_owned();
    assert!(readme.contains(&format!("digest          {digest}")), "this build gives {digest}");
}

#[test]
fn threads_reach_the_goal_too() {
    let summary = summary(&folder("threads"), &["--mode", "threaded", "--rate", "4"]);
    assert_eq!(summary["outcome"], "goal_reached", "{summary}");
}

#[test]
fn the_authors_scene_and_their_law_can_be_run() {
    let folder = folder("authors");
    for set in ["world.layout=\"authors\"", "controller=rocs-fixed"] {
        assert_eq!(summary(&folder, &["--set", set])["outcome"], "goal_reached", "{set}");
    }
}

#[test]
fn the_authors_scene_differs_by_seed() {
    let folder = folder("authors-seeds");
    let length = |seed: &str| {
        let sets = ["--set", "world.layout=authors", "--seed", seed];
        summary(&folder, &sets)["path_length_m"].as_f64().unwrap().to_bits()
    };
    let lengths: std::collections::BTreeSet<u64> = ["1", "2", "3"].map(length).into();
    assert_eq!(lengths.len(), 3, "R2 has another way under each seed");
    assert_eq!(length("1"), length("1"), "and the same under one");
}

#[test]
fn a_pace_goes_over_what_a_controller_brings() {
    let run = |sets: &[&str]| {
        let sets: Vec<_> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let summary = summary(&folder("pace"), &sets);
        let speed = summary["conditions"]["speed"].as_str().unwrap().to_owned();
        (speed, summary["sim_time_s"].as_f64().unwrap())
    };
    let (authors, own) = (run(&["pace=authors"]), run(&[]));
    assert!(authors.1 > own.1, "{authors:?} and {own:?} s");
    let (slow, fast) = (run(&["controller=rocs-fixed"]), run(&["controller=rocs-fixed", "pace=robots"]));
    assert!(slow.1 > fast.1, "{slow:?} and {fast:?} s");
    // The controller is as fast as its authors' wheels, unless a pace says otherwise.
    assert_eq!(slow.0, authors.0);
    assert_ne!(fast.0, slow.0);
}

#[test]
fn run_without_arrival_exits_with_1() {
    let output = slate(
        &folder("late"),
        &["run", "exp1", "--headless", "--set", "modules.referee.params.time_limit=1"],
    );
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(text(&output.stdout).contains("timed out"), "{output:?}");
}

#[test]
fn the_end_of_a_run_names_sensors_that_stopped_or_never_began() {
    let folder = folder("stopped-sensor");
    let fault = "world.faults.ring={ robot = \"r2\", sensor = \"sonar\", kind = \"silent\", from = 1.0, until = 100.0 }";
    let limit = "modules.referee.params.time_limit=4";
    let output =
        slate(&folder, &["run", "exp1", "--headless", "--set", fault, "--set", limit, "--out", "here"]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let said = text(&output.stdout);
    assert!(said.contains("r2: the sensor `sonar` stopped at 0.98 s"), "{said}");
    let warned = text(&output.stderr);
    assert!(warned.contains("r2/range_monitor: the sensor `sonar` has stopped"), "{warned}");
    let summary = std::fs::read_to_string(folder.join("here/summary.json")).unwrap();
    assert!(summary.contains("the sensor `sonar` stopped at 0.98 s"), "{summary}");
    let late = fault.replace("silent", "late").replace("100.0", "2.0, delay = 0.5");
    let output = slate(&folder, &["run", "exp1", "--headless", "--set", &late, "--set", limit]);
    let warned = text(&output.stderr);
    assert_eq!(
        warned.matches("r2/knowledge: the sensor `sonar` is late: its newest value is").count(),
        1,
        "{warned}"
    );
    let never = "modules.\"r2/sonar\".enabled=false";
    let output = slate(&folder, &["run", "exp1", "--headless", "--set", never, "--set", limit]);
    let said = text(&output.stdout);
    assert!(said.contains("r2: the sensor `sonar` never measured"), "{said}");
    let lost = "modules.\"r2/position\".enabled=false";
    let output = slate(&folder, &["run", "exp1", "--headless", "--set", lost, "--set", limit]);
    let said = text(&output.stdout);
    assert!(said.contains("time is up; r2: never a pose"), "{said}");
}

#[test]
fn the_end_of_a_failed_run_says_why_the_robot_stood() {
    let folder = folder("why");
    let end = |example: &str, limit: u32, set: &str| {
        let limit = format!("modules.referee.params.time_limit={limit}");
        let output = slate(&folder, &["run", example, "--headless", "--set", &limit, "--set", set]);
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        text(&output.stdout).lines().next().unwrap_or_default().to_owned()
    };
    let fault = |sensor: &str, kind: &str| {
        format!(
            "world.faults.f={{ robot = \"r2\", sensor = {sensor:?}, kind = {kind:?}, from = 1.0, until = 99.0 }}"
        )
    };
    let off = |module: &str| format!("robots.r2.modules.{module}.enabled=false");
    for (set, why) in [
        (
            fault("sonar", "invalid"),
            "r2/range_monitor at 1.00 s: the measurements of the sensor `sonar` are dropped: one is NaN",
        ),
        (fault("sonar", "late"), "r2: the sensor `sonar` is late since 1.20 s: its newest value came at "),
        (fault("position", "silent"), "r2: no pose (the sensor `position` stopped at 0.98 s)"),
        (
            fault("orientation", "invalid"),
            "r2: no pose (r2/orientation_monitor is degraded); r2/orientation_monitor at 1.00 s: the measurements",
        ),
        (fault("odometry", "silent"), "r2: the sensor `odometry` stopped at 0.98 s"),
        (
            fault("odometry", "frozen"),
            "r2: the sensor `odometry` stopped at 0.98 s; r2/execute at 1.20 s: GoToOrigin failed, the plan is given \
             up; r2/odometry_monitor at 1.20 s: the sensor `odometry` is frozen",
        ),
        (
            fault("position", "frozen"),
            "r2: no pose (r2/position_monitor is degraded); r2/position_monitor at",
        ),
        (off("odometry"), "r2: the sensor `odometry` never measured, as `r2/odometry` is switched off"),
        (
            off("position"),
            "r2: never a pose (the sensor `position` never measured, as `r2/position` is switched off)",
        ),
        (off("sonar"), "r2: the sensor `sonar` never measured, as `r2/sonar` is switched off"),
        (off("execute"), "r2: `r2/execute` is switched off"),
        (off("planner"), "r2: `r2/planner` is switched off"),
        (off("motors"), "r2: `r2/motors` is switched off"),
        ("robots.r2.links.\"planner/position\"=false".into(), "r2: its Plan `r2/planner` has sent no action"),
    ] {
        let said = end("exp1", 4, &set);
        assert!(said.contains(&format!("time is up; {why}")), "{set}: {said}");
    }
    let said = end("exp1", 14, &fault("sonar", "silent"));
    let stands = said.split("; ").find(|cause| cause.starts_with("r2 stood at (")).unwrap_or_default();
    assert!(
        stands.contains(" m since ") && stands.contains(", on the reactive route (AvoidObstacle)"),
        "{said}"
    );
    let said = end("exp1", 4, "agent.seed=0");
    assert!(said.ends_with("time is up"), "a robot that drives: {said}");
    let said = end("exp3", 11, "robots.r3.modules.locate_robot.params.robot=nobody");
    assert!(said.contains("the robot `nobody` was never detected"), "{said}");
    let said = end("exp2", 4, "robots.r3.modules.robot_sensor.enabled=false");
    let rule = "params.sensor_rules.1: the robot has no Sensor `robot_sensor` that works: it is missing or switched off";
    assert!(said.contains(rule), "{said}");
}

#[test]
fn late_sonars_do_not_let_the_robot_start_and_stop() {
    let fault =
        "world.faults.f={ robot = \"r2\", sensor = \"sonar\", kind = \"late\", from = 1.0, until = 99.0 }";
    let limit = "modules.referee.params.time_limit=20";
    let summary = summary(&folder("late-sonars"), &["--set", fault, "--set", limit]);
    let switches = summary["route_switches"].as_u64().unwrap();
    assert!(switches <= 3, "{summary}");
}

#[test]
fn undetected_robot_does_not_arrive() {
    let folder = folder("unseen");
    let limit = "modules.referee.params.time_limit=2";
    let summary = summary(&folder, &["--set", "modules.simulator.enabled=false", "--set", limit]);
    assert_ne!(summary["outcome"], "goal_reached", "{summary}");
}

#[test]
fn whole_numbers_are_numbers_in_a_world() {
    assert_eq!(summary(&folder("whole"), &["--set", "world.goal=[0, 0]"])["outcome"], "goal_reached");
}

#[test]
fn a_batch_reports_rates_intervals_and_spreads() {
    let output = slate(&folder("batch"), &["batch", "exp1", "--runs", "4", "--seed", "1", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let batch: Value = serde_json::from_str(text(&output.stdout).lines().last().unwrap()).unwrap();
    assert_eq!((batch["runs"].as_u64(), batch["success_rate"].as_f64()), (Some(4), Some(1.0)), "{batch}");
    for key in [
        "success_interval",
        "collisions",
        "collisions_caused",
        "collisions_caused_per_km",
        "spl",
        "failed_seeds",
    ] {
        assert!(batch.get(key).is_some(), "{key} is missing in {batch}");
    }
    assert!(batch["sim_time_s"]["median"].as_f64() <= batch["sim_time_s"]["p95"].as_f64());
}

#[test]
fn a_batch_keeps_its_statistics_in_a_folder() {
    let folder = folder("batch-out");
    let output = slate(&folder, &["batch", "exp1", "--runs", "2", "--seed", "1", "--json", "--out", "here"]);
    let read = |name: &str| std::fs::read_to_string(folder.join("here").join(name)).unwrap();
    assert_eq!(read("batch.txt") + "\n" + &read("batch.json"), text(&output.stdout));
    let lines = read("batch.jsonl");
    let summaries = lines.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    assert_eq!(summaries.map(|summary| summary["seed"].as_u64()).collect::<Vec<_>>(), [Some(1), Some(2)]);
    // Another batch keeps those that were there.
    let before = read("batch.json");
    let output = slate(&folder, &["batch", "exp1", "--runs", "1", "--seed", "1", "--out", "here"]);
    assert!(text(&output.stderr).contains("the statistics that were there before: here/batch-1.json"));
    assert_eq!(read("batch-1.json"), before);
    assert!(read("batch.json") != before && read("batch-1.txt").contains("2 of 2 runs"));
}

/// Runs with exit code 2 say these words on stderr and leave nothing behind.
fn refused(name: &str, arguments: &[&str], words: &[&str]) {
    let folder = folder(name);
    let output = slate(&folder, arguments);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {output:?}");
    for word in words {
        assert!(stderr.contains(word), "{arguments:?} does not say `{word}`: {stderr}");
    }
    assert!(!folder.join("runs").exists(), "{arguments:?} left a report");
}

#[test]
fn errors_have_place_and_remedy() {
    refused("example", &["run", "exp11"], &["`exp11`", "did you mean `exp1`"]);
    refused("option", &["run", "exp1", "--fast"], &["--fast"]);
    refused("rate", &["run", "exp1", "--rate", "0"], &["realtime", "max"]);
    refused("key", &["run", "exp1", "--set", "loop.perod=1"], &["--set", "period"]);
    refused(
        "plugin",
        &["run", "exp1", "--set", "modules.simulator.kind=simulater"],
        &["simulater", "simulator"],
    );
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/exp1/exp1.toml");
    for example in ["exp1", file.to_str().unwrap()] {
        let unknown = ["best", "rocs, rocs-fixed, slate"];
        refused("controller", &["run", example, "--set", "controller=best"], &unknown);
    }
    refused(
        "pace",
        &["run", "exp1", "--set", "pace=hasty"],
        &["`pace` chooses `hasty`", "authors, default, robots"],
    );
    refused("layout", &["run", "exp1", "--set", "world.layout=none"], &["none", "authors", "random"]);
    refused(
        "range",
        &["run", "exp1", "--set", "robots.r2.modules.planner.params.max_linear_velocity=99"],
        &["max_linear_velocity", "99", "0 to 3"],
    );
    refused("max", &["run", "exp1", "--mode", "threaded", "--rate", "max"], &["threaded", "realtime"]);
}

#[test]
fn file_with_error_is_shown_with_line() {
    let folder = folder("file");
    let file = folder.join("robot.toml");
    std::fs::write(&file, "[modules.referee]\n\n[links]\n\"referee/truth\" = \"simulator/truth\"\n").unwrap();
    let output = slate(&folder, &["run", "robot.toml", "--headless"]);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(stderr.contains("robot.toml"), "{stderr}");
}

#[test]
fn a_report_that_can_not_be_written_is_named() {
    let folder = folder("unwritable");
    std::fs::write(folder.join("taken"), "a file").unwrap();
    let report = ["run", "exp1", "--headless", "--out", "taken/report"];
    let statistics = ["batch", "exp1", "--runs", "1", "--out", "taken"];
    for (arguments, path) in [(&report[..], "taken/report"), (&statistics[..], "taken")] {
        let output = slate(&folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        let said = text(&output.stderr);
        assert!(
            said.contains(&format!("{path} can't be used as a folder"))
                && said.contains("name another folder"),
            "{said}"
        );
    }
}

#[test]
fn partial_reader_does_no_harm() {
    let folder = folder("head");
    let command = format!("{} run exp1 --headless --json | head -1", env!("CARGO_BIN_EXE_slate"));
    let output = Command::new("sh").args(["-c", &command]).current_dir(&folder).output().unwrap();
    assert!(!text(&output.stderr).contains("panicked"), "{output:?}");
}

#[test]
fn plan_failing_in_every_cycle_is_reported_once() {
    // After its first pose, Execute has no fresh one any more.
    let blind = [
        "robots.r2.links.\"execute/robot\"={ from = \"knowledge/robot\", every = 100, stale = \"20ms\" }",
        "robots.r2.links.\"execute/reflexes\".\"avoid_obstacle/reflex\"=false",
        "modules.referee.params.time_limit=3.5",
    ];
    let mut arguments = vec!["run", "exp1", "--headless"];
    arguments.extend(blind.iter().flat_map(|set| ["--set", set]));
    let output = slate(&folder("blind"), &arguments);
    let log = text(&output.stderr);
    assert_eq!(log.matches("GoToOrigin failed, the plan is given up").count(), 1, "{log}");
}

#[test]
fn exit_code_is_the_same_without_anywhere_to_write() {
    let folder = folder("nowhere-to-write");
    for arguments in
        [&["stop", "--agent", "nobody"][..], &["run", "nothing"], &["check", "nothing"], &["list"]]
    {
        let call = || {
            let mut command = Command::new(env!("CARGO_BIN_EXE_slate"));
            command.args(arguments).current_dir(&folder).env("XDG_RUNTIME_DIR", &folder);
            command
        };
        let expected = call().output().unwrap().status.code();
        let full = || std::fs::File::options().write(true).open("/dev/full").unwrap();
        let code = call().stdout(full()).stderr(full()).status().unwrap().code();
        assert_eq!(code, expected, "{arguments:?}");
        assert!(!matches!(code, Some(0 | 101) | None), "{arguments:?}: {code:?}");
    }
}

#[test]
fn help_without_anywhere_to_write_fails() {
    for arguments in [&["--help"][..], &["--version"], &["run", "--help"], &["completions", "bash"]] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_slate")).args(arguments).stdout(full).output().unwrap();
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert_eq!(stderr.matches("stdout can't be written").count(), 1, "{arguments:?}: {stderr}");
    }
}

#[test]
fn too_little_address_space_gives_advice() {
    let folder = folder("address-space");
    for kilobytes in ["900000", "150000"] {
        let mut limited = Command::new("sh");
        limited.args([
            "-c",
            &format!("ulimit -v {kilobytes}; exec \"$@\""),
            "sh",
            env!("CARGO_BIN_EXE_slate"),
        ]);
        let output = limited.args(["run", "exp1", "--headless"]).current_dir(&folder).output().unwrap();
        let said = text(&output.stderr);
        assert!(
            said.contains("address space") && said.contains("ulimit -v unlimited"),
            "{kilobytes}: {output:?}"
        );
    }
}
