//! Plugins that need each other, and lists of plugins.

use slate_runtime::PluginError;
use slate_runtime::configuration::Configuration;

use crate::fixtures::libraries;
use crate::support::*;

fn names(agent: &slate_runtime::Agent) -> Vec<String> {
    let libraries =
        agent.composer().plugins().into_iter().filter(|plugin| plugin.loaded && plugin.file.is_some());
    libraries.map(|plugin| plugin.name).collect()
}

#[test]
fn a_plugin_brings_those_that_it_needs_before_it() {
    let text = dormant("counter", &plain()) + &dormant("dependent", &libraries().other("dependent"));
    let agent = lockstep(&text);
    assert!(names(&agent).is_empty());
    let mut came = agent.composer().load("dependent").unwrap().modules;
    came.sort();
    assert_eq!(came, ["counter", "pusher"]);
    assert_eq!(names(&agent), ["counter", "dependent"]);
}

#[test]
fn a_plugin_that_needs_one_that_is_nowhere_is_refused() {
    let dependent = libraries().other("dependent");
    let agent = lockstep("");
    let refusal = agent.composer().load_library(&dependent).unwrap_err();
    assert_says(
        &complaint(&refusal),
        &["`dependent` needs plugin `counter`", "does not exist", "[plugins.counter]"],
    );
    assert!(names(&agent).is_empty());
    let refusal = try_lockstep(&library("dependent", &dependent)).unwrap_err();
    assert_says(&complaint(&refusal), &["`dependent` needs plugin `counter`"]);
}

#[test]
fn a_plugin_that_another_one_needs_stays() {
    let text = library("counter", &plain()) + &library("dependent", &libraries().other("dependent"));
    let mut agent = lockstep(&text);
    let refusal = agent.composer().unload("counter").unwrap_err();
    assert!(matches!(refusal, PluginError::Needed { .. }), "{refusal:?}");
    assert_says(&complaint(&refusal), &["`counter` is needed by dependent", "unload those first"]);
    step(&mut agent, 1);
    agent.composer().unload("dependent").unwrap();
    agent.composer().unload("counter").unwrap();
    assert!(names(&agent).is_empty());
}

#[test]
fn plugins_that_need_each_other_are_refused_with_their_circle() {
    let (left, right) = (libraries().other("left"), libraries().other("right"));
    let text = dormant("left", &left) + &dormant("right", &right);
    let agent = lockstep(&text);
    let refusal = agent.composer().load("left").unwrap_err();
    assert_says(&complaint(&refusal), &["left -> right -> left", "remove one dependency"]);
    let refusal = agent.composer().load_library(&right).unwrap_err();
    assert_says(&complaint(&refusal), &["right -> left -> right"]);
    assert!(names(&agent).is_empty());
    let refusal = try_lockstep(&text.replace("load = false", "")).unwrap_err();
    assert_says(&complaint(&refusal), &["left -> right -> left"]);
}

#[test]
fn a_reload_can_bring_no_circle() {
    let text = library("counter", &plain()) + &library("dependent", &libraries().other("dependent"));
    let mut agent = lockstep(&text);
    step(&mut agent, 2);
    let refusal = agent.composer().reload("counter", Some(&libraries().counter("circle"))).unwrap_err();
    assert!(matches!(refusal, PluginError::Circle { .. }), "{refusal:?}");
    assert_says(&complaint(&refusal), &["counter -> dependent -> counter"]);
    step(&mut agent, 1);
    agent.composer().unload("dependent").unwrap();
    agent.composer().unload("counter").unwrap();
}

#[test]
fn a_list_of_plugins_is_loaded_in_order_and_unloaded_in_reverse() {
    let text = dormant("counter", &plain())
        + &dormant("dependent", &libraries().other("dependent"))
        + &dormant("smoother", &libraries().other("smoother"))
        + "[plugins.base]\nplugins = [\"smoother\", \"counter\"]\nload = false\n"
        + "[plugins.all]\nplugins = [\"base\", \"dependent\"]\nload = false\n";
    let agent = lockstep(&text);
    assert!(names(&agent).is_empty());
    agent.composer().load("all").unwrap();
    assert_eq!(names(&agent), ["smoother", "counter", "dependent"]);
    let left = agent.composer().unload("all").unwrap();
    let left: Vec<_> = left.into_iter().map(|(name, _)| name).collect();
    assert_eq!(left, ["dependent", "counter", "smoother"]);
    agent.composer().load("counter").unwrap();
    agent.composer().load("all").unwrap();
    assert_eq!(names(&agent), ["counter", "smoother", "dependent"], "what is there already stays");
}

#[test]
fn a_list_is_loaded_whole_or_not_at_all() {
    let text = dormant("counter", &plain())
        + &dormant("broken", &libraries().other("bare"))
        + "[plugins.all]\nplugins = [\"counter\", \"broken\"]\nload = false\n";
    let agent = lockstep(&text);
    let refusal = agent.composer().load("all").unwrap_err();
    assert_says(&complaint(&refusal), &["libbare.so", "no section `.slate`"]);
    assert!(names(&agent).is_empty());
}

#[test]
fn a_list_that_contains_itself_is_refused_with_its_circle() {
    let text = "[plugins.a]\nplugins = [\"b\"]\nload = false\n[plugins.b]\nplugins = [\"a\"]\nload = false\n";
    let refusal = Configuration::from_text("test.toml", text, &Default::default()).unwrap_err();
    assert_says(&refusal.to_string(), &["test.toml:2:12", "a -> b -> a", "take it out of the list"]);
    let own = Configuration::from_text("test.toml", "[plugins.a]\nplugins = [\"a\"]", &Default::default());
    assert_says(&own.unwrap_err().to_string(), &["test.toml:2:12", "a -> a"]);
}

#[test]
fn changes_of_an_absent_plugin_or_a_list_are_refused() {
    let text = dormant("counter", &plain())
        + &dormant("smoother", &libraries().other("smoother"))
        + "[plugins.all]\nplugins = [\"counter\", \"smoother\"]\nload = false\n"
        + "[plugins.reader]\nload = false\n[plugins.nothing]\nload = false\n";
    let agent = lockstep(&text);
    let composer = agent.composer();
    let refusals = |name: &str| {
        let reload = composer.reload(name, None).unwrap_err();
        let shadow = composer.shadow(name, &plain()).unwrap_err();
        let (end, promote) = (composer.end_shadow(name).unwrap_err(), composer.promote(name).unwrap_err());
        let unload = composer.unload(name).unwrap_err();
        [unload, reload, shadow, end, promote].map(|refusal| complaint(&refusal))
    };
    for refusal in refusals("counter") {
        assert_says(&refusal, &["plugin `counter` is not loaded", "slate plugin load counter"]);
    }
    for loaded in [false, true] {
        let [unload, exchanges @ ..] = refusals("all");
        assert_says(&unload, &["no plugin of the list `all` is loaded", "slate plugin load all"]);
        for refusal in exchanges {
            assert_says(&refusal, &["`all` is a list of plugins", "each of its plugins: counter, smoother"]);
        }
        if !loaded {
            composer.load("all").unwrap();
            assert_says(&complaint(&composer.reload("all", None).unwrap_err()), &["counter, smoother"]);
            composer.unload("all").unwrap();
        }
    }
    for refusal in refusals("countr") {
        assert_says(&refusal, &["no plugin `countr`; nearest: counter"]);
    }
    assert_says(&complaint(&composer.load("nothing").unwrap_err()), &["`nothing` has neither a file nor"]);
    // One that is linked in is found without a file.
    let reader = composer.plugins().into_iter().find(|plugin| plugin.name == "reader").unwrap();
    assert!(reader.loaded);
    composer.unload("reader").unwrap();
    assert_says(&complaint(&composer.unload("reader").unwrap_err()), &["`reader` is not loaded"]);
    composer.load("reader").unwrap();
}

#[test]
fn a_list_loads_missing_plugins_and_each_is_listed_once() {
    let text = library("counter", &plain())
        + &dormant("smoother", &libraries().other("smoother"))
        + "[plugins.all]\nplugins = [\"counter\", \"smoother\"]\n";
    let agent = lockstep(&text);
    let listed = || {
        let mut plugins: Vec<_> =
            agent.composer().plugins().into_iter().map(|plugin| (plugin.name, plugin.loaded)).collect();
        plugins.retain(|(name, _)| ["counter", "smoother"].contains(&name.as_str()));
        plugins.sort();
        plugins
    };
    assert_eq!(listed(), [("counter".into(), true), ("smoother".into(), true)]);
    agent.composer().unload("smoother").unwrap();
    assert_eq!(listed(), [("counter".into(), true), ("smoother".into(), false)]);
}
