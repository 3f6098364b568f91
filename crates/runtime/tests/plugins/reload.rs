//! The code of a plugin is exchanged while its modules run.

use std::fs;

use slate_blackboard::interface::Value;
use slate_runtime::{Agent, Mode, PluginError};

use crate::fixtures::{Folder, libraries};
use crate::support::*;

fn counts(agent: &Agent) -> (u64, u64) {
    (number(agent, "beat/count/value"), number(agent, "counter/count/value"))
}

/// That the counter continues as if nothing had happened, with that code.
#[track_caller]
fn goes_on(agent: &mut Agent, version: u64) {
    for _ in 0..3 {
        step(agent, 1);
        let (beat, count) = counts(agent);
        assert_eq!(beat, count, "no cycle was missed");
        assert_eq!(number(agent, "reader/seen/value"), count);
    }
    assert_eq!(number(agent, "counter/count/version"), version);
    assert_eq!(number(agent, "reader/seen/generation"), 1, "it is the same writer");
    assert_eq!((number(agent, "reader/seen/missed"), number(agent, "reader/seen/stale")), (0, 0));
}

#[test]
fn state_goes_over_and_no_cycle_is_missed_in_lockstep() {
    let mut agent = lockstep(&robot(&plain()));
    goes_on(&mut agent, 1);
    for (file, version) in [("more", 2), ("plain", 1), ("more", 2)] {
        let reload = agent.composer().reload("counter", Some(&libraries().counter(file))).unwrap();
        assert_eq!(reload.plugin, "counter");
        assert_eq!(reload.modules, [("counter".into(), Ok(()))]);
        assert_eq!((reload.in_place, reload.old_library), (true, "unmapped"));
        goes_on(&mut agent, version);
    }
    let plugins = agent.composer().plugins();
    let plugin = plugins.iter().find(|plugin| plugin.name == "counter").unwrap();
    assert_eq!(plugin.file, Some(libraries().counter("more")));
    assert_eq!(plugin.modules, ["counter"]);
}

#[test]
fn a_reload_changes_nothing_that_others_compute() {
    let digest = |reload: bool| {
        let mut agent = lockstep(&robot(&plain()));
        for _ in 0..10 {
            step(&mut agent, 5);
            if reload {
                agent.composer().reload("counter", None).unwrap();
            }
        }
        agent.digest().unwrap()
    };
    assert_eq!(digest(true), digest(false));
}

#[test]
fn no_cycle_is_missed_on_the_wall_clock() {
    let text = robot(&plain()) + "[loop]\nperiod = \"2ms\"\n";
    let paths = &["beat/count/value", "counter/count/value", "reader/seen/value", "counter/count/version"];
    let running = Running::start(&text, Mode::Staged, paths);
    for round in 0..20 {
        let file = libraries().counter(if round % 2 == 0 { "more" } else { "plain" });
        let reload = running.composer.reload("counter", Some(&file)).unwrap();
        assert!(reload.in_place && reload.modules[0].1.is_ok(), "{reload:?}");
        running.cycles(5);
    }
    let (_, _, samples) = running.stop();
    for (i, row) in samples.iter().enumerate() {
        let cycle = i as u64 + 1;
        assert_eq!(row[..3], [cycle, cycle, cycle], "cycle {cycle}");
    }
    let changes = samples.windows(2).filter(|rows| rows[0][3] != rows[1][3]).count();
    assert_eq!(changes, 20, "each reload was to be seen");
}

#[test]
fn a_module_with_its_own_thread_reloads_between_two_ticks() {
    let text = robot(&plain()).replace("[modules.reader]", "every = \"1ms\"\n[modules.reader]");
    let running = Running::start(&text, Mode::Threaded, &["beat/count/value"]);
    for round in 0..20 {
        let (file, version) = if round % 2 == 0 { ("more", 2) } else { ("plain", 1) };
        let reload = running.composer.reload("counter", Some(&libraries().counter(file))).unwrap();
        assert!(reload.in_place && reload.modules[0].1.is_ok(), "{reload:?}");
        until("the new code", || running.value("counter/count/version") == version);
    }
    let (agent, _, samples) = running.stop();
    let (ticks, ..) = agent.counts("counter").unwrap();
    assert!(ticks > 20);
    assert_eq!(number(&agent, "counter/count/value"), ticks, "no tick was lost or made twice");
    assert!(samples.windows(2).all(|rows| rows[1][0] == rows[0][0] + 1), "the loop missed nothing");
}

#[test]
fn a_module_whose_state_does_not_fit_begins_afresh_and_says_so() {
    let paths = &["beat/count/value", "counter/count/value"];
    let running = Running::start(&robot(&plain()), Mode::Staged, paths);
    let reload = running.composer.reload("counter", Some(&libraries().counter("unfit"))).unwrap();
    assert!(reload.in_place);
    let [(module, Err(reason))] = &reload.modules[..] else { panic!("{reload:?}") };
    assert_eq!(module, "counter");
    assert_says(reason, &["missing field `begun`"]);
    running.cycles(5);
    let log = running.log.clone();
    let (_, _, samples) = running.stop();
    let text =
        "module counter runs the new code of plugin counter afresh, as its state could not be carried over";
    assert!(log.lines().iter().any(|line| line.text.contains(text)), "{:?}", log.lines());
    let fresh = samples.iter().position(|row| row[0] != row[1]).expect("it began afresh");
    for (i, row) in samples.iter().enumerate() {
        let count = if i < fresh { i + 1 } else { i - fresh + 1 };
        assert_eq!(row[..], [i as u64 + 1, count as u64], "neither missed a cycle");
    }
}

#[test]
fn a_module_gets_other_ports_and_its_links_and_state_stay() {
    let mut agent = lockstep(&robot(&plain()));
    step(&mut agent, 5);
    let reload = agent.composer().reload("counter", Some(&libraries().counter("ports"))).unwrap();
    assert!(!reload.in_place);
    assert_eq!(reload.modules, [("counter".into(), Ok(()))]);
    step(&mut agent, 1);
    assert_eq!(counts(&agent), (6, 6), "in lockstep no time passes meanwhile");
    assert_eq!(number(&agent, "counter/twice/value"), 12);
    assert_eq!((number(&agent, "reader/seen/value"), number(&agent, "reader/seen/generation")), (6, 2));
    agent.composer().reload("counter", Some(&plain())).unwrap();
    step(&mut agent, 1);
    assert_eq!(counts(&agent), (7, 7));
    assert!(agent.board().find("counter/twice").is_err(), "a port that is gone leaves the board");
}

#[test]
fn set_values_stay_after_change_of_ports() {
    let mut agent = lockstep(&robot(&plain()));
    step(&mut agent, 2);
    agent.board().write("counter/params/step", &Value::Integer(10), 0).unwrap();
    step(&mut agent, 1);
    agent.composer().reload("counter", Some(&libraries().counter("ports"))).unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/value"), 22);
    agent.composer().enable("counter", false).unwrap();
    agent.composer().reload("counter", Some(&plain())).unwrap();
    step(&mut agent, 3);
    assert_eq!(number(&agent, "counter/count/value"), 0, "what was switched off does not start by itself");
    agent.composer().enable("counter", true).unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/value"), 32);
    agent.composer().unload("counter").unwrap();
    agent.composer().load("counter").unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/value"), 1, "but a module that comes anew is as configured");
}

#[test]
fn a_trace_has_every_tick_of_a_module_that_is_exchanged() {
    let mut agent = lockstep(&robot(&plain()));
    let recording = agent.trace().record(Vec::new()).unwrap();
    step(&mut agent, 3);
    for (file, in_place) in [("more", true), ("ports", false), ("plain", false), ("ports", false)] {
        let reload = agent.composer().reload("counter", Some(&libraries().counter(file))).unwrap();
        assert_eq!(reload.in_place, in_place, "{file}");
        step(&mut agent, 3);
    }
    let (recorded, file) = recording.end().unwrap();
    assert_eq!(recorded.missing(), 0);
    let tracks = crate::trace::tracks(&file);
    for module in ["beat", "counter", "reader"] {
        assert!(tracks[module].cycles(module).into_iter().eq(1..=15), "{module}: {:?}", tracks[module]);
    }
}

#[test]
fn others_miss_no_cycle_when_a_module_gets_other_ports() {
    let paths = &["beat/count/value", "reader/seen/value"];
    let running = Running::start(&robot(&plain()), Mode::Staged, paths);
    for file in ["ports", "plain", "ports", "plain"] {
        let before = running.value("counter/count/value");
        let reload = running.composer.reload("counter", Some(&libraries().counter(file))).unwrap();
        assert!(!reload.in_place && reload.modules[0].1.is_ok(), "{reload:?}");
        until("the new code", || running.value("counter/count/value") > before);
        running.cycles(3);
    }
    let (_, _, samples) = running.stop();
    assert!(samples.windows(2).all(|rows| rows[1][0] == rows[0][0] + 1));
}

#[test]
fn an_interface_with_a_changed_unit_is_refused_while_it_is_read() {
    let mut agent = lockstep(&robot(&plain()));
    goes_on(&mut agent, 1);
    let refusal = agent.composer().reload("counter", Some(&libraries().counter("unit"))).unwrap_err();
    let (there, _) = agent.board().find("counter/count").unwrap();
    let hash = format!("{:016x}", there.descriptor().hash);
    assert_says(&complaint(&refusal), &["Count", &hash, "reader/input", "counter/count", "version"]);
    let text = complaint(&refusal);
    let hashes = text.split(|c: char| !c.is_ascii_hexdigit()).filter(|word| word.len() == 16);
    assert!(hashes.filter(|word| *word != hash).count() > 0, "the other schema: {text}");
    goes_on(&mut agent, 1);
}

#[test]
fn unread_interface_may_change() {
    let mut agent = lockstep(&(library("counter", &plain()) + "[modules.counter]\n"));
    step(&mut agent, 3);
    let (old, _) = agent.board().find("counter/count").unwrap();
    let reload = agent.composer().reload("counter", Some(&libraries().counter("unit"))).unwrap();
    assert!(!reload.in_place);
    step(&mut agent, 1);
    assert_eq!(counts(&agent), (4, 4));
    let (new, _) = agent.board().find("counter/count").unwrap();
    assert_ne!(old.descriptor().hash, new.descriptor().hash);
}

#[test]
fn a_reload_that_fails_leaves_the_old_code_going() {
    let mut agent = lockstep(&robot(&plain()));
    goes_on(&mut agent, 1);
    let folder = Folder::new();
    let damaged = folder.write("libcounter.so", &fs::read(plain()).unwrap()[..5000]);
    let attempts: [(_, &[&str]); 6] = [
        (libraries().counter("describe"), &["counter", "it can't describe itself"]),
        (libraries().other("bare"), &["libbare.so", "no section `.slate`"]),
        (libraries().other("impostor"), &["libimpostor.so", "is plugin `impostor`", "expected `counter`"]),
        (libraries().counter("abort"), &["panic = \"abort\"", "libcounter.so"]),
        (damaged, &["libcounter.so", "damaged"]),
        ("/nowhere/libcounter.so".into(), &["/nowhere/libcounter.so", "can't be read"]),
    ];
    for (file, says) in attempts {
        let refusal = agent.composer().reload("counter", Some(&file)).unwrap_err();
        assert_says(&complaint(&refusal), says);
        goes_on(&mut agent, 1);
    }
    // The new code is made with the present parameters.
    agent.board().write("counter/params/fault", &Value::Integer(1), 0).unwrap();
    let refusal = agent.composer().reload("counter", Some(&libraries().counter("more"))).unwrap_err();
    assert_says(
        &complaint(&refusal),
        &["module `counter` can't be set up by the new code", "it can't be made"],
    );
    goes_on(&mut agent, 1);
    let refusal = agent.composer().reload("counter", Some(&libraries().counter("ports"))).unwrap_err();
    assert_says(
        &complaint(&refusal),
        &["module `counter` can't be set up by the new code", "it can't be made"],
    );
    goes_on(&mut agent, 1);
    agent.board().write("counter/params/fault", &Value::Integer(0), 0).unwrap();
    agent.composer().reload("counter", Some(&libraries().counter("more"))).unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/version"), 2);
}

#[test]
fn a_file_may_be_replaced_or_deleted_while_its_code_runs() {
    let folder = Folder::new();
    let file = folder.copy(&plain());
    let mut agent = lockstep(&robot(&file));
    goes_on(&mut agent, 1);
    // Written over in place, which pulls the ground from under what maps the file itself.
    fs::write(&file, vec![0; 100]).unwrap();
    goes_on(&mut agent, 1);
    let refusal = agent.composer().reload("counter", None).unwrap_err();
    assert_says(&complaint(&refusal), &["libcounter.so", "is not a shared library"]);
    fs::write(&file, fs::read(libraries().counter("more")).unwrap()).unwrap();
    agent.composer().reload("counter", None).unwrap();
    goes_on(&mut agent, 2);
    fs::remove_file(&file).unwrap();
    goes_on(&mut agent, 2);
    let refusal = agent.composer().reload("counter", None).unwrap_err();
    assert_says(&complaint(&refusal), &["libcounter.so", "can't be read"]);
    goes_on(&mut agent, 2);
    agent.composer().unload("counter").unwrap();
    step(&mut agent, 1);
}

#[test]
fn a_new_version_may_bring_more_kinds_and_lose_them_again() {
    let mut agent = lockstep(&robot(&plain()));
    goes_on(&mut agent, 1);
    agent.composer().reload("counter", Some(&libraries().counter("kinds"))).unwrap();
    let kinds =
        || agent.composer().plugins().into_iter().find(|plugin| plugin.name == "counter").unwrap().kinds;
    assert_eq!(kinds(), ["counter", "extra"]);
    agent.composer().reload("counter", Some(&plain())).unwrap();
    assert_eq!(kinds(), ["counter"]);
    goes_on(&mut agent, 1);
}

#[test]
fn a_kind_that_a_module_runs_can_not_be_lost() {
    let text = robot(&libraries().counter("kinds")) + "[modules.extra]\n";
    let mut agent = lockstep(&text);
    goes_on(&mut agent, 1);
    let refusal = agent.composer().reload("counter", Some(&plain())).unwrap_err();
    assert_says(&complaint(&refusal), &["extra"]);
    goes_on(&mut agent, 1);
    assert_eq!(number(&agent, "extra/count/value"), number(&agent, "beat/count/value"));
}

#[test]
fn a_plugin_that_is_linked_in_has_no_file_to_be_reloaded_from() {
    let agent = lockstep("");
    let refusal = agent.composer().reload("beat", None).unwrap_err();
    assert!(matches!(refusal, PluginError::LinkedIn { .. }), "{refusal:?}");
    assert_says(&complaint(&refusal), &["plugin `beat` is linked in", "name the library"]);
}

#[test]
fn changes_from_several_threads_take_turns() {
    let text = robot(&plain()) + &dormant("dependent", &libraries().other("dependent"));
    let running = Running::start(&text, Mode::Staged, &["beat/count/value", "counter/count/value"]);
    std::thread::scope(|scope| {
        for file in ["more", "plain"] {
            let composer = running.composer.clone();
            scope.spawn(move || {
                for _ in 0..20 {
                    composer.reload("counter", Some(&libraries().counter(file))).unwrap();
                }
            });
        }
        let composer = running.composer.clone();
        scope.spawn(move || {
            for _ in 0..20 {
                assert_eq!(composer.load("dependent").unwrap().modules, ["pusher"]);
                assert!(composer.modules().len() >= 4 && composer.plugins().len() >= 4);
                composer.unload("dependent").unwrap();
            }
        });
    });
    let (_, _, samples) = running.stop();
    assert!(samples.iter().all(|row| row[0] == row[1]), "no change cost a cycle");
}

#[test]
fn a_composer_outlives_its_agent() {
    let mut agent = lockstep(&robot(&plain()));
    step(&mut agent, 1);
    let composer = agent.composer();
    drop(agent);
    composer.reload("counter", Some(&libraries().counter("more"))).unwrap();
    assert_eq!(composer.unload("counter").unwrap(), [("counter".into(), "unmapped")]);
}
