//! Refused changes, which leave the agent unchanged.

use slate_blackboard::interface::Value;
use slate_runtime::{Agent, Options, PluginError, Rate};

use crate::fixtures::{Folder, libraries};
use crate::support::*;

#[test]
fn two_plugins_of_one_name_are_refused() {
    let folder = Folder::new();
    let twin = folder.copy(&libraries().counter("more"));
    let mut agent = lockstep(&robot(&plain()));
    let refusal = agent.composer().load_library(&twin).unwrap_err();
    assert!(matches!(refusal, PluginError::Loaded { .. }), "{refusal:?}");
    step(&mut agent, 1);
    assert_eq!(number(&agent, "counter/count/version"), 1);
    // Under another name in the configuration it is still the plugin that it is.
    let text = robot(&plain()) + &library("other", &twin);
    let refusal = try_lockstep(&text).unwrap_err();
    let file = twin.display().to_string();
    assert_says(&complaint(&refusal), &[&file, "is plugin `counter`", "expected `other`"]);
}

#[test]
fn a_kind_that_two_plugins_bring_is_refused() {
    let impostor = libraries().other("impostor");
    let mut agent = lockstep(&robot(&plain()));
    let refusal = agent.composer().load_library(&impostor).unwrap_err();
    assert!(matches!(refusal, PluginError::SameKind { .. }), "{refusal:?}");
    assert_says(
        &complaint(&refusal),
        &["`impostor`", "module kind `counter`", "plugin `counter` already defines"],
    );
    step(&mut agent, 1);
    let refusal =
        try_lockstep(&(library("counter", &plain()) + &library("impostor", &impostor))).unwrap_err();
    assert_says(&complaint(&refusal), &["`impostor`", "`counter`"]);
}

#[test]
fn a_module_that_does_not_let_itself_be_unloaded_stays() {
    let text = robot(&plain()).replace("[modules.reader]", "params = { veto = 1 }\n[modules.reader]");
    let mut agent = lockstep(&text);
    step(&mut agent, 2);
    let unload = agent.composer().unload("counter").unwrap_err();
    let reload = agent.composer().reload("counter", Some(&libraries().counter("ports"))).unwrap_err();
    for refusal in [unload, reload] {
        assert!(matches!(refusal, PluginError::Veto { .. }), "{refusal:?}");
        assert_says(&complaint(&refusal), &["module `counter`", "the arm would fall", "try again"]);
    }
    step(&mut agent, 1);
    assert_eq!(number(&agent, "reader/seen/value"), 3);
    agent
        .composer()
        .reload("counter", Some(&libraries().counter("more")))
        .expect("the arm is held all the time");
}

#[test]
fn the_time_source_can_be_reloaded_but_not_unloaded() {
    let text = format!("time.source = \"counter\"\n{}[modules.beat]\n", robot(&plain()));
    let options = Options { rate: Rate::Max, ..Options::default() };
    let mut agent = Agent::load(&configuration(&text), &linked(), options).unwrap();
    step(&mut agent, 2);
    let unload = agent.composer().unload("counter").unwrap_err();
    let reload = agent.composer().reload("counter", Some(&libraries().counter("ports"))).unwrap_err();
    for refusal in [unload, reload] {
        assert!(matches!(refusal, PluginError::TimeSource { .. }), "{refusal:?}");
        assert_says(&complaint(&refusal), &["module `counter` is the time source", "reload"]);
    }
    let before = agent.now();
    agent.composer().reload("counter", Some(&libraries().counter("more"))).unwrap();
    step(&mut agent, 2);
    assert_eq!(number(&agent, "counter/count/value"), 4);
    assert!(agent.now() > before);
}

#[test]
fn a_library_that_misfits_the_configuration_changes_nothing() {
    // The link is to a port that the counter does not have.
    let text = robot(&plain())
        .replace("counter/count", "counter/counts")
        .replace("[modules.counter]", "load = false\n[modules.counter]");
    let mut agent = lockstep(&text);
    step(&mut agent, 1);
    let paths = |agent: &Agent| -> Vec<String> {
        agent.board().properties().iter().map(|p| p.path().into()).collect()
    };
    let before = paths(&agent);
    let refusal = agent.composer().load("counter").unwrap_err();
    assert_says(&complaint(&refusal), &["`counter` has no output `counts`", "did you mean count"]);
    assert_eq!(paths(&agent), before);
    let plugins = agent.composer().plugins();
    assert!(plugins.iter().any(|plugin| plugin.name == "counter" && !plugin.loaded));
    step(&mut agent, 1);
    agent.board().write("beat/enabled/value", &Value::Bool(true), 0).unwrap();
}
