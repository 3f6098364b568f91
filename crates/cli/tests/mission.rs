//! Missions as Petri Net Plans: checked, drawn, generated, and followed by a robot.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Running, folder, json, slate, text, wait_for};

const PATROL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/patrol");

const DOOR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/door");

const PLAN: &str = "goto_1|30; say_hello";
const RULES: &str = "*if* person *during* goto *do* say_away; restart_action";

/// Runs an example of a patrol, and again from a snapshot on its way.
fn is_followed_and_resumed(folder: &Path, example: &str) {
    is_the_same_from(folder, &format!("{PATROL}/{example}"), "13.3s");
}

/// Runs an example, and again from a snapshot at a time.
fn is_the_same_from(folder: &Path, example: &str, time: &str) {
    let run = |arguments: &[&str]| {
        let output = slate(folder, &[&["run", "--headless", "--json"], arguments].concat());
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        json(&output)
    };
    let at = format!("snapshot.at=\"{time}\"");
    let first = run(&[example, "--set", &at, "--set", "snapshot.file=half.snapshot"]);
    assert_eq!((&first["collisions"], &first["outcome"]), (&0.into(), &"goal_reached".into()), "{first}");
    assert_eq!(run(&["--resume", "half.snapshot"])["digest"], first["digest"]);
}

#[test]
fn a_generated_plan_is_sound_until_it_is_spoiled() {
    let running = Running::new("mission");
    fs::write(running.folder().join("fetch.plan"), PLAN).unwrap();
    fs::write(running.folder().join("fetch.rules"), RULES).unwrap();
    running.done(&["mission", "generate", "fetch.plan", "--rules", "fetch.rules", "--out", "fetch.pnml"]);
    let said = running.done(&["mission", "check", "fetch.pnml"]);
    assert!(said.starts_with("fetch: sound; "), "{said}");
    running.fails(7, &["mission", "check", "fetch.pnml", "--action", "goto"], &[]);
    let output = running.call(&["mission", "check", "fetch.pnml", "--action", "goto", "--json"]);
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document["plans"][0]["findings"][0]["kind"], "unknown action", "{document}");
    // Nothing leads out of the greeting.
    let file = running.folder().join("fetch.pnml");
    let spoiled = fs::read_to_string(&file).unwrap().replace("say_away.end", "say_away.end [never");
    fs::write(&file, &spoiled).unwrap();
    running.fails(2, &["mission", "check", "fetch.pnml"], &["fetch.pnml:", "expected `]` after the guard"]);
    running.fails(2, &["mission", "show", "none.pnml"], &["none.pnml: can't be read"]);
}

#[test]
fn a_defect_is_printed_with_the_way_to_it() {
    let running = Running::new("mission_defect");
    let place = |id: &str, name: &str, tokens: u32| {
        format!(
            "<place id='{id}'><name><value>{name}</value></name><initialMarking><value>{tokens}</value></initialMarking></place>"
        )
    };
    let transition =
        |id: &str| format!("<transition id='{id}'><name><value>[{id}]</value></name></transition>");
    let arc = |from: &str, to: &str| format!("<arc source='{from}' target='{to}'/>");
    let net = [
        place("p", "start", 1),
        place("q", "nook", 0),
        place("g", "goal", 0),
        transition("in"),
        transition("out"),
        arc("p", "in"),
        arc("in", "q"),
        arc("p", "out"),
        arc("out", "g"),
    ];
    fs::write(running.folder().join("trap.pnml"), format!("<pnml><net>{}</net></pnml>", net.concat()))
        .unwrap();
    let output = running.call(&["mission", "check", "trap.pnml"]);
    assert_eq!(output.status.code(), Some(7));
    let said = text(&output.stdout);
    let expected = "error: trap: deadlock: no transition is enabled in the marking nook\n  after in ([in])\ntrap: not sound; ";
    assert!(said.starts_with(expected), "{said}");
    let drawing = running.done(&["mission", "show", "trap.pnml"]);
    let document = roxmltree::Document::parse(&drawing).unwrap();
    let count = |class: &str| {
        let classes = document.descendants().filter_map(|node| node.attribute("class"));
        classes.filter(|own| own.split(' ').any(|own| own == class)).count()
    };
    assert_eq!(["place", "transition", "edge", "goal", "token"].map(count), [3, 2, 4, 1, 1]);
}

#[test]
fn a_robot_follows_its_plan_and_each_run_is_the_same() {
    let folder = folder("patrol");
    let file = format!("{PATROL}/patrol.toml");
    let run = |arguments: &[&str]| {
        let output = slate(&folder, &[&["run", "--headless", "--json"], arguments].concat());
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        json(&output)
    };
    let snapshot = ["--set", "snapshot.at=\"13.3s\"", "--set", "snapshot.file=half.snapshot"];
    let first = run(&[&file]);
    let again = run(&[&[file.as_str()], &snapshot[..]].concat());
    let resumed = run(&["--resume", "half.snapshot"]);
    assert_eq!(first["collisions"], 0, "{first}");
    assert_eq!((&again["digest"], &resumed["digest"]), (&first["digest"], &first["digest"]));
    let said = text(&slate(&folder, &["mission", "check", &format!("{PATROL}/patrol.pnml")]).stdout);
    assert!(said.contains("patrol: sound; "), "{said}");
}

#[test]
fn a_behavior_tree_is_checked_drawn_and_followed() {
    let folder = folder("patrol_tree");
    let tree = format!("{PATROL}/patrol.xml");
    let said = text(&slate(&folder, &["mission", "check", &tree]).stdout);
    assert_eq!(said, "patrol: sound; 43 nodes, 1 actions, 2 conditions, 9 entries\n");
    let output = slate(&folder, &["mission", "check", &tree, "--action", "Go"]);
    assert_eq!(output.status.code(), Some(7));
    let said = text(&output.stdout);
    let place = format!("error: {tree}:27: unknown leaf: the action `GoToOrigin` is unknown");
    assert!(said.starts_with(&format!("{place}\npatrol: not sound; ")), "{said}");
    let drawing = text(&slate(&folder, &["mission", "show", &tree]).stdout);
    let document = roxmltree::Document::parse(&drawing).unwrap();
    let rows = document.descendants().filter(|node| node.has_tag_name("rect")).count();
    assert_eq!(rows, 43 + 1, "one for each node, and the paper");
    is_followed_and_resumed(&folder, "patrol_tree.toml");
}

#[test]
fn skills_in_lua_are_checked_drawn_and_followed() {
    let folder = folder("patrol_lua");
    let skill = format!("{PATROL}/patrol.lua");
    let said = text(&slate(&folder, &["mission", "check", &skill]).stdout);
    assert_eq!(said, "patrol: sound; 2 machines, 9 states, 9 transitions, 1 actions\n");
    let output = slate(&folder, &["mission", "check", &skill, "--action", "Go"]);
    assert_eq!(output.status.code(), Some(7));
    let said = text(&output.stdout);
    let finding = "unknown action: `visit` performs the action `GoToOrigin`, which is unknown";
    assert_eq!(said.lines().next(), Some(format!("error: {skill}: {finding}").as_str()));
    let drawing = text(&slate(&folder, &["mission", "show", &skill]).stdout);
    let document = roxmltree::Document::parse(&drawing).unwrap();
    let boxes = document.descendants().filter(|node| node.has_tag_name("rect")).count();
    assert_eq!(boxes, 9 + 1, "one for each state, and the paper");
    fs::write(folder.join("bad.lua"), "x = 1\ny = = 2").unwrap();
    let output = slate(&folder, &["mission", "check", "bad.lua"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("bad.lua:2: unexpected symbol near '='"), "{output:?}");
    is_followed_and_resumed(&folder, "patrol_lua.toml");
}

#[test]
fn a_golog_program_is_checked_drawn_and_followed() {
    let folder = folder("patrol_golog");
    let theory = format!("{PATROL}/patrol.golog");
    let said = text(&slate(&folder, &["mission", "check", &theory]).stdout);
    assert_eq!(said, "patrol: sound; 7 fluents, 3 actions, 1 procedures, 2 conditions\n");
    let output = slate(&folder, &["mission", "check", &theory, "--action", "wait"]);
    assert_eq!(output.status.code(), Some(7));
    let said = text(&output.stdout);
    let place = format!("error: {theory}:16: unknown action: the robot's action `GoToOrigin` is unknown");
    assert!(said.starts_with(&format!("{place}\npatrol: not sound; ")), "{said}");
    let drawing = text(&slate(&folder, &["mission", "show", &theory]).stdout);
    let document = roxmltree::Document::parse(&drawing).unwrap();
    let rows = document.descendants().filter(|node| node.has_tag_name("rect")).count();
    assert_eq!(rows, 10 + 1, "one for each part, and the paper");
    fs::write(folder.join("wrong.golog"), "procedure main {\n    go_to(desk)\n}\n").unwrap();
    let output = slate(&folder, &["mission", "check", "wrong.golog"]);
    assert_eq!(output.status.code(), Some(2));
    let expected = "error: wrong.golog:2:5: unknown action or procedure `go_to`\n    2 |     go_to(desk)\n      |     ^^^^^\n";
    assert_eq!(text(&output.stderr), expected);
    is_followed_and_resumed(&folder, "patrol_golog.toml");
}

#[test]
fn two_robots_pass_a_door_by_one_plan_and_each_run_is_the_same() {
    let folder = folder("door");
    let plan = format!("{DOOR}/door.pnml");
    let output = slate(&folder, &["mission", "check", &plan]);
    let said = text(&output.stdout);
    assert_eq!((output.status.code(), said.contains("door: sound; ")), (Some(0), true), "{said}");
    assert!(!said.contains("deadlock") && !said.contains("dependent"), "{said}");
    // Both have arrived, and agree about the way back.
    is_the_same_from(&folder, &format!("{DOOR}/door.toml"), "20.76s");
}

/// A robot whose plan alone runs: it meets the other one, and waits for it.
fn member(robot: &str, other: &str) -> String {
    format!(
        "[agent]\nname = \"{robot}\"\n[loop]\nperiod = \"10ms\"\n[mission]\noutcome = \"/{robot}/planner/verdict\"\n\
         [robots.{robot}.modules]\nplanner = {{ kind = \"petri_net_plan\", every = \"10ms\", params = {{ plan_filename \
         = \"./meet.pnml\", robot = \"{robot}\", partner_timeout = 1.0 }} }}\n\
         [robots.{robot}.links]\n\"planner/partners\" = \"slate://team/mission\"\n\
         [share.agents.{other}]\nat = \"local:{other}\"\n\
         [share.knowledge]\nperiod = \"20ms\"\nfacts.mission = \"{robot}/planner/claims\"\n"
    )
}

/// They meet as soon as both are ready, and wait for each other at the end: r1 for ever, r2 until r1 is absent.
fn meeting() -> String {
    let mut net = slate_petri_net::NetBuilder::new("meet");
    let waiting = ["r1", "r2"].map(|robot| (net.place(&format!("waiting @{robot}"), 1), 1));
    let met = ["r1", "r2"].map(|robot| (net.place(&format!("met @{robot}"), 0), 1));
    let (goal, fail) = (net.place("goal @r1", 0), net.place("fail @r2", 0));
    net.transition("meet", &waiting, &met);
    net.transition("[never]", &met[..1], &[(goal, 1)]);
    net.transition("[absent_r1]", &met[1..], &[(fail, 1)]);
    slate_petri_net::write_pnml(&net.finish().unwrap())
}

#[test]
fn two_agents_fire_a_transition_together_until_one_is_killed() {
    let mut running = Running::new("mission_team");
    fs::write(running.folder().join("meet.pnml"), meeting()).unwrap();
    for (robot, other) in [("r1", "r2"), ("r2", "r1")] {
        fs::write(running.folder().join(format!("{robot}.toml")), member(robot, other)).unwrap();
        running.start(robot, &["run", &format!("{robot}.toml"), "--headless"]);
    }
    let marking = |running: &Running, robot: &str| {
        running.read(robot, &format!("/{robot}/planner/mission"))["marking"].clone()
    };
    wait_for("both robots have met", || ["r1", "r2"].iter().all(|robot| marking(&running, robot) == "met"));
    // The first run is that of r1.
    running.kill();
    let output = running.finish();
    let said = text(&output.stdout) + &text(&output.stderr);
    assert!(said.contains("`r1` is absent: not heard for 1 s"), "{said}");
    assert_ne!(output.status.code(), Some(0), "{said}");
}
