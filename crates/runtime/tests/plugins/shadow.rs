//! New code beside the old: it is compared, and it takes over without a gap.

use std::path::Path;

use slate_blackboard::interface::Value;
use slate_runtime::{Agent, Composer, Mode, PluginError};

use crate::fixtures::{Folder, libraries};
use crate::support::*;

/// Steps of an agent in lockstep, each of which the new code beside that module has made too.
#[track_caller]
pub fn step_together(agent: &mut Agent, module: &str, cycles: u64) {
    let path = format!("{module}/shadow/ticks");
    for _ in 0..cycles {
        let before = value(agent.board(), &path).unwrap_or(0);
        step(agent, 1);
        until("the new code makes the step", || value(agent.board(), &path) == Some(before + 1));
    }
}

/// How new code compares: steps, differences, skipped steps, panics, and the first difference.
pub fn comparison(agent: &Agent, module: &str) -> ([u64; 5], String) {
    let fields = ["ticks", "differences", "skipped", "panics", "first_difference"];
    let counts = fields.map(|field| number(agent, &format!("{module}/shadow/{field}")));
    let (port, _) = agent.board().read(&format!("{module}/shadow/port")).unwrap().unwrap();
    (counts, port.as_str().unwrap().to_owned())
}

/// The modules beside which new code runs, and the plugins with their new code.
pub fn shown(composer: &Composer) -> (Vec<String>, Vec<String>) {
    let modules = composer.modules().into_iter().filter(|module| module.has_shadow);
    let plugins = composer.plugins().into_iter();
    let entry = |plugin: slate_runtime::PluginStatus| {
        plugin.shadow.map(|file| format!("{} {}", plugin.name, file.display()))
    };
    (modules.map(|module| module.name).collect(), plugins.filter_map(entry).collect())
}

fn set(agent: &Agent, path: &str, number: i128) {
    agent.board().write(path, &Value::Integer(number), 0).unwrap();
}

#[test]
fn new_code_that_computes_the_same_is_counted_as_equal() {
    let smoother = libraries().other("smoother");
    let text = format!(
        "{}{}[modules.smoother]\n\"params\".gain = 0.3\n",
        library("smoother", &smoother),
        robot(&plain()).replace("[links]", "[links]\n\"smoother/input\" = \"beat/count\"")
    );
    let mut agent = lockstep(&text);
    step(&mut agent, 3);
    for (name, file) in [("counter", plain()), ("smoother", smoother)] {
        assert_eq!(agent.composer().shadow(name, &file).unwrap(), [name]);
        assert_eq!(shown(&agent.composer()), (vec![name.into()], vec![format!("{name} {}", file.display())]));
        step_together(&mut agent, name, 20);
        assert_eq!(comparison(&agent, name), ([20, 0, 0, 0, 0], String::new()), "{name}");
        agent.composer().end_shadow(name).unwrap();
        assert_eq!(shown(&agent.composer()), (vec![], vec![]));
        assert!(agent.board().find(&format!("{name}/shadow")).is_err(), "its comparison has gone");
    }
    step(&mut agent, 1);
}

#[test]
fn new_code_with_other_results_is_reported_with_its_first_port() {
    let mut agent = lockstep(&robot(&plain()));
    step(&mut agent, 3);
    agent.composer().shadow("counter", &libraries().counter("more")).unwrap();
    step_together(&mut agent, "counter", 5);
    assert_eq!(comparison(&agent, "counter"), ([5, 5, 0, 0, 4], "count".into()));
    assert_eq!(number(&agent, "counter/count/version"), 1, "what it writes is thrown away");

    let mut agent = lockstep(&robot(&libraries().counter("ports")));
    step(&mut agent, 1);
    agent.composer().shadow("counter", &libraries().counter("ports,rogue")).unwrap();
    step_together(&mut agent, "counter", 3);
    assert_eq!(comparison(&agent, "counter"), ([3, 0, 0, 0, 0], String::new()));
    set(&agent, "counter/params/rogue", 3);
    step_together(&mut agent, "counter", 2);
    set(&agent, "counter/params/rogue", 0);
    step_together(&mut agent, "counter", 4);
    assert_eq!(comparison(&agent, "counter"), ([9, 2, 0, 0, 5], "twice".into()), "the first one stays");
    assert_eq!(number(&agent, "counter/twice/value"), 20);
}

#[test]
fn new_code_beside_the_old_changes_nothing_that_is_computed() {
    let digest = |shadow: bool| {
        let mut agent = lockstep(&robot(&plain()));
        for cycle in 0..30 {
            step(&mut agent, 1);
            if shadow && cycle == 5 {
                agent.composer().shadow("counter", &libraries().counter("more")).unwrap();
            }
        }
        agent.digest().unwrap()
    };
    assert_eq!(digest(true), digest(false));
}

#[test]
fn promoted_code_goes_on_with_its_own_state() {
    let mut agent = lockstep(&robot(&plain()));
    step(&mut agent, 7);
    // The state of the old code does not fit this one, which so begins with its own.
    let file = libraries().counter("unfit");
    agent.composer().shadow("counter", &file).unwrap();
    step_together(&mut agent, "counter", 4);
    assert_eq!(comparison(&agent, "counter"), ([4, 4, 0, 0, 8], "count".into()));
    assert_eq!(number(&agent, "counter/count/value"), 11);
    let reload = agent.composer().promote("counter").unwrap();
    assert_eq!((reload.plugin.as_str(), reload.in_place, reload.old_library), ("counter", true, "unmapped"));
    assert_eq!(reload.modules, [("counter".into(), Ok(()))]);
    assert_eq!(shown(&agent.composer()), (vec![], vec![]));
    assert!(agent.board().find("counter/shadow").is_err());
    let plugins = agent.composer().plugins();
    assert_eq!(plugins.iter().find(|plugin| plugin.name == "counter").unwrap().file, Some(file));
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/value"), 5, "the steps that it made beside, and one");
    assert_eq!(number(&agent, "reader/seen/generation"), 1, "it is the same writer");
    // It can be exchanged as any other code.
    agent.composer().reload("counter", None).unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/value"), 6);
}

#[test]
fn no_step_is_missed_or_made_twice_when_new_code_takes_over() {
    for (mode, trigger) in [(Mode::Staged, ""), (Mode::Threaded, "every = \"2ms\"")] {
        let text = robot(&plain()).replace("[modules.counter]", &format!("[modules.counter]\n{trigger}"))
            + "[loop]\nperiod = \"2ms\"\n";
        let paths = &["beat/count/value", "counter/count/value", "counter/count/version"];
        let running = Running::start(&text, mode, paths);
        let mut version = 1;
        for _ in 0..10 {
            let next = 3 - version;
            let file = libraries().counter(if next == 2 { "more" } else { "plain" });
            running.composer.shadow("counter", &file).unwrap();
            running.cycles(3);
            running.composer.promote("counter").unwrap();
            until("the new code", || running.value("counter/count/version") == next);
            version = next;
        }
        let (agent, _, samples) = running.stop();
        assert_eq!(agent.counts("counter").unwrap().0, number(&agent, "counter/count/value"), "{mode:?}");
        let versions: Vec<u64> = samples.iter().map(|row| row[2]).collect();
        assert_eq!(versions.windows(2).filter(|pair| pair[0].max(1) != pair[1].max(1)).count(), 10);
        if mode == Mode::Staged {
            assert!(samples.iter().all(|row| row[0] == row[1]), "a step in each cycle");
        }
    }
}

#[test]
fn all_modules_of_a_plugin_take_over_together() {
    let text = robot(&plain()) + "[modules.second]\nkind = \"counter\"\n";
    let paths =
        &["counter/count/version", "second/count/version", "counter/count/value", "second/count/value"];
    let running = Running::start(&text, Mode::Staged, paths);
    let mut modules = running.composer.shadow("counter", &libraries().counter("more")).unwrap();
    modules.sort();
    assert_eq!(modules, ["counter", "second"]);
    running.cycles(3);
    running.composer.promote("counter").unwrap();
    until("the new code", || running.value("second/count/version") == 2);
    let (_, _, samples) = running.stop();
    assert!(samples.iter().all(|row| row[0] == row[1] && row[2] == row[3]), "{samples:?}");
}

#[test]
fn an_unload_or_a_reload_ends_new_code_beside_the_old() {
    let mut agent = lockstep(&robot(&plain()));
    let composer = agent.composer();
    let more = libraries().counter("more");
    for again in ["unload", "in place", "with other ports"] {
        composer.shadow("counter", &more).unwrap();
        step_together(&mut agent, "counter", 2);
        match again {
            "unload" => {
                assert_eq!(composer.unload("counter").unwrap(), [("counter".into(), "unmapped")]);
                step(&mut agent, 1);
                composer.load("counter").unwrap();
            }
            "in place" => drop(composer.reload("counter", Some(&plain())).unwrap()),
            _ => assert!(!composer.reload("counter", Some(&libraries().counter("ports"))).unwrap().in_place),
        }
        assert_eq!(shown(&composer), (vec![], vec![]), "{again}");
        assert!(agent.board().find("counter/shadow").is_err(), "{again}");
        assert_says(&complaint(&composer.promote("counter").unwrap_err()), &["no new code runs beside it"]);
        step(&mut agent, 2);
    }
    composer.shadow("counter", &libraries().counter("ports")).unwrap();
    step_together(&mut agent, "counter", 2);
    drop(agent);
}

#[test]
fn a_refused_unload_or_reload_lets_new_code_run_on() {
    let text = robot(&plain()).replace("[modules.reader]", "params = { veto = 1 }\n[modules.reader]");
    let mut agent = lockstep(&text);
    let composer = agent.composer();
    composer.shadow("counter", &plain()).unwrap();
    step_together(&mut agent, "counter", 2);
    let ports = libraries().counter("ports");
    let refusals = [
        composer.unload("counter").unwrap_err(),
        composer.reload("counter", Some(&ports)).unwrap_err(),
        composer.reload("counter", Some(&libraries().other("impostor"))).unwrap_err(),
        composer.reload("counter", Some(Path::new("/nowhere/libcounter.so"))).unwrap_err(),
    ];
    assert!(
        matches!(refusals[0], PluginError::Veto { .. }) && matches!(refusals[1], PluginError::Veto { .. })
    );
    assert_eq!(shown(&composer).0, ["counter"]);
    step_together(&mut agent, "counter", 2);
    assert_eq!(comparison(&agent, "counter"), ([4, 0, 0, 0, 0], String::new()));
    composer.promote("counter").unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/value"), 5);
}

#[test]
fn code_that_cannot_run_beside_the_old_is_refused() {
    let text = robot(&plain()) + &library("dependent", &libraries().other("dependent"));
    let mut agent = lockstep(&text);
    let composer = agent.composer();
    let folder = Folder::new();
    let attempts: [(&str, _, &[&str]); 7] = [
        ("countr", plain(), &["no plugin `countr`", "nearest: counter"]),
        ("counter", libraries().counter("ports"), &["module `counter` has other ports", "reload the plugin"]),
        ("counter", libraries().counter("unit"), &["different versions of Count"]),
        ("counter", libraries().counter("circle"), &["counter -> dependent -> counter"]),
        ("counter", libraries().other("impostor"), &["is plugin `impostor`", "expected `counter`"]),
        ("counter", libraries().counter("abort"), &["panic = \"abort\""]),
        ("counter", folder.write("libcounter.so", b"nothing"), &["is not a shared library"]),
    ];
    for (name, file, says) in attempts {
        assert_says(&complaint(&composer.shadow(name, &file).unwrap_err()), says);
        assert_eq!(shown(&composer), (vec![], vec![]));
        assert!(agent.board().find("counter/shadow").is_err());
        step(&mut agent, 1);
    }
    for refusal in [composer.promote("counter").unwrap_err(), composer.end_shadow("counter").unwrap_err()] {
        assert_says(&complaint(&refusal), &["plugin `counter`: no new code runs beside it", "counter FILE"]);
    }
    composer.shadow("counter", &plain()).unwrap();
    let refusal = composer.shadow("counter", &plain()).unwrap_err();
    assert_says(&complaint(&refusal), &["new code runs beside it already", "promote counter", "--end"]);
    step_together(&mut agent, "counter", 1);
}

#[test]
fn a_plugin_without_modules_has_nothing_to_compare() {
    let text = library("counter", &plain()) + "[modules.counter]\nkind = \"beat\"\n";
    let agent = lockstep(&text);
    let refusal = agent.composer().shadow("counter", &plain()).unwrap_err();
    assert_says(&complaint(&refusal), &["no module runs its code", "reload"]);
}

#[test]
fn a_promotion_is_refused_for_the_same_reasons_as_a_reload() {
    let mut agent = lockstep(&robot(&plain()));
    let composer = agent.composer();
    composer.shadow("counter", &libraries().counter("circle")).unwrap_err();
    composer.shadow("counter", &libraries().counter("kinds")).unwrap();
    step_together(&mut agent, "counter", 1);
    composer.promote("counter").unwrap();
    let plugins = composer.plugins();
    let kinds = &plugins.iter().find(|plugin| plugin.name == "counter").unwrap().kinds;
    assert_eq!(kinds[..], ["counter", "extra"]);
    step(&mut agent, 1);
}
