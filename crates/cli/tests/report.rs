//! Files of a run, its last output, its rate, and the counts of a batch.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

use crate::common;

use std::process::Stdio;
use std::time::{Duration, Instant};

use common::{Running, exp1, folder, json, slate, text};
use roxmltree::Document;
use serde_json::Value;

/// A run that ends after so many seconds of its own time, whatever happens.
fn limit(seconds: u32) -> String {
    format!("modules.referee.params.time_limit={seconds}")
}

#[test]
fn the_trajectory_has_a_row_for_each_robot_and_moment() {
    let folder = folder("rows");
    exp1(&folder, &["--seed", "1", "--out", "here"]);
    let csv = std::fs::read_to_string(folder.join("here/trajectory.csv")).unwrap();
    let mut last = 0.0;
    let mut rows = [0, 0];
    for line in csv.lines().skip(1) {
        let cells: Vec<_> = line.splitn(7, ',').collect();
        let [time, x, y, theta] = [0, 2, 3, 4].map(|i| cells[i].parse::<f64>().unwrap());
        assert!(time >= last && x.abs() < 3.0 && y.abs() < 3.0 && theta.abs() < 7.0, "{line}");
        last = time;
        match cells[1] {
            "r1" => rows[0] += 1,
            "r2" => rows[1] += 1,
            other => panic!("no robot is called {other}"),
        }
        assert!(["none", "deliberative", "reactive"].contains(&cells[5]), "{line}");
    }
    assert_eq!(rows[0], rows[1], "both robots have as many rows");
    assert!(rows[0] > 100 && last > 5.0);
}

#[test]
fn trajectory_of_long_run_is_bounded() {
    let folder = folder("long");
    // A mission that does not end before its time is up.
    let never = "modules.referee.params.goal_tolerance=0.0";
    exp1(&folder, &["--seed", "1", "--out", "here", "--set", &limit(600), "--set", never]);
    let csv = std::fs::read_to_string(folder.join("here/trajectory.csv")).unwrap();
    let rows: Vec<_> = csv.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>()).collect();
    assert!((10_000..=20_000).contains(&rows.len()), "{}", rows.len());
    // Of the whole time, and of both robots at each moment but perhaps for the last.
    let times: Vec<f64> = rows.iter().map(|row| row[0].parse().unwrap()).collect();
    assert!(times[0] == 0.0 && *times.last().unwrap() > 599.9, "{:?}", times.last());
    assert!(rows.chunks(2).all(|both| both[0][0] == both[1][0]), "the robots have the same moments");
    assert!(times.windows(2).all(|two| (0.0..0.21).contains(&(two[1] - two[0]))), "no gap is left");
}

#[test]
fn the_pictures_are_well_formed_and_show_the_run() {
    let folder = folder("pictures");
    exp1(&folder, &["--seed", "1", "--out", "here"]);
    let read = |name: &str| std::fs::read_to_string(folder.join("here").join(name)).unwrap();
    for (name, words) in [
        ("trajectory.svg", ["exp1, seed 1", "goal", "box", "x [m]", "deliberative"]),
        ("timeline.svg", ["exp1, seed 1", "r2", "time [s]", "deliberative", "reactive"]),
        ("scene.svg", ["exp1, seed 1", "r1 (scripted)", "goal", "range sensors", "1 m"]),
    ] {
        let picture = read(name);
        let document = Document::parse(&picture).unwrap();
        assert!(document.root_element().has_tag_name("svg"), "{name}");
        let lines = document.descendants().filter(|node| node.has_tag_name("polyline")).count();
        assert!(lines > 2, "{name} shows the ways of the robots");
        let said: String = document.descendants().filter_map(|node| node.text()).collect();
        for word in words {
            assert!(said.contains(word), "{name} does not say {word}");
        }
    }
}

/// Takes out what only a document on stdout says: its form.
fn form(document: &mut Value) -> Value {
    document.as_object_mut().unwrap().remove("schema").unwrap()
}

#[test]
fn the_saved_summary_is_the_printed_one() {
    let folder = folder("saved");
    let (mut printed, code) = exp1(&folder, &["--seed", "2"]);
    assert_eq!(form(&mut printed), "slate.run/1");
    let saved = std::fs::read_to_string(folder.join("runs/exp1-2/summary.json")).unwrap();
    assert_eq!((serde_json::from_str::<Value>(&saved).unwrap(), code), (printed, Some(0)));
    let mut files: Vec<_> = std::fs::read_dir(folder.join("runs/exp1-2"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(
        files,
        [
            "animation.svg",
            "scene.json",
            "scene.svg",
            "summary.json",
            "timeline.svg",
            "trajectory.csv",
            "trajectory.svg"
        ]
    );
}

#[test]
fn json_is_printed_only_on_request() {
    let folder = folder("plain");
    let output = slate(&folder, &["run", "exp1", "--headless", "--set", &limit(1)]);
    let stdout = text(&output.stdout);
    assert!(!stdout.contains('{'), "{stdout}");
    assert!(stdout.contains("report: runs/exp1-0"), "{stdout}");
}

#[test]
fn live_lines_tell_what_robots_do_before_the_summary() {
    let folder = folder("live");
    let output = slate(&folder, &["run", "exp1", "--rate", "20", "--json"]);
    let stdout = text(&output.stdout);
    assert_eq!(json(&output)["outcome"], "goal_reached", "{output:?}");
    let (display, _) = stdout.split_once("goal reached").unwrap();
    for line in [
        "exp1, seed 0",
        "s  r2 reactive: AvoidObstacle",
        "s  r2 deliberative: GoToOrigin",
        "s  mission succeeded: ",
    ] {
        assert!(display.contains(line), "the display does not say {line}: {display}");
    }
    assert!(!stdout.contains('\u{1b}'), "output that is not a terminal has colors");
}

#[test]
fn a_later_run_replaces_the_report_of_an_earlier_one() {
    let folder = folder("again");
    let run = |seconds: u32| exp1(&folder, &["--out", "here", "--set", &limit(seconds)]).0;
    let rows = || std::fs::read_to_string(folder.join("here/trajectory.csv")).unwrap().lines().count();
    let (_, long) = (run(3), rows());
    let (mut last, short) = (run(1), rows());
    form(&mut last);
    assert!(short < long);
    let saved = std::fs::read_to_string(folder.join("here/summary.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&saved).unwrap(), last);
}

#[test]
fn run_without_arrival_times_out() {
    let (summary, code) = exp1(&folder("timed_out"), &["--set", &limit(1)]);
    assert_eq!((summary["outcome"].as_str(), code), (Some("timed_out"), Some(1)), "{summary}");
    assert!((1.0..1.1).contains(&summary["sim_time_s"].as_f64().unwrap()), "{summary}");
}

#[test]
fn run_that_drives_into_a_box_has_collided() {
    // The goal is behind the box, and nothing avoids it.
    let sets = [
        "world.layout=authors",
        "world.goal=[-1.2, 0.0]",
        "robots.r2.modules.knowledge.params.goal_x=-1.2",
        "robots.r2.modules.avoid_obstacle.enabled=false",
        "modules.referee.params.time_limit=10",
    ];
    let folder = folder("collided");
    let (summary, code) = exp1(&folder, &sets.map(|set| ["--set", set]).concat());
    assert_eq!((summary["outcome"].as_str(), code), (Some("collided"), Some(1)), "{summary}");
    let message = summary["message"].as_str().unwrap();
    assert!(message.starts_with("time is up, with ") && message.ends_with(" caused"), "{message}");
    let batch = slate(
        &folder,
        &[&["batch", "exp1", "--runs", "1"], &sets.map(|set| ["--set", set]).concat()[..]].concat(),
    );
    let text = text(&batch.stdout);
    assert!(text.contains("outcomes                1 collided"), "{text}");
    assert!(text.contains("failed seeds            1: collided"), "{text}");
}

/// How long a run of `seconds` takes at that rate.
fn takes(name: &str, seconds: u32, rate: &str) -> Duration {
    let start = Instant::now();
    let (summary, _) = exp1(&folder(name), &["--rate", rate, "--set", &limit(seconds)]);
    assert_eq!(summary["outcome"], "timed_out", "{summary}");
    start.elapsed()
}

#[test]
fn time_goes_as_fast_as_the_rate_says() {
    assert!(takes("realtime", 1, "realtime") >= Duration::from_secs(1));
    assert!(takes("factor", 4, "4") >= Duration::from_secs(1));
    assert!(takes("half", 1, "0.5") >= Duration::from_secs(2));
    assert!(takes("max", 4, "max") < Duration::from_secs(4));
}

#[test]
fn a_summary_names_the_conditions_of_its_figures() {
    let conditions = |name: &str, sets: &[&str]| {
        let mut arguments = vec!["run", "exp2", "--headless", "--json", "--out", "out"];
        arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
        let limit = limit(1);
        json(&slate(&folder(name), &[&arguments[..], &["--set", &limit]].concat()))["conditions"].clone()
    };
    let usual = conditions("usual", &[]);
    assert_eq!(
        (&usual["noise"], &usual["robot_sensor"]),
        (&"odometry only".into(), &"vrep".into()),
        "{usual}"
    );
    assert!(usual.get("controller").is_none() && usual["pace"] == "authors", "{usual}");
    let other = conditions("other", &["world.robot_sensor=real", "controller=rocs", "pace=robots"]);
    assert_eq!(other["noise"], "sightings and odometry");
    assert_eq!((&other["robot_sensor"], &other["pace"]), (&"real".into(), &"robots".into()), "{other}");
    assert_eq!(other["controller"], "rocs");
    assert_eq!(conditions("ranges", &["world.sonar=real"])["noise"], "ranges and odometry");
}

#[test]
fn a_report_names_each_variant_of_the_run_with_its_time() {
    let mut running = Running::new("report-variants");
    let run = ["run", "exp1", "--headless", "--set", "controller=rocs", "--out", "here", "--rate", "4"];
    let goal = "modules.referee.params.goal_tolerance=0.0";
    running.start("exp1", &[&run[..], &["--set", &limit(20), "--set", goal]].concat());
    running.done(&["config", "set", "controller=slate"]);
    running.finish();
    let summary = std::fs::read_to_string(running.folder().join("here/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let controller = summary["conditions"]["controller"].as_str().unwrap();
    let since =
        controller.strip_prefix("rocs, slate from ").and_then(|rest| rest.strip_suffix(" s")).unwrap();
    let since: f64 = since.parse().unwrap();
    assert!(since > 0.0 && since <= 20.0, "{controller}");
}

#[test]
fn batch_counts_failed_robots() {
    let folder = folder("failing");
    let arguments = ["batch", "exp1", "--runs", "3", "--seed", "7", "--json", "--set", &limit(1)];
    let output = slate(&folder, &arguments);
    let batch = json(&output);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert_eq!(batch["failed_seeds"], serde_json::json!([7, 8, 9]));
    assert_eq!((batch["success_rate"].as_f64(), batch["spl"].as_f64()), (Some(0.0), Some(0.0)));
    let [low, high] = [0, 1].map(|i| batch["success_interval"][i].as_f64().unwrap());
    assert!(low == 0.0 && (0.3..0.8).contains(&high), "{batch}");
    for name in ["sim_time_s", "path_length_m", "min_clearance_m", "route_switches", "reflexes"] {
        let [minimum, median, p95, maximum] =
            ["minimum", "median", "p95", "maximum"].map(|part| batch[name][part].as_f64().unwrap());
        assert!(minimum <= median && median <= p95 && p95 <= maximum, "{name}: {batch}");
    }
    assert!(!folder.join("runs").exists(), "a batch leaves no reports");
}

#[test]
fn a_batch_runs_what_a_run_with_its_seed_does() {
    let folder = folder("one");
    let (run, _) = exp1(&folder, &["--seed", "11"]);
    let batch = json(&slate(&folder, &["batch", "exp1", "--runs", "1", "--seed", "11", "--json"]));
    for name in ["sim_time_s", "path_length_m", "min_clearance_m", "route_switches", "reflexes"] {
        assert_eq!(batch[name]["median"].as_f64(), run[name].as_f64(), "{name}");
    }
}

#[test]
fn a_configuration_file_runs_from_any_folder_under_its_own_name() {
    let folder = folder("own");
    std::fs::create_dir(folder.join("elsewhere")).unwrap();
    let text = include_str!("../../../examples/exp1/exp1.toml");
    std::fs::write(folder.join("mine.toml"), text).unwrap();
    let output = slate(&folder.join("elsewhere"), &["run", "../mine.toml", "--headless", "--json"]);
    let (example, _) = exp1(&folder, &[]);
    let own = json(&output);
    assert_eq!((own["example"].as_str(), &own["digest"]), (Some("mine"), &example["digest"]), "{output:?}");
    assert!(folder.join("elsewhere/runs/mine-0/trajectory.svg").is_file());
}

#[test]
fn outcome_is_printed_without_writable_report() {
    let folder = folder("unwritten");
    // What stands in the way of the first file.
    std::fs::create_dir_all(folder.join("here/trajectory.csv.partial")).unwrap();
    let output = slate(&folder, &["run", "exp1", "--headless", "--seed", "1", "--out", "here"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(text(&output.stdout).starts_with("exp1, seed 1: goal reached after"), "{output:?}");
    assert!(text(&output.stderr).contains("trajectory.csv.partial"), "{output:?}");
}

#[test]
fn parallel_runs_use_folders_of_their_own_and_a_kill_frees_one() {
    let mut running = Running::new("report-folder");
    let endless = ["--rate", "1", "--set", "modules.referee.params.goal_tolerance=0.0"];
    let run = |more: &[&'static str]| [&["run", "exp1", "--headless"], more].concat();
    running.start("exp1", &[&run(&["--out", "here"])[..], &endless].concat());
    running.fails(2, &run(&["--out", "./here"]), &["another run is writing its report into ./here", "--out"]);
    running.kill();
    let report = running.folder().join("here/summary.json");
    assert!(!report.exists());
    running.call(&run(&["--out", "here"]));
    assert!(report.exists());
    // Without a named folder, the next one is taken.
    running.start("exp1", &[&run(&[])[..], &endless].concat());
    let output = running.call(&run(&[]));
    let said = text(&output.stderr);
    assert!(said.contains("into runs/exp1-0: this one uses runs/exp1-0-2\n"), "{said}");
    assert!(text(&output.stdout).contains("report: runs/exp1-0-2"), "{output:?}");
    assert!(running.folder().join("runs/exp1-0-2/summary.json").exists());
}

#[test]
fn killed_run_leaves_its_trajectory() {
    let running = Running::new("killed");
    let never = "modules.referee.params.goal_tolerance=0.0";
    let mut command =
        running.command(&["run", "exp1", "--headless", "--out", "here", "--rate", "20", "--set", never]);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let path = running.folder().join("here/trajectory.csv.partial");
    let rows = || std::fs::read_to_string(&path).unwrap_or_default().lines().count();
    common::wait_for("rows are written", || rows() > 400);
    child.kill().unwrap();
    child.wait().unwrap();
    let csv = std::fs::read_to_string(&path).unwrap();
    assert!(csv.ends_with('\n') && csv.lines().all(|line| line.split(',').count() >= 7), "{csv}");
    assert!(!running.folder().join("here/summary.json").exists());
    // The next run of the folder replaces it.
    let (_, code) = exp1(running.folder(), &["--out", "here"]);
    assert_eq!(code, Some(0));
    assert!(!path.exists() && running.folder().join("here/trajectory.csv").is_file());
}
