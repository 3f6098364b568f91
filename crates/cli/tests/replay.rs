//! Recordings that are played, controlled from another shell, and given to single modules.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use std::path::{Path, PathBuf};

use common::{Running, built_plugin, cargo, exp1, folder, json, slate, text, wait_for};

/// A recording of EXP1 in a folder.
fn recorded(folder: &Path) -> PathBuf {
    let (summary, _) = exp1(folder, &["--seed", "1", "--set", "record.enabled=true", "--out", "here"]);
    assert!(summary["ticks"].as_u64().unwrap() > 100, "{summary}");
    folder.join("here/run.mcap")
}

/// What the command prints when it ends with that code.
fn printed(folder: &Path, code: i32, arguments: &[&str]) -> String {
    let output = slate(folder, arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {output:?}");
    text(&output.stdout) + &text(&output.stderr)
}

#[test]
fn a_playback_is_controlled_from_another_shell() {
    let mut running = Running::new("replay");
    recorded(running.folder());
    running.start("exp1", &["replay", "here/run.mcap", "--pause"]);
    let status = running.done(&["replay", "status"]);
    assert!(
        status.contains("0.000 s (of 0.000 s to ") && status.contains("in real time, paused"),
        "{status}"
    );
    running.done(&["replay", "step", "2"]);
    let read = |url: &str| {
        let output = running.call(&["get", url, "--json"]);
        json(&output)
    };
    let value = read("/simulator/r2/truth/x");
    assert_eq!((value["sequence"].as_u64(), value["time"].as_u64()), (Some(2), Some(20_000_000)));
    // What others find of an agent, they find of a recorded one.
    assert!(running.done(&["list", "/simulator/r2/*"]).contains("/simulator/r2/sonar"));
    let status = running.done(&["replay", "seek", "1.5"]);
    assert!(status.contains(": 1.500 s"), "{status}");
    assert_eq!(read("/simulator/r2/truth")["sequence"], 76);
    running.done(&["replay", "loop", "1", "1.2"]);
    running.done(&["replay", "rate", "max"]);
    running.done(&["replay", "resume"]);
    let status = |field: &str| json(&running.call(&["replay", "status", "--json"]))[field].clone();
    let values = status("values").as_u64().unwrap();
    wait_for("it goes in circles", || status("values").as_u64().unwrap() > values + 2000);
    assert!((1_000_000_000..=1_200_000_000).contains(&status("time").as_u64().unwrap()));
    running.fails(5, &["replay", "seek", "1000"], &["after the end of the recording", "slate replay status"]);
    running.done(&["replay", "pause"]);
    assert_eq!(status("is_paused"), true);
    running.done(&["replay", "loop"]);
    running.done(&["replay", "resume"]);
    let output = running.finish();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(text(&output.stdout).contains(" cycles, up to "), "{output:?}");
    running.fails(3, &["replay", "status"], &["no agent is running"]);
}

#[test]
fn an_agent_that_plays_nothing_has_nothing_to_control() {
    let mut running = Running::new("replay-none");
    std::fs::write(
        running.folder().join("robot.toml"),
        format!(
            "[agent]\nname = \"robot\"\n[time]\nsource = \"simulator\"\n[modules.simulator]\n{}",
            common::WORLD
        ),
    )
    .unwrap();
    running.start("robot", &["run", "robot.toml", "--headless", "--rate", "1"]);
    running.fails(5, &["replay", "pause"], &["plays no recording", "slate replay FILE"]);
}

#[test]
fn recomputed_modules_repeat_the_recording_or_show_differences() {
    let folder = folder("replay-recompute");
    recorded(&folder);
    let replay = ["replay", "here/run.mcap", "--rate", "max", "--recompute"];
    let with = |more: &[&'static str]| [&replay[..], more].concat();
    let said = printed(&folder, 0, &with(&["r2/knowledge,r2/pass_position,referee"]));
    assert!(said.contains("/referee/metrics") && said.contains("identical"), "{said}");
    // The whole loop from the sensors to the wheels, with the simulator from the file.
    let whole = "r2/planner,r2/execute,r2/avoid_obstacle,r2/avoid_wall";
    let said = printed(&folder, 0, &with(&[whole]));
    assert!(said.contains("/r2/wheels/command") && !said.contains("not as it was"), "{said}");
    // So are the messages that they send to each other.
    let plans = said.lines().find(|line| line.starts_with("/r2/execute/plan ")).unwrap();
    assert!(plans.ends_with(" the same") && !said.contains("nothing of"), "{said}");
    let slower = [whole, "--set", "modules.\"r2/planner\".params.careful_linear_velocity=0.1"];
    let said = printed(&folder, 1, &with(&slower));
    assert!(
        said.lines().any(|line| line.starts_with("/r2/execute/plan ") && line.contains("different")),
        "{said}"
    );
    let sets =
        ["referee", "--set", "modules.referee.params.goal_tolerance=0.5", "--set", "record.enabled=true"];
    let said = printed(&folder, 1, &with(&sets));
    assert!(said.contains("first difference at ") && said.contains("recomputed.mcap"), "{said}");
    let diff = printed(&folder, 1, &["bag", "diff", "here/run.mcap", "recomputed.mcap"]);
    assert!(diff.contains("/referee/verdict"), "{diff}");
    // It is no run that its configuration makes again.
    let verified = printed(&folder, 2, &["replay", "--verify", "recomputed.mcap"]);
    assert!(verified.contains("not covered") && verified.contains("a playback of"), "{verified}");
    // Alone it gets the messages that others sent to it; with some of those it would get theirs twice.
    let said = printed(&folder, 0, &with(&["r2/execute"]));
    assert!(said.contains("/r2/execute/status") && said.contains("identical"), "{said}");
    let said = printed(&folder, 2, &with(&["r2/execute,r2/avoid_wall"]));
    assert!(said.contains("r2/avoid_wall, which run, and of r2/avoid_obstacle"), "{said}");
    let said = printed(&folder, 2, &with(&["simulator"]));
    assert!(said.contains("sets the time"), "{said}");
    let said = printed(&folder, 2, &with(&["r2/plannr"]));
    assert!(said.contains("is `r2/planner` or `r2/sonar` meant?"), "{said}");
}

#[test]
fn a_module_is_tried_on_a_recording() {
    let folder = folder("try");
    recorded(&folder);
    let said = printed(&folder, 0, &["try", "r2/pass_position", "--bag", "here/run.mcap"]);
    for words in [" ticks, p50 ", ", max ", "no fault", "/r2/pass_position/change", "identical"] {
        assert!(said.contains(words), "{said}");
    }
    let sets = [
        "try",
        "pass_position",
        "--bag",
        "here/run.mcap",
        "--set",
        "modules.\"r2/pass_position\".params.min_displacement=0.3",
    ];
    assert!(printed(&folder, 1, &sets).contains("first difference"));
    let link = [
        "try",
        "pass_position",
        "--bag",
        "here/run.mcap",
        "--link",
        "position=/simulator/r1/position",
        "--json",
    ];
    let output = slate(&folder, &link);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let tried = json(&output);
    assert_eq!((&tried["is_recorded"], &tried["panics"]), (&false.into(), &0.into()));
    assert!(tried["values"]["/pass_position/change"]["x"].is_f64(), "{tried}");
    assert!(tried["timed"]["p99"].as_u64().unwrap() >= tried["timed"]["p50"].as_u64().unwrap(), "{tried}");
    let said = printed(&folder, 2, &["try", "pass_positoin", "--bag", "here/run.mcap"]);
    assert!(said.contains("did you mean pass_position"), "{said}");
    let said =
        printed(&folder, 2, &["try", "pass_position", "--bag", "here/run.mcap", "--link", "positoin=/a/b"]);
    assert!(said.contains("positoin"), "{said}");
}

#[test]
fn a_module_is_tried_on_the_last_seconds_with_their_changes() {
    let mut running = Running::new("try-flight");
    let unlinked = r#"robots.r2.links."planner/goal"=false"#;
    let sets = ["--set", "modules.referee.params.goal_tolerance=0.0", "--set", unlinked];
    running.start("exp1", &[&["run", "exp1", "--headless", "--rate", "1"][..], &sets].concat());
    let cycles = |running: &Running| running.read("exp1", "/loop/state/cycles").as_u64().unwrap_or(0);
    wait_for("it goes on", || cycles(&running) >= 25);
    running.done(&["config", "set", "robots.r2.modules.planner.params.careful_linear_velocity=0.2"]);
    running.done(&["link", "r2/planner/goal", "r2/knowledge/goal"]);
    let changed = cycles(&running);
    wait_for("it goes on", || cycles(&running) >= changed + 25);
    running.done(&["record", "snapshot", "last.mcap"]);
    let said = printed(running.folder(), 0, &["try", "r2/planner", "--bag", "last.mcap"]);
    assert!(said.contains("identical") && said.contains("/r2/execute/plan"), "{said}");
}

#[test]
fn messages_of_a_module_are_compared_beside_other_senders() {
    let folder = folder("try-messages");
    recorded(&folder);
    let reflexes = |said: &str| -> String {
        let line = said.lines().find(|line| line.starts_with("/r2/execute/reflexes "));
        line.unwrap_or_else(|| panic!("{said}")).into()
    };
    let tried = ["try", "r2/avoid_obstacle", "--bag", "here/run.mcap"];
    let said = printed(&folder, 0, &tried);
    assert!(reflexes(&said).ends_with(" the same") && said.ends_with("identical\n"), "{said}");
    let slower = ["--set", "modules.\"r2/avoid_obstacle\".inputs.rank={ rank = 5 }"];
    let said = printed(&folder, 1, &[&tried[..], &slower].concat());
    assert!(reflexes(&said).contains("different") && said.contains("first difference at "), "{said}");
    // One that sent nothing sends nothing.
    let said = printed(&folder, 0, &["try", "r2/avoid_wall", "--bag", "here/run.mcap"]);
    assert!(said.contains("identical\nr2/avoid_wall wrote nothing in either run\n"), "{said}");
}

#[test]
fn sent_messages_are_compared_without_a_running_receiver() {
    let folder = folder("try-sent");
    recorded(&folder);
    let plans = |said: &str| -> String {
        said.lines()
            .find(|line| line.starts_with("/r2/execute/plan "))
            .unwrap_or_else(|| panic!("{said}"))
            .into()
    };
    let said = printed(&folder, 0, &["try", "r2/planner", "--bag", "here/run.mcap"]);
    assert!(plans(&said).ends_with(" the same") && said.contains("\nidentical\n"), "{said}");
    assert!(!said.contains("nothing of") && !said.contains("not compared"), "{said}");
    let slower = "modules.\"r2/planner\".params.careful_linear_velocity=0.1";
    let said = printed(&folder, 1, &["try", "r2/planner", "--bag", "here/run.mcap", "--set", slower]);
    assert!(plans(&said).contains("different"), "{said}");
    let first = said.lines().find(|line| line.starts_with("first difference at ")).unwrap();
    assert!(first.contains(" s: /r2/execute/plan/") && first.contains(", replayed "), "{said}");
    // The same holds for several senders to one mailbox.
    let replay = ["replay", "here/run.mcap", "--rate", "max", "--recompute"];
    let said = printed(&folder, 0, &[&replay[..], &["r2/avoid_wall,r2/avoid_obstacle"]].concat());
    assert!(said.contains("\n/r2/execute/reflexes") || said.starts_with("/r2/execute/reflexes"), "{said}");
    assert!(said.contains("identical") && !said.contains("not compared"), "{said}");
}

/// Modules on threads of their own answer each other many times in what is one cycle of a playback.
#[test]
fn messages_of_threads_are_named_and_not_compared() {
    let folder = folder("try-threads");
    let limit = "modules.referee.params.time_limit=2";
    let run = ["run", "exp1", "--headless", "--mode", "threaded", "--rate", "realtime", "--set", limit];
    slate(&folder, &[&run[..], &["--set", "record.enabled=true", "--out", "here"]].concat());
    let said = printed(&folder, 2, &["try", "r2/planner", "--bag", "here/run.mcap"]);
    assert!(said.contains("not compared: messages of /r2/planner/plan to /r2/execute/plan\n"), "{said}");
    assert!(!said.contains("difference") && !said.contains("times before that"), "{said}");
    // Its ticks there are not those here, so that another value is no verdict on it.
    let said = printed(&folder, 2, &["try", "r2/execute", "--bag", "here/run.mcap"]);
    assert!(
        said.contains("first difference at ") && said.contains("the values that a tick saw are not recorded"),
        "{said}"
    );
}

#[test]
fn later_start_of_module_is_reported_as_restart() {
    let folder = folder("replay-later");
    recorded(&folder);
    let later = ["replay", "here/run.mcap", "--rate", "max", "--start", "1.5", "--recompute"];
    let said = printed(&folder, 0, &[&later[..], &["r2/knowledge"]].concat());
    assert!(said.contains("\nidentical, from fresh state at 1.500 s\n"), "{said}");
    // What remembers where it was cannot know it.
    let said = printed(&folder, 2, &[&later[..], &["r2/pass_position"]].concat());
    let words = "the modules began from fresh state at 1.500 s: their recorded state is unknown";
    assert!(said.contains("first difference at ") && said.contains(words), "{said}");
    let tried =
        slate(&folder, &["try", "r2/knowledge", "--bag", "here/run.mcap", "--start", "1.5", "--json"]);
    assert_eq!(json(&tried)["fresh_from"], 1_500_000_000_u64, "{tried:?}");
}

#[test]
fn a_rate_is_a_positive_factor() {
    let folder = folder("replay-rate");
    for rate in ["-1", "0", "nan", "inf", "fast"] {
        for arguments in [
            &["replay", "run.mcap", "--rate", rate][..],
            &["replay", "rate", rate],
            &["run", "exp1", "--headless", "--rate", rate],
        ] {
            let said = printed(&folder, 2, arguments);
            assert!(said.contains("expected `realtime`, `max` or a positive factor such as 5"), "{said}");
        }
    }
}

#[test]
fn one_is_counted_as_one() {
    let folder = folder("replay-one");
    recorded(&folder);
    let one = ["--rate", "max", "--start", "0", "--end", "0", "--select", "/simulator/r2/truth"];
    let said = printed(&folder, 0, &[&["replay", "here/run.mcap"][..], &one].concat());
    assert!(said.contains("1 value in 1 cycle, up to"), "{said}");
}

#[test]
fn a_module_is_tried_with_the_code_of_a_library() {
    let folder = folder("try-library");
    assert!(slate(&folder, &["plugin", "new", "lane-keeper"]).status.success());
    let project = folder.join("lane-keeper");
    cargo(&project, "build");
    let built = built_plugin("liblane_keeper.so");
    // As the configuration of the project has it.
    let (first, place) = (folder.join("first.so"), project.join("target/debug/liblane_keeper.so"));
    std::fs::create_dir_all(place.parent().unwrap()).unwrap();
    std::fs::copy(&built, &first).unwrap();
    std::fs::copy(&built, &place).unwrap();
    let run = ["run", "lane-keeper/lane-keeper.toml", "--headless", "--out", "here"];
    slate(&folder, &[&run[..], &["--set", "record.enabled=true"]].concat());
    let tried = ["try", "lane_keeper", "--bag", "here/run.mcap", "--library"];
    let said = printed(&folder, 0, &[&tried[..], &["first.so"]].concat());
    assert!(said.contains("/wheels/command") && said.contains("identical"), "{said}");
    // The new code goes backwards.
    let source = project.join("src/lib.rs");
    let code = std::fs::read_to_string(&source).unwrap();
    let changed =
        code.replace("let wheel = |speed: f64| speed / params", "let wheel = |speed: f64| -speed / params");
    assert_ne!(code, changed);
    std::fs::write(&source, changed).unwrap();
    cargo(&project, "build");
    std::fs::copy(&built, folder.join("second.so")).unwrap();
    let said = printed(&folder, 1, &[&tried[..], &["second.so"]].concat());
    assert!(said.contains("first difference at ") && said.contains("/wheels/command"), "{said}");
    // On the recording of another robot, which has no such module.
    recorded(&folder.join("here"));
    let other = ["try", "lane_keeper", "--bag", "here/here/run.mcap", "--library", "first.so"];
    let links = [
        "--link",
        "position=/simulator/r2/position",
        "--link",
        "orientation=/simulator/r2/orientation",
        "--set",
        "modules.lane_keeper.inputs.target={x=1.0,y=0.0}",
    ];
    let said = printed(&folder, 0, &[&other[..], &links].concat());
    assert!(said.contains("lane_keeper (lane_keeper) on here/here/run.mcap: "), "{said}");
    std::fs::write(folder.join("none.so"), "no library").unwrap();
    let said = printed(&folder, 2, &[&tried[..], &["none.so"]].concat());
    assert!(said.contains("none.so"), "{said}");
    let said = printed(&folder, 2, &[&tried[..], &["nowhere.so"]].concat());
    assert!(said.contains("nowhere.so"), "{said}");
}

#[test]
fn unplayable_recordings_are_refused_in_words() {
    let folder = folder("replay-refused");
    let file = recorded(&folder);
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(folder.join("cut.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    let said = printed(&folder, 2, &["replay", "cut.mcap"]);
    assert!(said.contains("is damaged at byte") && said.contains("slate bag repair cut.mcap"), "{said}");
    printed(&folder, 0, &["bag", "repair", "cut.mcap"]);
    let said = printed(&folder, 0, &["replay", "cut.mcap", "--rate", "max"]);
    assert!(said.contains(" cycles, up to "), "{said}");
    let said = printed(&folder, 2, &["replay", "here/run.mcap", "--select", "/nothing"]);
    assert!(said.contains("no topic `/nothing`"), "{said}");
    let said = printed(&folder, 2, &["replay", "here/run.mcap", "--start", "1000"]);
    assert!(said.contains("--start"), "{said}");
    let said = printed(&folder, 2, &["replay", "here/run.mcap", "--map", "scan"]);
    assert!(said.contains("/scan=/r2/laser/scan"), "{said}");
    let said = printed(&folder, 2, &["replay", "none.mcap"]);
    assert!(said.contains("none.mcap"), "{said}");
}
