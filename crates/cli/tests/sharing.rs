//! Agents that share, as processes of their own.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use common::{Running, WORLD, wait_for};
use serde_json::Value;

/// A robot in its simulator, which does not end by itself.
const ROBOT: &str = r#"
[time]
source = "simulator"
[modules.simulator]
[share]
"#;

/// A referee of another agent's robot.
const WATCHER: &str = r#"
[modules.referee]
params = { robot = "r2", goal_tolerance = 0.1, time_limit = 1e6 }
[links]
"referee/truth" = "slate://robot/simulator/r2/truth"
"referee/contacts" = "slate://robot/simulator/contacts"
"#;

fn agents(name: &str) -> Running {
    let running = Running::new(name);
    std::fs::write(running.folder().join("robot.toml"), format!("{ROBOT}{WORLD}")).unwrap();
    std::fs::write(running.folder().join("watcher.toml"), format!("{WATCHER}{WORLD}")).unwrap();
    running
}

fn run(running: &mut Running, agent: &str) {
    let file = format!("{agent}.toml");
    running.start(agent, &["run", &file, "--headless", "--rate", "realtime"]);
}

fn links(running: &Running) -> Vec<Value> {
    let document: Value =
        serde_json::from_str(&running.done(&["link", "--agent", "watcher", "--json"])).unwrap();
    document["links"].as_array().unwrap().clone()
}

/// Why a link of the watcher brings nothing.
fn trouble(running: &Running, to: &str) -> Option<String> {
    let link = links(running).into_iter().find(|link| link["to"] == to).unwrap();
    link["trouble"].as_str().map(ToOwned::to_owned)
}

fn wait_for_values(running: &Running, to: &str) {
    wait_for("values", || trouble(running, to).is_none());
}

/// How many values of the robot's truth the watcher got.
fn received(running: &Running) -> u64 {
    let state = running.read("watcher", "/peers/robot/reads/simulator/r2/truth/received");
    state.as_u64().unwrap_or(0)
}

#[test]
fn two_agents_share_in_either_order_and_after_a_kill() {
    let mut running = agents("share-order");
    run(&mut running, "robot");
    run(&mut running, "watcher");
    wait_for_values(&running, "referee/truth");
    wait_for("the robot's place", || running.read("watcher", "/referee/truth/x") == 0.6);

    // The robot is the first of the runs; it has no chance to say that it goes.
    running.kill();
    wait_for("its absence", || {
        trouble(&running, "referee/truth").is_some_and(|trouble| trouble.contains("`robot` is not reachable"))
    });
    run(&mut running, "robot");
    wait_for_values(&running, "referee/truth");
    let before = received(&running);
    wait_for("values of the new one", || received(&running) > before);

    // Now the watcher is the first, and the robot stays.
    running.kill();
    run(&mut running, "watcher");
    wait_for_values(&running, "referee/truth");
    wait_for("the robot's place", || running.read("watcher", "/referee/truth/x") == 0.6);

    // What tools see follows a little later.
    wait_for("the robot among the peers", || {
        let peers = running.done(&["peers", "--agent", "watcher", "--json"]);
        let peers: Value = serde_json::from_str(&peers).unwrap();
        let robot = peers["peers"].as_array().unwrap().iter().find(|peer| peer["agent"] == "robot").unwrap();
        assert_eq!(robot["endpoint"], "local:robot");
        robot["connected"].as_u64() > Some(0) && robot["reads"][1]["path"] == "simulator/r2/truth"
    });
    wait_for("the watcher among the peers", || {
        running.done(&["peers", "--agent", "robot"]).contains("watcher reads /simulator/r2/truth")
    });
}

#[test]
fn remote_links_are_set_and_removed_at_run_time_with_errors() {
    let mut running = agents("share-links");
    run(&mut running, "watcher");
    run(&mut running, "robot");
    wait_for_values(&running, "referee/truth");
    let link = |from: &str| {
        running.done(&["link", "--agent", "watcher", "referee/truth", &format!("slate://robot/{from}")])
    };
    let said = |words: &[&str]| {
        wait_for("the words", || {
            let trouble = trouble(&running, "referee/truth").unwrap_or_default();
            words.iter().all(|word| trouble.contains(word))
        });
    };
    link("simulator/r2/trut");
    said(&["no property at /simulator/r2/trut", "simulator/r2/truth"]);
    link("simulator/r2/clearance");
    said(&["`referee/truth`", "/robot/simulator/r2/clearance"]);
    link("simulator/r2/truth");
    wait_for_values(&running, "referee/truth");

    // A field of it, beside values that are set.
    running.done(&["unlink", "--agent", "watcher", "referee/truth"]);
    wait_for("the end of the subscription", || {
        !running.done(&["peers", "--agent", "robot"]).contains("/simulator/r2/truth")
    });
    let field = "referee/truth/y";
    running.done(&["link", "--agent", "watcher", field, "slate://robot/simulator/r2/truth/x"]);
    wait_for_values(&running, field);
    wait_for("the field", || running.read("watcher", "/referee/truth/y") == 0.6);
    assert_eq!(running.read("watcher", "/referee/truth/x"), 0.0);
    // Another field of the same property, over the same subscription.
    let also = "referee/truth/x";
    running.done(&["link", "--agent", "watcher", also, "slate://robot/simulator/r2/truth/y"]);
    wait_for_values(&running, also);
    wait_for("the other field", || running.read("watcher", "/referee/truth/x") == 0.8);
    running.done(&["link", "--agent", "watcher", field, "slate://robot/simulator/r2/truth/z"]);
    wait_for("the fields that there are", || {
        trouble(&running, field)
            .is_some_and(|wrong| wrong.contains("no field `z`") && wrong.contains("did you mean"))
    });
    running.done(&["link", "--agent", "watcher", field, "slate://nobody/a/b"]);
    wait_for("the name", || trouble(&running, field).is_some_and(|trouble| trouble.contains("`nobody`")));
}

#[test]
fn another_agent_is_looked_into_through_one_that_knows_it() {
    let mut running = agents("share-look");
    run(&mut running, "watcher");
    run(&mut running, "robot");
    wait_for_values(&running, "referee/truth");
    let watcher = |arguments: &[&str]| running.done(&[arguments, &["--agent", "watcher"]].concat());
    let listed = watcher(&["list", "slate://robot/simulator/r2/*"]);
    assert!(listed.contains("slate://robot/simulator/r2/truth"), "{listed}");
    assert_eq!(watcher(&["get", "slate://robot/simulator/r2/truth/x"]).trim(), "0.6");
    let saved = watcher(&["snapshot", "save", "robot.json", "--of", "slate://robot/**"]);
    assert!(saved.contains("properties of agent robot"), "{saved}");
    let text = std::fs::read_to_string(running.folder().join("robot.json")).unwrap();
    let file: Value = serde_json::from_str(&text).unwrap();
    assert!(
        file["properties"]
            .as_array()
            .unwrap()
            .iter()
            .any(|property| property["path"] == "simulator/r2/truth")
    );

    let refused = |code, arguments: &[&str], says: &[&str]| {
        running.fails(code, &[arguments, &["--agent", "watcher"]].concat(), says);
    };
    refused(5, &["get", "slate://robt/simulator/r2/truth"], &["no agent `robt`", "nearest: robot"]);
    refused(4, &["get", "slate://robot/simulator/r2/trut"], &["nearest: simulator/r2/truth"]);
    refused(5, &["get", "slate://robot/**"], &["is not a property's URL"]);
    refused(4, &["list", "slate://robot/simulatr/**"], &["did you mean `simulator`?"]);
    running.fails(3, &["list", "--agent", "watchr"], &["running agents: watcher, robot"]);
}

#[test]
fn a_url_that_names_an_agent_leads_to_it() {
    let mut running = agents("share-urls");
    std::fs::write(running.folder().join("other.toml"), format!("{ROBOT}{WORLD}")).unwrap();
    run(&mut running, "robot");
    run(&mut running, "watcher");
    run(&mut running, "other");
    // Two have that, and one alone has the other.
    running.fails(2, &["get", "/simulator/r2/truth/x"], &["several agents are running"]);
    assert!(running.call(&["get", "/referee/params/robot"]).status.success());
    let read = |url: &str| running.call(&["get", url]).status.success();
    wait_for("a value", || read("slate://robot/simulator/r2/truth/x"));
    assert!(running.done(&["list", "slate://robot/simulator/**"]).contains("r2/truth"));
    // The input is the watcher's, whosever the output is.
    running.done(&["unlink", "slate://watcher/referee/truth", "--dry-run"]);
    let link = ["link", "slate://watcher/referee/truth", "slate://other/simulator/r2/truth"];
    assert!(running.done(&link).contains("slate://other"), "it says what changes");
    assert!(links(&running).iter().any(|link| link["from"] == "slate://other/simulator/r2/truth"));
    let words = ["belongs to agent `watcher`", "--agent watcher"];
    running.fails(5, &[&link[..], &["--agent", "robot"]].concat(), &words);
    // What the other agent has is seen before a link is made; whether it is there or not, the link can be made.
    let dry =
        |from: &str| ["link", "referee/truth", from, "--agent", "watcher", "--dry-run"].map(String::from);
    let fails = |code, from: &str, words: &[&str]| {
        let arguments = dry(from);
        running.fails(code, &arguments.each_ref().map(String::as_str), words);
    };
    fails(
        4,
        "slate://robot/simulator/r2/truht",
        &["no property at slate://robot/simulator/r2/truht", "r2/truth"],
    );
    fails(5, "slate://robot/simulator/contacts", &["Contacts"]);
    // It can be made all the same, and it is said that it waits.
    let made =
        running.call(&["link", "slate://watcher/referee/clearance", "slate://robot/simulator/contacts"]);
    let said = String::from_utf8_lossy(&made.stderr);
    assert!(made.status.success() && said.contains("waits: `referee/clearance`"), "{said}");
    running.done(&["unlink", "slate://watcher/referee/clearance"]);
    let good = dry("slate://robot/simulator/r2/truth");
    assert!(running.done(&good.each_ref().map(String::as_str)).contains("dry run"));
    // An agent without a local socket is queried through one that knows it.
    std::fs::remove_file(running.sockets().join("slate/robot.sock")).unwrap();
    wait_for("a value", || read("slate://robot/simulator/r2/truth/x"));
    let file = running.folder().join("robot.json");
    running.done(&["snapshot", "save", "--of", "slate://robot/**", &file.display().to_string()]);
    running.fails(
        3,
        &["get", "slate://nobody/simulator/r2/truth"],
        &["unknown to the running agents", "slate peers"],
    );
}

#[test]
fn agent_without_sharing_opens_no_endpoint() {
    let mut running = agents("share-none");
    std::fs::write(running.folder().join("alone.toml"), ROBOT.replace("[share]", "") + WORLD).unwrap();
    run(&mut running, "alone");
    let sockets = running.sockets().join("slate");
    let names = || -> Vec<_> {
        let names = std::fs::read_dir(&sockets).unwrap();
        names.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
    };
    assert!(!names().iter().any(|name| name.contains("share")), "{:?}", names());
    run(&mut running, "robot");
    let other = ROBOT.replace("[share]", "[share]\nlisten = \"local:robot\"") + WORLD;
    std::fs::write(running.folder().join("other.toml"), other).unwrap();
    let arguments = ["run", "other.toml", "--headless", "--rate", "realtime"];
    running.fails(2, &arguments, &["local:robot", "in use"]);
    std::fs::write(running.folder().join("bad.toml"), "[share]\nlisten = \"robot\"\n").unwrap();
    running.fails(2, &["run", "bad.toml", "--headless"], &["`robot` is not an endpoint", "local:base"]);
}
