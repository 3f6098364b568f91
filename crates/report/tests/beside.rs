//! Logs as RoCS's authors publish them, the use of the routes, and both runs side by side.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::fs;
use std::path::{Path, PathBuf};

use common::{sample, scene, summary};
use roxmltree::Document;
use slate_report::{Report, RocsLog, Route, RouteUse, Sample, Trajectory};
use slate_report::{page, page::Known};

const DELIBERATIVE: Option<Route> = Some(Route::Deliberative);
const REACTIVE: Option<Route> = Some(Route::Reactive);

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("beside-{name}"));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

/// A log of a robot that drives east, reflects for four lines in the middle and for one near the end, and of which
/// two lines are torn.
const LOG: &str = "X, Y, T, Action
0.00, 1.0, 0.1, GoToPosition
0.01, 1.0, 0.1, GoAhead
0.02, 1.0, 0.1, GoAhead
-4.02847e-23, 3.10712e+32, 0.6, TurnToAngle
0.03, 1.0, 0.1, Reaction Braitenberg
0.04, 1.0, 0.1, Reaction Braitenberg
0.05, 1.0, 0.1, Reaction Braitenberg
0.06, 1.0, 0.1, Reaction Braitenberg
0.07, 1.0, 0.1, GoAhead
0.08, 1.0, 0.1, GoAhead
0, 0, 2.866, TurnToAngle
0.09, 1.0, 0.1, GoAhead
0.10, 1.0, 0.1, Turn
0.11, 1.0, 0.1, Reaction Braitenberg
0.12, 1.0, 0.1, GoAhead
0.13, 1.0, 0.1, GoAhead
0.14, 1.0, 0.1, GoAhead
0.15, 1.0, 0.1, GoAhead
";

fn log(name: &str) -> RocsLog {
    let path = folder(name).join("p3dx.txt");
    fs::write(&path, LOG).unwrap();
    RocsLog::read(&path).unwrap()
}

#[test]
fn published_log_is_read_without_its_torn_lines() {
    let log = log("read");
    assert_eq!((log.robot.as_str(), log.left_out, log.trajectory.samples.len()), ("p3dx", 2, 16));
    let [first, .., last] = &log.trajectory.samples[..] else { unreachable!() };
    assert_eq!((first.x, first.y, first.theta, first.time), (0.0, 1.0, 0.1, 0));
    assert_eq!((first.route, first.action.as_str()), (DELIBERATIVE, "GoToPosition"));
    // The torn lines took their time.
    assert_eq!((last.x, last.time), (0.15, 17 * 50_000_000));
    assert_eq!(log.trajectory.samples[3].route, REACTIVE);
}

#[test]
fn log_ends_when_its_simulator_was_reset() {
    let path = folder("reset").join("p3dx.txt");
    let again: String =
        (0..20).map(|line| format!("{}, -1.0, 0.1, GoAhead\n", f64::from(line) * 0.01)).collect();
    fs::write(&path, format!("{LOG}{again}")).unwrap();
    let log = RocsLog::read(&path).unwrap();
    assert_eq!((log.left_out, log.trajectory.samples.len()), (22, 16));
    // The start is torn.
    fs::write(&path, LOG.replacen("0.00, 1.0", "9.00, 1.0", 1)).unwrap();
    let log = RocsLog::read(&path).unwrap();
    assert_eq!((log.left_out, log.trajectory.samples[0].x), (3, 0.01));
}

#[test]
fn wrong_logs_are_refused_with_the_line() {
    let folder = folder("wrong");
    let refused = |text: &str, words: &[&str]| {
        let path = folder.join("log.txt");
        fs::write(&path, text).unwrap();
        let error = RocsLog::read(&path).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{words:?} is not all in: {error}");
    };
    refused("x,y\n", &["log.txt`, line 1", "expected the header `X, Y, T, Action`", "found `x,y`"]);
    refused("X, Y, T, Action\n1, 2, 3, Go\n1, 2, Go\n", &["line 3", "GoAhead`, found `1, 2, Go`"]);
    refused("X, Y, T, Action\n1, 2, 3, \n", &["line 2", "an action"]);
    refused("X, Y, T, Action\n", &["no line after its header"]);
    refused("", &["no line after its header"]);
    let error = RocsLog::read(&folder.join("nowhere.txt")).unwrap_err().to_string();
    assert!(error.contains("nowhere.txt` can't be read"), "{error}");
}

#[test]
fn use_of_routes_counts_changes_that_hold_and_distance() {
    let log = log("use");
    let used = RouteUse::of(&log.trajectory.of("p3dx"));
    assert_eq!((used.changes, used.lasting_changes), (4, 2), "one line of a reflex is too short");
    assert!((used.distance - 0.15).abs() < 1e-9 && (used.duration - 0.85).abs() < 1e-9, "{used:?}");
    assert!((used.reactive_samples - 5.0 / 16.0).abs() < 1e-9, "{used:?}");
    assert!((used.reactive_distance - 0.05 / 0.15).abs() < 1e-9, "{used:?}");
    assert_eq!(RouteUse::of(&[]), RouteUse::default());
    // A pause on one route is no change.
    let routes = [DELIBERATIVE, None, DELIBERATIVE, REACTIVE, None, REACTIVE, None, DELIBERATIVE];
    let samples: Vec<Sample> = routes
        .iter()
        .zip(0_u32..)
        .map(|(route, step)| sample(u64::from(step) * 200_000_000, "R2", f64::from(step), 0.0, *route, ""))
        .collect();
    let used = RouteUse::of(&samples.iter().collect::<Vec<_>>());
    assert_eq!((used.changes, used.lasting_changes), (2, 1), "the last route has no time to hold");
}

/// The folder that a run leaves.
fn run(name: &str) -> PathBuf {
    let folder = folder(name).join("run");
    let way = |step: u32| {
        let route = if (4..8).contains(&step) { REACTIVE } else { DELIBERATIVE };
        let action = if route == REACTIVE { "AvoidObstacle" } else { "GoToOrigin" };
        sample(u64::from(step) * 100_000_000, "R2", f64::from(step) * 0.1, 1.0, route, action)
    };
    let scripted = sample(0, "R1", 0.0, -1.0, None, "");
    let trajectory = Trajectory { samples: [scripted].into_iter().chain((0..12).map(way)).collect() };
    Report { summary: &summary(1), scene: &scene(), trajectory: &trajectory }.write(&folder).unwrap();
    folder
}

#[test]
fn page_shows_published_run_beside_the_run() {
    let folder = run("page");
    let page = page::write_beside(&folder, &Known::default(), &[log("page-log")], &folder).unwrap();
    let names: Vec<_> = page.files.iter().map(|file| file.file_name().unwrap().to_string_lossy()).collect();
    assert!(names.iter().any(|name| name == "beside.svg") && names.iter().any(|name| name == "beside.csv"));
    let table = fs::read_to_string(folder.join("beside.csv")).unwrap();
    let rows: Vec<&str> = table.lines().collect();
    assert_eq!(
        rows[1..],
        ["R2 of this run,1.1,1.10,2,2,33.3,36.4", "p3dx,0.8,0.15,4,2,31.2,33.3"],
        "scripted robots have no routes: {table}"
    );
    let picture = fs::read_to_string(folder.join("beside.svg")).unwrap();
    let document = Document::parse(&picture).unwrap();
    let pictures: Vec<_> =
        document.root_element().children().filter(|node| node.has_tag_name("svg")).collect();
    let [ours, theirs] = pictures[..] else { panic!("two pictures side by side: {picture}") };
    let number = |name: &str| theirs.attribute(name).unwrap().parse::<i32>().unwrap();
    let width: i32 = ours.attribute("width").unwrap().parse().unwrap();
    assert_eq!(number("x"), width, "the second begins where the first ends");
    let said =
        |node: roxmltree::Node| -> String { node.descendants().filter_map(|node| node.text()).collect() };
    for word in ["AvoidObstacle begins", "R1 (scripted)", "box", "goal"] {
        assert!(said(ours).contains(word), "{word}");
    }
    for word in ["Reaction Braitenberg begins", "GoAhead begins", "p3dx", "2 left out", "box", "goal"] {
        assert!(said(theirs).contains(word), "{word}");
    }
    // A page without logs has none of that.
    let alone = page::write(&folder, &Known::default(), &folder.join("alone")).unwrap();
    assert!(alone.files.iter().all(|file| !file.ends_with("beside.svg")));
}
