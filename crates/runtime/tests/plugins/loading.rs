//! Plugins come and go.

use slate_runtime::Mode;
use slate_runtime::plugin::LibraryOutline;

use crate::fixtures::{Folder, libraries};
use crate::support::*;

#[test]
fn a_plugin_of_the_configuration_is_there_from_the_start() {
    let mut agent = lockstep(&robot(&plain()));
    step(&mut agent, 3);
    assert_eq!(number(&agent, "counter/count/value"), 3);
    assert_eq!(number(&agent, "reader/seen/value"), 3);
    let plugins = agent.composer().plugins();
    let plugin = plugins.iter().find(|plugin| plugin.name == "counter").unwrap();
    assert!(plugin.loaded);
    assert_eq!(plugin.version, "1.2.3");
    assert_eq!(plugin.file.as_deref(), Some(plain().as_path()));
    assert_eq!((plugin.kinds.join(" "), plugin.modules.join(" ")), ("counter".into(), "counter".into()));
}

#[test]
fn a_library_that_is_loaded_by_hand_gets_a_module_of_its_name() {
    let mut agent = lockstep("");
    step(&mut agent, 2);
    assert_eq!(agent.composer().load_library(&plain()).unwrap().modules, ["counter"]);
    step(&mut agent, 3);
    assert_eq!(number(&agent, "counter/count/value"), 3);
    agent.composer().unload("counter").unwrap();
    assert_eq!(agent.modules(), ["beat"]);
    step(&mut agent, 2);
    assert_eq!(agent.composer().load_library(&plain()).unwrap().modules, ["counter"], "and again");
    step(&mut agent, 2);
    assert_eq!(number(&agent, "counter/count/value"), 2);
}

#[test]
fn configured_modules_wait_for_their_plugin_and_then_appear() {
    let text = robot(&plain()).replace("[modules.counter]", "load = false\n[modules.counter]");
    let mut agent = lockstep(&text);
    step(&mut agent, 5);
    assert_eq!((number(&agent, "reader/seen/alive"), number(&agent, "reader/seen/stale")), (0, 1));
    let plugins = agent.composer().plugins();
    let plugin = plugins.iter().find(|plugin| plugin.name == "counter").unwrap();
    assert!(!plugin.loaded && plugin.modules.is_empty());
    assert_eq!(plugin.kinds, ["counter"], "what it brings is known from its file");
    assert_eq!(agent.composer().load("counter").unwrap().modules, ["counter"]);
    step(&mut agent, 4);
    assert_eq!(number(&agent, "reader/seen/value"), 4);
    assert_eq!((number(&agent, "reader/seen/alive"), number(&agent, "reader/seen/stale")), (1, 0));
    assert_eq!(number(&agent, "reader/seen/generation"), 1);
}

#[test]
fn threads_see_a_module_come_and_go_too() {
    let text = robot(&plain())
        .replace("[modules.counter]", "load = false\n[modules.counter]\nevery = \"2ms\"")
        .replace("[modules.reader]", "[modules.reader]\non = \"input\"");
    let running = Running::start(&text, Mode::Threaded, &[]);
    for generation in 1..4 {
        running.composer.load("counter").unwrap();
        until("values of the module that came", || {
            running.value("reader/seen/generation") == generation && running.value("reader/seen/value") > 5
        });
        running.composer.unload("counter").unwrap();
        until("the safe value", || running.value("reader/seen/value") == 0);
    }
    running.stop();
}

#[test]
fn an_unloaded_modules_values_become_safe_and_stale() {
    let mut agent = lockstep(&robot(&plain()));
    step(&mut agent, 3);
    assert_eq!(number(&agent, "reader/seen/generation"), 1);
    agent.composer().unload("counter").unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "reader/seen/value"), 0, "the safe value");
    assert_eq!((number(&agent, "reader/seen/alive"), number(&agent, "reader/seen/stale")), (0, 1));
    assert_eq!(number(&agent, "reader/seen/generation"), 1, "which the old writer set");
    let (property, _) = agent.board().find("counter/count").unwrap();
    assert!(!property.has_writer());
    agent.composer().load("counter").unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "reader/seen/generation"), 2);
    assert_eq!(number(&agent, "reader/seen/value"), 1, "it begins afresh");
    assert_eq!((number(&agent, "reader/seen/alive"), number(&agent, "reader/seen/stale")), (1, 0));
}

#[test]
fn an_unloaded_module_leaves_only_what_others_read() {
    let text = library("counter", &plain()) + "[modules.counter]\n[modules.alone]\nkind = \"counter\"\n";
    let mut agent = lockstep(&text);
    step(&mut agent, 2);
    agent.composer().unload("counter").unwrap();
    let mut left: Vec<String> = agent.board().properties().iter().map(|p| p.path().to_owned()).collect();
    left.retain(|path| path.starts_with("counter/") || path.starts_with("alone/"));
    assert_eq!(left, ["alone/state", "counter/state"]);
    for module in ["alone", "counter"] {
        let (condition, _) = agent.board().read(&format!("{module}/state/condition")).unwrap().unwrap();
        assert_eq!(condition.as_str(), Some("UNLOADED"));
    }
    let mut agent = lockstep(&robot(&plain()));
    step(&mut agent, 2);
    agent.composer().unload("counter").unwrap();
    assert!(agent.board().find("counter/count").is_ok(), "the reader is still linked to it");
    assert!(agent.board().find("counter/params").is_err());
}

#[test]
fn loading_what_is_loaded_is_refused() {
    let agent = lockstep(&robot(&plain()));
    let composer = agent.composer();
    for refusal in [composer.load("counter").unwrap_err(), composer.load_library(&plain()).unwrap_err()] {
        assert_says(&complaint(&refusal), &["`counter` is already loaded", "reload it"]);
    }
}

#[test]
fn an_unknown_plugin_is_refused_with_the_nearest_names() {
    let agent = lockstep(&robot(&plain()));
    for refusal in [
        agent.composer().load("countr").unwrap_err(),
        agent.composer().unload("countr").unwrap_err(),
        agent.composer().reload("countr", None).unwrap_err(),
    ] {
        assert_says(&complaint(&refusal), &["no plugin `countr`", "nearest: counter", "[plugins]"]);
    }
}

#[test]
fn an_actuator_of_an_unloaded_module_gets_its_safe_command() {
    let text = library("counter", &plain())
        + &library("dependent", &libraries().other("dependent"))
        + "[modules.pusher]\n[actuators.wheel]\ncommand = \"pusher/wheel\"\n";
    let mut agent = lockstep(&text);
    step(&mut agent, 2);
    assert_eq!(number(&agent, "wheel/command/value"), 3);
    agent.composer().unload("dependent").unwrap();
    step(&mut agent, 1);
    assert_eq!(number(&agent, "wheel/command/value"), 0);
    agent.composer().load("dependent").unwrap();
    step(&mut agent, 2);
    assert_eq!(number(&agent, "wheel/command/value"), 3);
}

#[test]
fn library_outline_is_read_without_loading() {
    let folder = Folder::new();
    let library = folder.copy(&plain());
    // More than there is memory for; none of it is on the disk.
    std::fs::File::options().write(true).open(&library).unwrap().set_len(1 << 38).unwrap();
    assert_eq!(LibraryOutline::read(&library).unwrap().name, "counter");
    let odd = folder.write("\u{1b}[2J.so", b"no library");
    let error = LibraryOutline::read(&odd).unwrap_err().to_string();
    assert!(error.contains("\\u{1b}[2J.so: is not a shared library"), "{error:?}");
}
