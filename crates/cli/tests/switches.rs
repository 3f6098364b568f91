//! Modules that are switched and plugins that come and go in an agent that runs, and output without a reader.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]
#![allow(clippy::disallowed_methods, reason = "a robot that goes with the wall clock is measured by it")]

use crate::common;

use std::fs::File;
use std::process::{Command, Stdio};

use common::{Running, library, text};

const EXP1: [&str; 5] = ["run", "exp1", "--headless", "--rate", "1"];

#[test]
fn a_switch_says_what_it_did_and_what_it_can_not_do() {
    let mut running = Running::new("switches");
    running.start("exp1", &EXP1);
    assert_eq!(running.done(&["module", "enable", "referee"]), "referee is on already\n");
    assert_eq!(running.done(&["module", "disable", "referee"]), "referee is off\n");
    assert_eq!(running.done(&["module", "disable", "referee"]), "referee is off already\n");
    assert_eq!(running.read("exp1", "/referee/enabled/value"), false);
    assert_eq!(running.done(&["module", "enable", "referee"]), "referee is on\n");
    assert_eq!(running.read("exp1", "/referee/enabled/value"), true);

    let words = ["`simulator` is the time source", "stands still", "end the agent instead"];
    running.fails(5, &["module", "disable", "simulator"], &words);
    assert_eq!(running.read("exp1", "/simulator/enabled/value"), true);
    for verb in ["enable", "disable"] {
        let words = ["no module is called `r2/planer`", "did you mean r2/planner"];
        running.fails(4, &["module", verb, "r2/planer"], &words);
        running.fails(4, &["module", verb, "nope"], &["no module is called `nope`", "r2/planner, "]);
        running.fails(2, &["module", verb], &["<NAME>"]);
    }
}

#[test]
fn unknown_names_are_answered_with_the_known_ones() {
    let mut running = Running::new("unknown");
    running.start("exp1", &EXP1);
    running.fails(4, &["log", "--module", "nope"], &["no module is called `nope`", "r2/planner, "]);
    running.fails(4, &["log", "--module", "planner"], &["did you mean r2/planner?"]);
    running.done(&["log", "--module", "r2/planner"]);
    running.done(&["log", "--module", "r2/*"]);
    running.fails(4, &["get", "execute/status"], &["did you mean /r2/execute/status?"]);
    running.fails(4, &["get", "/execute/status/route"], &["did you mean /r2/execute/status/route?"]);
}

#[test]
fn a_load_says_which_code_it_took() {
    let mut running = Running::new("code");
    running.start("exp1", &EXP1);
    let (file, list) = (library("libslate_wheeled.so"), ["plugin", "list"]);
    let line = || {
        let list = running.done(&list);
        list.lines().find(|line| line.starts_with("slate-wheeled")).unwrap().to_owned()
    };
    assert!(line().contains("  linked in  "), "{}", line());
    let whole = running.done(&list);
    assert!(whole.contains("r2/planner") && whole.lines().all(|line| line.len() < 100), "{whole}");
    let modules: Vec<_> = whole.lines().flat_map(|line| line.split([' ', ','])).collect();
    assert_eq!(modules.iter().filter(|word| **word == "r2/planner").count(), 1, "{whole}");
    assert!(running.done(&["module", "list"]).lines().next().unwrap().contains("late  crashes  plugin"));
    running.done(&["plugin", "unload", "slate-wheeled"]);
    assert!(line().contains("not loaded; linked in"), "{}", line());
    let said = running.done(&["plugin", "load", "slate-wheeled"]);
    assert!(said.starts_with("slate-wheeled is loaded; its code: linked in\nmodules: "), "{said}");
    running.done(&["plugin", "unload", "slate-wheeled"]);
    let said = running.done(&["plugin", "load", &file]);
    assert!(said.starts_with(&format!("slate-wheeled is loaded; its code: {file}\nmodules: ")), "{said}");
    assert!(line().contains(&file), "{}", line());
}

#[test]
fn new_code_is_tried_beside_the_old_and_takes_over() {
    let mut running = Running::new("beside");
    running.start("exp1", &EXP1);
    let file = library("libslate_wheeled.so");
    running.fails(
        4,
        &["plugin", "shadow", "slate-weeled", &file],
        &["no plugin `slate-weeled`", "slate-wheeled"],
    );
    running.fails(
        4,
        &["plugin", "shadow", "slate-weeled"],
        &["no plugin `slate-weeled` is loaded", "plugin list"],
    );
    running.fails(5, &["plugin", "promote", "slate-wheeled"], &["no new code runs beside it"]);
    running.fails(5, &["plugin", "shadow", "slate-wheeled", "--end"], &["no new code runs beside it"]);
    assert!(
        running
            .done(&["plugin", "shadow", "slate-wheeled"])
            .contains("no new code runs beside slate-wheeled")
    );

    let said = running.done(&["plugin", "shadow", "slate-wheeled", &file]);
    assert!(said.contains("r2/planner: new code runs beside it, see /r2/planner/shadow"), "{said}");
    let lines = |arguments: &[&str], word: &str| {
        let said = running.done(arguments);
        said.lines().filter(|line| line.contains(word)).count()
    };
    let modules = said.lines().count();
    assert_eq!(lines(&["module", "list"], "new code beside it"), modules);
    assert_eq!(lines(&["plugin", "list"], &file), 1);
    let steps = || running.read("exp1", "/r2/planner/shadow")["ticks"].as_u64().unwrap_or(0);
    assert!((0..1000).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(10));
        steps() > 5
    }));
    let shown = running.done(&["plugin", "shadow", "slate-wheeled"]);
    let planner: Vec<_> =
        shown.lines().find(|line| line.starts_with("r2/planner")).unwrap().split_whitespace().collect();
    assert_eq!((planner[2], planner[4]), ("0", "0"), "the same code makes no difference: {shown}");

    running.done(&["plugin", "shadow", "slate-wheeled", "--end"]);
    assert_eq!(lines(&["module", "list"], "new code beside it"), 0);
    running.done(&["plugin", "shadow", "slate-wheeled", &file]);
    let said = running.done(&["plugin", "promote", "slate-wheeled"]);
    assert!(said.contains("slate-wheeled is reloaded between two ticks"), "{said}");
    assert_eq!(said.matches("keeps its state").count(), modules, "{said}");
    assert_eq!(lines(&["module", "list"], "new code beside it"), 0);
    assert_eq!(lines(&["plugin", "list"], &file), 1, "it is its code now");
}

#[test]
fn library_copies_are_swept_only_after_their_agent_was_killed() {
    let mut running = Running::new("copies");
    let temporary = running.folder().join("tmp");
    // No process has such a number: one that is gone, and what is called nearly so. The last is of one that lives, and of
    // a version that locks nothing.
    let others = ["slate-9000001", "slate-9000001-x", "slate-test-9000001-1", "slate-1-1"];
    for name in others.into_iter().chain(["slate-9000001-1"]) {
        std::fs::create_dir_all(temporary.join(name)).unwrap();
        std::fs::write(temporary.join(name).join("lib.so"), "").unwrap();
    }
    std::os::unix::fs::symlink(running.folder(), temporary.join("slate-9000002-2")).unwrap();
    let start = |running: &mut Running, agent: &str| {
        let mut command = running.command(&EXP1);
        command.env("TMPDIR", &temporary);
        running.launch(agent, command);
        running.done(&[
            "plugin",
            "reload",
            "slate-wheeled",
            &library("libslate_wheeled.so"),
            "--agent",
            agent,
        ]);
    };
    let copies = || {
        let entries = std::fs::read_dir(&temporary).unwrap().map(|entry| entry.unwrap().file_name());
        let mut names: Vec<_> = entries.map(|name| name.into_string().unwrap()).collect();
        names.retain(|name| name != "slate-9000002-2" && !others.contains(&&**name));
        names.sort();
        names
    };
    start(&mut running, "exp1");
    let first = copies();
    assert_eq!(first.len(), 1, "{first:?}");
    start(&mut running, "exp1-2");
    let both = copies();
    assert!(both.len() == 2 && both.contains(&first[0]), "{both:?}");
    running.kill();
    assert_eq!(copies(), both);
    start(&mut running, "exp1");
    let later = copies();
    assert!(later.len() == 2 && !later.contains(&first[0]), "{later:?}");
    assert!(later.iter().any(|copy| both.contains(copy)), "that of the one that lives: {later:?}");
    for _ in 0..2 {
        running.interrupt();
        running.finish();
    }
    assert_eq!(copies(), [""; 0]);
    assert_eq!(std::fs::read_dir(&temporary).unwrap().count(), 5, "nothing else is touched");
    assert!(others.iter().all(|name| temporary.join(name).join("lib.so").is_file()));
}

#[test]
fn lost_output_is_reported() {
    let mut running = Running::new("lost");
    running.start("exp1", &EXP1);
    for arguments in [&["plugin", "list"][..], &["module", "list", "--json"], &["config", "get"], &["stop"]] {
        let output = running.command(arguments).stdout(File::create("/dev/full").unwrap()).output().unwrap();
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert_eq!(stderr.matches("stdout can't be written").count(), 1, "{arguments:?}: {stderr}");
        // The reader may end early, as `head` does.
        let mut gone = Command::new("true").stdin(Stdio::piped()).spawn().unwrap();
        let pipe = gone.stdin.take().unwrap();
        gone.wait().unwrap();
        let output = running.command(arguments).stdout(pipe).output().unwrap();
        assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()), "{arguments:?}");
    }
}

#[test]
fn a_robot_without_a_simulator_goes_with_the_wall_clock() {
    let mut running = Running::new("wall");
    let file = running.folder().join("wall.toml");
    std::fs::write(&file, "agent.name = \"wall\"\nloop.period = \"50ms\"\n").unwrap();
    for rate in [&["--rate", "max"][..], &["--rate", "7"], &["--mode", "threaded", "--rate", "7"]] {
        let run = [&["run", "wall.toml", "--headless"][..], rate].concat();
        running.fails(2, &run, &["runs on the wall clock", "omit `--rate`"]);
    }
    let start = std::time::Instant::now();
    running.start("wall", &["run", "wall.toml", "--headless"]);
    // Written ten times a second.
    let count = || running.read("wall", "/loop/state")["cycles"].as_u64().unwrap_or(0);
    while count() < 5 {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let cycles = u128::from(count());
    assert!(cycles <= start.elapsed().as_millis() / 50 + 1, "{cycles}");
}

#[test]
fn properties_are_listed_and_read() {
    let mut running = Running::new("properties");
    running.start("exp1", &EXP1);
    let list = running.done(&["list", "/loop/*"]);
    assert!(list.contains("/loop/state") && !list.contains("/r2/"), "{list}");
    assert!(running.done(&["list", "--json"]).contains("\"path\":\"r2/wheels/command\""));
    assert_eq!(running.done(&["get", "/referee/enabled/value"]), "true\n");
    while running.call(&["get", "/loop/state"]).status.code() == Some(6) {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let state = running.done(&["get", "/loop/state"]);
    assert!(state.lines().any(|line| line.starts_with("cycles ")), "{state}");
    assert!(running.done(&["get", "/loop/state", "--json"]).contains("\"sequence\""));
    running.fails(4, &["get", "/loop/nothing"], &["nothing"]);
    running.fails(5, &["list", "/a***b"], &["/**/timing"]);
}
