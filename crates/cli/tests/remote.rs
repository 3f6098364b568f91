//! Commands that act on an agent that runs.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use common::{Running, json, library, text};
use serde_json::Value;

const EXP1: [&str; 6] = ["run", "exp1", "--headless", "--json", "--rate", "2"];

#[test]
fn exp1_is_reloaded_and_its_speed_set_while_it_drives() {
    let mut running = Running::new("exchange");
    running.start("exp1", &EXP1);
    let plugins: Value = serde_json::from_str(&running.done(&["plugin", "list", "--json"])).unwrap();
    let exp1 = plugins["plugins"]
        .as_array()
        .unwrap()
        .iter()
        .find(|plugin| plugin["name"] == "slate-wheeled")
        .unwrap();
    assert_eq!(exp1["file"], Value::Null);
    let modules = exp1["modules"].as_array().unwrap().len();
    assert!(running.done(&["plugin", "list"]).contains("linked in"));

    let file = library("libslate_wheeled.so");
    for _ in 0..2 {
        let said = running.done(&["plugin", "reload", "slate-wheeled", &file]);
        assert!(said.contains("between two ticks"), "{said}");
        assert_eq!(said.matches("keeps its state").count(), modules, "{said}");
    }
    assert!(running.done(&["plugin", "list"]).contains(&file));

    let path = "modules.\"r2/planner\".params.max_linear_velocity";
    let speed = "robots.r2.modules.planner.params.max_linear_velocity";
    let said = running.done(&["config", "set", &format!("{speed}=0.3")]);
    assert!(said.contains(path) && said.contains("-> 0.3"), "{said}");
    assert_eq!(running.read("exp1", "/r2/planner/params/max_linear_velocity"), 0.3);
    assert!(running.done(&["config", "get", speed]).contains("= 0.3  # change"));
    assert!(said.contains("0.4 (default) -> 0.3"), "{said}");
    let different = running.done(&["config", "diff"]);
    assert!(different.contains(&format!("- {speed} = 0.4  # default\n+ {speed} = 0.3")), "{different}");
    // The example is built in, so there is no file to save to.
    running.fails(5, &["config", "save"], &["built in"]);

    let said = running.done(&["module", "list"]);
    assert!(said.contains("r2/planner") && said.contains("WORKING"), "{said}");
    // The robot can do without its referee for a while.
    running.done(&["module", "disable", "referee"]);
    assert_eq!(running.read("exp1", "/referee/enabled/value"), false);
    running.done(&["module", "enable", "referee"]);
    let modules: Value = serde_json::from_str(&running.done(&["module", "list", "--json"])).unwrap();
    let planner =
        modules["modules"].as_array().unwrap().iter().find(|module| module["name"] == "r2/planner").unwrap();
    assert!(planner["ticks"].as_u64() > Some(0) && planner["panics"] == 0, "{planner}");

    let output = running.finish();
    let summary = json(&output);
    assert_eq!(
        (summary["outcome"].as_str(), output.status.code()),
        (Some("goal_reached"), Some(0)),
        "{output:?}"
    );
    // With the agent its socket goes.
    running.fails(3, &["plugin", "list"], &["no agent is running", "slate run"]);
}

#[test]
fn refusal_of_agent_has_place_and_remedy() {
    let mut running = Running::new("refused");
    running.start("exp1", &EXP1);
    let speed = "robots.r2.modules.planner.params.max_linear_velocity";
    running.fails(
        5,
        &["config", "set", &format!("{speed}=99")],
        &["planner.params.max_linear_velocity", "99, outside 0 to 3", "choose a value from 0 to 3"],
    );
    assert_ne!(running.read("exp1", "/r2/planner/params/max_linear_velocity"), 99.0);
    running.fails(5, &["config", "set", "loop.period=10ms"], &["`loop.period` can't change", "next start"]);
    // Asked for is what the module could not begin with at the next start.
    running.fails(
        5,
        &["config", "set", "modules.referee.params.robot=r9"],
        &["`referee` refuses these parameters", "r9"],
    );
    running.done(&["config", "set", "modules.referee.params.goal_tolerance=0.3"]);
    assert!(running.done(&["config", "revert", "modules.referee"]).contains("0.3 -> "));
    assert_eq!(running.done(&["config", "diff"]), "");
    running.fails(5, &["config", "set", "modules.planer.enabled=true"], &["planer"]);
    running.fails(2, &["config", "set", "loop.period"], &["no `=`"]);
    running.fails(2, &["config", "set"], &["PATH=VALUE"]);
    running.fails(4, &["config", "get", "modules.planer"], &["modules.planer"]);
    running.fails(5, &["plugin", "load", "slate-wheeled"], &["already loaded"]);
    running.fails(4, &["plugin", "load", "exp2"], &["no plugin `exp2`"]);
    running.fails(5, &["plugin", "load", "Cargo.toml"], &["Cargo.toml: can't be read"]);
    running.fails(5, &["plugin", "reload", "slate-wheeled"], &["linked in"]);
    running.fails(5, &["plugin", "unload", "simulation"], &["time source"]);
    running.fails(4, &["module", "enable", "planner"], &["planner"]);
    running.fails(3, &["module", "list", "--agent", "exp7"], &["no agent `exp7`", "exp1"]);
    assert!(running.call(&["plugin", "list"]).status.success());
}

#[test]
fn one_of_several_agents_is_chosen_and_a_killed_one_makes_room() {
    let mut running = Running::new("several");
    running.start("exp1", &EXP1);
    running.start("exp1-2", &EXP1);
    running.fails(2, &["module", "list"], &["exp1, exp1-2", "--agent exp1"]);
    running.done(&["config", "set", "modules.referee.params.goal_tolerance=0.2", "--agent", "exp1-2"]);
    assert_eq!(running.read("exp1", "/referee/params/goal_tolerance"), 0.1);
    assert_eq!(running.read("exp1-2", "/referee/params/goal_tolerance"), 0.2);
    // A URL names it as the list of agents does, whichever verb has it.
    let tolerance = |agent: &str| format!("slate://{agent}/referee/params/goal_tolerance");
    assert_eq!(running.done(&["get", &tolerance("exp1-2")]), "0.2\n");
    assert_ne!(running.done(&["get", &tolerance("exp1")]), "0.2\n");
    running.done(&["set", &tolerance("exp1-2"), "0.3"]);
    assert_eq!(running.read("exp1-2", "/referee/params/goal_tolerance"), 0.3);
    running.done(&["set", &tolerance("exp1-2"), "0.2"]);
    assert_eq!(running.done(&["watch", "--once", "--json", &tolerance("exp1-2")]).matches("0.2").count(), 1);
    assert!(running.done(&["list", "slate://exp1-2/referee/**"]).contains("slate://exp1-2/referee/params"));
    assert!(running.done(&["tree", "slate://exp1-2/referee/*"]).contains("params"));
    assert!(
        running
            .done(&["stat", "slate://exp1-2/simulator/r2/truth", "--for", "10ms"])
            .contains("/simulator/r2/truth")
    );
    running.fails(4, &["get", "slate://exp1-2/referee/params/goal_toleranc"], &["tolerance"]);
    running.kill();
    running.fails(3, &["module", "list", "--agent", "exp1"], &["no agent `exp1`", "running agents: exp1-2"]);
    // Now it is the only one, and the name of the killed one is free.
    running.done(&["module", "list"]);
    running.start("exp1", &EXP1);
}

#[test]
fn the_console_shows_the_log_once_and_not_when_switched_off() {
    for (set, times, shown) in [
        (None, 1, "console = true"),
        (Some("log.targets.console=true"), 1, "console = true"),
        (Some("log.targets.console=false"), 0, "console = false"),
    ] {
        let mut running = Running::new("remote-console");
        let sets = set.map(|set| ["--set", set]).into_iter().flatten();
        running.start("exp1", &EXP1.into_iter().chain(sets).collect::<Vec<_>>());
        let said = running.done(&["config", "get", "log.targets.console"]);
        assert!(said.contains(shown), "{set:?}: {said}");
        running.done(&["stop", "a word for the log"]);
        running.interrupt();
        let stderr = text(&running.finish().stderr);
        assert_eq!(stderr.matches("a word for the log").count(), times, "{set:?}: {stderr}");
    }
}

#[test]
fn the_log_of_a_running_agent_is_shown() {
    let mut running = Running::new("log");
    running.start("exp1", &EXP1);
    running.done(&["stop", "a word for the log"]);
    let eventually = |so: &dyn Fn() -> bool| {
        let mut tries = 0..200;
        assert!(
            tries.any(|_| so() || {
                std::thread::sleep(std::time::Duration::from_millis(50));
                false
            }),
            "it never was"
        );
    };
    eventually(&|| {
        running.done(&["log"]).contains("warn  agent: the actuators are stopped: a word for the log")
    });
    running.done(&["reset"]);
    eventually(&|| {
        running.done(&["log", "-n", "1"]).trim_end().ends_with("the stop of the actuators is ended")
    });
    let json = running.done(&["log", "--json", "-n", "1"]);
    let line: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&line["module"], &line["level"]), (&"agent".into(), &"INFO".into()), "{json}");
    running.interrupt();
    running.finish();
}

#[test]
fn a_file_is_edited_and_saved_while_its_agent_runs() {
    let mut running = Running::new("edited");
    let file = running.folder().join("robot.toml");
    let original = include_str!("../../../examples/exp1/exp1.toml").replace("name = \"exp1\"", "");
    let limit = |limit: &str| original.replacen("time_limit = 120.0", limit, 1);
    std::fs::write(&file, &original).unwrap();
    running.start("robot", &["run", "robot.toml", "--headless", "--rate", "1"]);
    let eventually = |so: &dyn Fn() -> bool| {
        let until = (0..400).any(|_| {
            std::thread::sleep(std::time::Duration::from_millis(25));
            so()
        });
        assert!(until, "it never was");
    };
    let time_limit = || running.read("robot", "/referee/params/time_limit");
    std::fs::write(&file, limit("time_limit = 90.0")).unwrap();
    eventually(&|| time_limit() == 90.0);
    // An error changes nothing, and the edit that mends it is taken over.
    std::fs::write(&file, limit("time_limit = -1.0")).unwrap();
    // The last line of the report.
    eventually(&|| running.read("robot", "/log/tail").to_string().contains("choose a value from 0"));
    assert_eq!(time_limit(), 90.0);
    std::fs::write(&file, limit("time_limit = 80.0")).unwrap();
    eventually(&|| time_limit() == 80.0);

    running.done(&["config", "set", "modules.referee.params.time_limit=70.5"]);
    assert_eq!(running.done(&["config", "save"]).trim(), "robot.toml");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), limit("time_limit = 70.5"));
    assert!(running.done(&["config", "save"]).contains("nothing to save"));
    running.fails(5, &["config", "set", "modules.referee.params.time_limit=-5"], &["outside"]);
    running.done(&["config", "set", "modules.referee.params.time_limit=60"]);
    running.fails(5, &["config", "save", "--host"], &["no file of this machine"]);
    running.interrupt();
    let output = running.finish();
    let stderr = text(&output.stderr);
    for words in [
        "is refused",
        "outside 0 to 1000000000",
        "robot.toml:",
        "are in effect: modules.referee.params.time_limit",
    ] {
        assert!(stderr.contains(words), "{words}: {stderr}");
    }
}

#[test]
fn settings_of_this_computer_have_a_file_of_their_own() {
    let mut running = Running::new("host");
    std::fs::write(running.folder().join("host.toml"), "# mine\n[loop]\nhang = \"1s\"\n").unwrap();
    running.start("exp1", &[&EXP1[..], &["--host", "host.toml"]].concat());
    running.done(&["config", "set", "modules.referee.params.goal_tolerance=0.2"]);
    assert_eq!(running.done(&["config", "save", "--host"]).trim(), "host.toml");
    let text = std::fs::read_to_string(running.folder().join("host.toml")).unwrap();
    assert!(text.starts_with("# mine\n[loop]") && text.contains("tolerance = 0.2"), "{text}");
}

#[test]
fn a_library_says_what_it_offers_without_being_opened() {
    let running = Running::new("info");
    let file = library("libslate_wheeled.so");
    let said = running.done(&["plugin", "info", &file]);
    for words in ["slate-wheeled 0.1.0", "panic unwind", "go_to_origin_planner (Think)", "needs nothing"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let outline: Value = serde_json::from_str(&running.done(&["plugin", "info", &file, "--json"])).unwrap();
    assert_eq!(outline["name"], "slate-wheeled");
    assert!(outline["modules"][0]["ports"][0]["schema"].is_string(), "{outline}");
    std::fs::write(running.folder().join("text.so"), "no library").unwrap();
    running.fails(2, &["plugin", "info", "text.so"], &["text.so: is not a shared library"]);
    running.fails(2, &["plugin", "info", "nothing.so"], &["nothing.so: can't be read"]);
}

#[test]
fn links_of_a_running_agent_are_listed_tried_set_and_removed() {
    let mut running = Running::new("links");
    running.start("exp1", &EXP1);
    let links: Value = serde_json::from_str(&running.done(&["link", "--json"])).unwrap();
    // One without options.
    let link =
        links["links"].as_array().unwrap().iter().find(|link| link["to"] == "referee/clearance").unwrap();
    let (to, from) = (link["to"].as_str().unwrap(), link["from"].as_str().unwrap());
    assert!(running.done(&["link"]).contains(from));
    // It is so already.
    assert!(running.done(&["link", to, from]).contains("no change"));
    running.fails(
        4,
        &["link", "r2/plannr/situation", from],
        &["no module owns `r2/plannr/situation`", "help"],
    );
    running.fails(4, &["link", to, "nobody/home"], &["nothing is called `/nobody/home`", "help"]);
    running.done(&["link", to, "slate://other/module/property", "--dry-run"]);
    running.fails(4, &["unlink", "nobody/home"], &["has no link"]);
    running.fails(2, &["link", to, "--stale", "1s"], &["FROM"]);
    let own: Value = serde_json::from_str(&running.done(&["link", to, "--json"])).unwrap();
    assert_eq!(own["links"].as_array().map(Vec::len), Some(1));
    assert_eq!((&own["links"][0]["to"], &own["links"][0]["from"]), (&link["to"], &link["from"]));
    running.fails(4, &["link", &to[..to.len() - 1]], &["has no link", to]);
    let tried = running.done(&["unlink", to, "--dry-run"]);
    assert!(tried.contains("dry run") && tried.ends_with("-> none\n"), "{tried}");
    let tried = running.done(&["link", to, from, "--stale", "200ms", "--dry-run"]);
    assert!(tried.contains("dry run") && tried.contains("stale"), "{tried}");
    assert!(!running.done(&["config", "diff"]).contains("stale"));
    assert!(running.done(&["link", to, from, "--stale", "200ms"]).contains("200ms"));
    assert!(running.done(&["link", to]).contains("stale = \"200ms\""));
    assert!(running.done(&["config", "diff"]).contains("stale"));
}
