//! A configuration that can't be run is refused with exit code 2: the message has the place and the mend, and
//! nothing is left behind.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use common::{folder, slate, text};

/// A run is refused with these words on stderr.
fn refused(name: &str, arguments: &[&str], words: &[&str]) {
    let folder = folder(name);
    check(&folder, arguments, words);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0, "{arguments:?} left something behind");
}

fn check(folder: &std::path::Path, arguments: &[&str], words: &[&str]) {
    let output = slate(folder, arguments);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {output:?}");
    for word in words {
        assert!(stderr.contains(word), "{arguments:?} does not say `{word}`: {stderr}");
    }
    assert!(!stderr.contains("panicked"), "{stderr}");
    assert_eq!(text(&output.stdout), "", "{arguments:?} printed a result");
}

/// A run of a file is refused: the message has the file, the line and these words.
fn mistaken(name: &str, configuration: &str, line: u32, words: &[&str]) {
    let folder = folder(name);
    std::fs::write(folder.join("robot.toml"), configuration).unwrap();
    let place = format!("robot.toml:{line}:");
    check(&folder, &["run", "robot.toml", "--headless"], &[&[place.as_str()], words].concat());
    assert!(!folder.join("runs").exists(), "{name} left a report");
}

#[test]
fn arguments_that_are_wrong_are_named() {
    refused("no_verb", &[], &["Usage"]);
    refused("no_name", &["run"], &["<NAME>"]);
    refused("verb", &["runn", "exp1"], &["runn", "run"]);
    // Before a verb it is said which option was meant, also before a stop, whose words are its reason.
    let leading = ["unexpected option `--unknown`", "--agent NAME", "`slate stop --help`"];
    refused("leading", &["--unknown", "stop"], &leading);
    refused("leading_value", &["--unknown=3", "stop", "it", "smells"], &leading);
    refused(
        "leading_near",
        &["--agnt", "r2", "stop"],
        &["unexpected option `--agnt`", "did you mean `--agent`?"],
    );
    refused(
        "leading_verb",
        &["--jsn", "stop"],
        &["unexpected option `--jsn`", "did you mean `slate stop --json`?"],
    );
    refused("leading_agent", &["--agent", "r2", "--colour", "list"], &["`--colour`", "mean `--color`?"]);
    refused("leading_alone", &["-x"], &["unexpected option `-x`", "--version"]);
    refused("mode", &["run", "exp1", "--mode", "stage"], &["staged", "threaded"]);
    refused("workers", &["run", "exp1", "--workers", "99"], &["99", "64"]);
    refused("rate_nan", &["run", "exp1", "--rate", "nan"], &["nan", "realtime"]);
    refused("rate_infinite", &["run", "exp1", "--rate", "inf"], &["inf", "realtime"]);
    refused("no_runs", &["batch", "exp1", "--runs", "0"], &["--runs", "0"]);
    refused("batch_example", &["batch", "exp9"], &["exp9", "exp1"]);
    refused("batch_seed", &["batch", "exp1", "--seed", "one"], &["one", "--seed"]);
    // A negative number behind an option is its value, and no option.
    refused(
        "negative_seed",
        &["run", "exp1", "--seed", "-1"],
        &["'-1' for '--seed", "a whole number from 0 to"],
    );
    refused(
        "negative_rate",
        &["watch", "/x", "--max-hz", "-1"],
        &["'-1' for '--max-hz", "a positive number"],
    );
    refused("negative_speed", &["teleop", "--speed", "-0.5"], &["'-0.5' for '--speed", "a positive number"]);
    refused("least_rate", &["stat", "/x", "--min", "abc"], &["expected a rate in Hz", "found `abc`"]);
    refused("negative_runs", &["batch", "exp1", "--runs", "-3"], &["'-3' for '--runs"]);
}

#[test]
fn a_judge_of_a_robot_that_is_not_there_is_refused() {
    for judge in ["referee", "pursuit"] {
        let robot = format!("modules.{judge}.params.robot=r9");
        refused(
            judge,
            &["run", "exp3", "--headless", "--set", &robot],
            &["params.robot: unknown robot `r9`", "expected r1"],
        );
    }
}

#[test]
fn seeds_that_no_configuration_can_hold_are_refused_at_once() {
    refused("seed", &["run", "exp1", "--seed", "9223372036854775808"], &["--seed", "9223372036854775807"]);
    let arguments = ["batch", "exp1", "--runs", "2", "--seed", "9223372036854775807"];
    refused("seeds", &arguments, &["seed", "9223372036854775807"]);
}

#[test]
fn settings_that_are_wrong_are_shown() {
    let set = |name: &str, setting: &str, words: &[&str]| {
        refused(name, &["run", "exp1", "--headless", "--set", setting], &[&["--set"], words].concat());
    };
    set("equals", "nonsense", &["no `=`", "path=value"]);
    set("report", "report.bogus=1", &["unknown key `bogus`", "speed"]);
    set("report_robot", "report.robots.r2.poze='/x'", &["unknown key `poze`", "pose"]);
    set("path", "robots.r2.modules.planer.params.speed=1", &["planer"]);
    set("parameter", "robots.r2.modules.planner.params.speed=1", &["speed", "max_linear_velocity"]);
    set("former", "robots.r2.modules.planner.params.careful_speed=1", &["careful_linear_velocity"]);
    set("former_referee", "modules.referee.params.tolerance=1", &["goal_tolerance"]);
    set(
        "type",
        "robots.r2.modules.planner.params.max_linear_velocity=fast",
        &["max_linear_velocity", "fast"],
    );
    set("nan", "modules.referee.params.time_limit=nan", &["time_limit"]);
    set("duration", "loop.period=0", &["period", "20ms"]);
    set("seed_text", "agent.seed=x", &["seed", "whole number"]);
    set("link", "robots.r2.links.\"planner/goal\"=knowledge/gaol", &["gaol", "did you mean goal"]);
    set("report", "report.robots.r2.pose=/nothing", &["/nothing"]);
    set("speed", "report.speed=/r2/planner/params/sped", &["/r2/planner/params/sped"]);
}

#[test]
fn files_that_can_not_be_read_are_named() {
    refused("missing", &["run", "nowhere.toml"], &["nowhere.toml", "exp1"]);
    let folder = folder("unreadable");
    std::fs::create_dir(folder.join("folder.toml")).unwrap();
    check(&folder, &["run", "folder.toml"], &["folder.toml"]);
    std::fs::write(folder.join("picture.toml"), [0xff, 0xfe, 0x00]).unwrap();
    check(&folder, &["run", "picture.toml"], &["picture.toml"]);
    assert!(!folder.join("runs").exists());
}

#[test]
fn errors_in_file_have_file_and_line() {
    mistaken("syntax", "[modules.simulator]\nparams = {\n", 2, &[]);
    mistaken("table", "[agent]\nname = \"a\"\n[lops]\nperiod = \"20ms\"\n", 3, &["lops", "loop"]);
    mistaken("plugin", "[modules.a]\nkind = \"simulater\"\n", 2, &["simulater", "simulator"]);
    mistaken("unlinked", "[modules.referee]\n[links]\n\"referee/truht\" = \"a/b\"\n", 3, &["truht", "truth"]);
    let exp1 = include_str!("../../../examples/exp1/exp1.toml");
    let line = |text: &str, part: &str| text.lines().position(|line| line.contains(part)).unwrap() as u32 + 1;
    let change = |name: &str, from: &str, to: &str, words: &[&str]| {
        assert!(exp1.contains(from), "{from}");
        let text = exp1.replacen(from, to, 1);
        mistaken(name, &text, line(&text, to.lines().last().unwrap()), words);
    };
    change("layout", "layout = \"random\"", "layout = \"authros\"", &["did you mean `authors`?"]);
    change("model", "r2 = { model = \"pioneer_", "r2 = { model = \"pioner_", &["mean `pioneer_p3dx`?"]);
    change("reversed", "start = [-2.0, 2.0,", "start = [2.0, -2.0,", &["the least x, 2, is above"]);
    let truth = "\"referee/truth\" = \"simulator/r2/truth\"";
    let with = |link: &str| format!("{truth}\n{link}");
    let wrong = with("\"r2/range_monitor/sonar\" = \"r2/position/value\"");
    change("interface", truth, &wrong, &["SonarScan", "Position"]);
    let wrong = with("\"r2/planner/range\" = \"r2/range_monitor/percept\"");
    change("role", truth, &wrong, &["planner/range"]);
    change(
        "property",
        "\"referee/truth\" = \"simulator/r2/truth\"",
        "\"referee/truth\" = \"simulator/r3/truth\"",
        &["simulator/r3/truth"],
    );
    change(
        "twice",
        "planner = { kind = \"go_to_origin_planner\" }",
        "planner = { kind = \"go_to_origin_planner\" }\nsecond = { kind = \"go_to_origin_planner\" }",
        &["second"],
    );
    let time_to_live = "time_to_live = \"100ms\"";
    let limits = format!("{time_to_live}\nlimits = {{ left = [12.3, -12.3] }}");
    change("limits", time_to_live, &limits, &["left"]);
}

#[test]
fn errors_in_the_world_are_named() {
    let world = |name: &str, setting: &str, words: &[&str]| {
        refused(name, &["run", "exp1", "--headless", "--set", setting], words);
    };
    world("robot", "world.robots.r2.model=pionier", &["world.robots.r2.model: ", "pionier", "pioneer_p3dx"]);
    world("arena", "world.arena=nowhere", &["world.arena: ", "nowhere", "rocs_arena"]);
    world("sonar", "world.sonar=lidar", &["pioneer_p3dx", "lidar", "vrep"]);
    world("step", "loop.period=15ms", &["period", "physics step"]);
}

#[test]
fn a_report_goes_nowhere_else_than_where_it_should() {
    let folder = folder("taken_report");
    std::fs::write(folder.join("runs"), "a file").unwrap();
    check(&folder, &["run", "exp1", "--headless"], &["runs/exp1-0"]);
    check(&folder, &["run", "exp1", "--headless", "--out", "/dev/null/report"], &["/dev/null/report"]);
    assert_eq!(std::fs::read_to_string(folder.join("runs")).unwrap(), "a file");
}
