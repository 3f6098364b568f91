//! Settings that tools change while the agent runs.

use super::*;

#[test]
fn several_parameters_change_in_one_write_and_are_listed() {
    let (mut agent, _server, mut client) = open("write");
    agent.step();
    assert_eq!(number(&agent, "teller/told/first"), 2.0);
    let before = sequence(&agent, "teller/params");
    let changes = [change("modules.teller.params.first", "3"), change("modules.teller.params.second", "4.5")];
    let changed = client.set(&changes).unwrap();
    assert_eq!(changed.len(), 2);
    assert_eq!((changed[0].before.as_deref(), changed[0].after.as_deref()), (Some("2.0"), Some("3")));
    assert_eq!(sequence(&agent, "teller/params"), before + 1);
    agent.step();
    assert_eq!(number(&agent, "teller/told/first"), 3.0);
    assert_eq!(number(&agent, "teller/told/second"), 4.5);
    assert_eq!(number(&agent, "teller/params/third"), 7.0);

    let reading = client.read(&format!("slate://{}/teller/told", name("write"))).unwrap().unwrap();
    assert_eq!(reading.value, json!({ "first": 3.0, "second": 4.5 }));
    let settings = client.settings("modules.teller").unwrap();
    assert_eq!(settings[0].path, "modules.teller.params.first");
    assert_eq!((&settings[0].value, settings[0].text.as_str()), (&json!(3), "3"));
    let differences = client.differences().unwrap();
    assert_eq!(differences[0].file.as_deref(), Some("2.0"));
    assert_eq!((&differences[1].file, differences[1].default.as_deref()), (&None, Some("1.0")));
    assert_eq!((&changed[1].before, changed[1].default.as_deref()), (&None, Some("1.0")));
    // The text is not a file, so it stays as it is.
    assert!(refused(client.save(SaveTo::Origin)).message.contains("built in"));
}

#[test]
fn a_value_set_on_the_blackboard_survives_other_parameters() {
    let (agent, _server, mut client) = open("beside");
    let value = slate_module::blackboard::interface::Value::Float(9.0);
    agent.board().write("teller/params/second", &value, 0).unwrap();
    client.set(&[change("modules.teller.params.first", "3")]).unwrap();
    assert_eq!(number(&agent, "teller/params/second"), 9.0);
}

#[test]
fn a_tick_sees_all_of_a_change_or_nothing() {
    let (mut agent, _server, mut client) = open("atomic");
    client.set(&[change("modules.teller.params.first", "1")]).unwrap();
    let stopper = agent.stopper();
    let running = std::thread::spawn(move || {
        agent.run(Box::new(|_| Control::Continue)).unwrap();
        agent
    });
    for value in 2..200 {
        let value = value.to_string();
        let first = change("modules.teller.params.first", &value);
        client.set(&[first, change("modules.teller.params.second", &value)]).unwrap();
    }
    stopper.stop();
    let agent = running.join().unwrap();
    assert_eq!(number(&agent, "teller/apart/value"), 0.0);
    assert_eq!(number(&agent, "teller/params/first"), 199.0);
}

#[test]
fn an_invalid_setting_is_refused_whole_without_a_false_place() {
    let (agent, _server, mut client) = open("mismatch");
    let before = sequence(&agent, "teller/params");
    let mut refuse = |path: &str, value: &str, words: &[&str]| {
        let good = change("modules.teller.params.second", "5");
        let refusal = refused(client.set(&[good, change(path, value)]));
        let said = format!("{}; {}", refusal.message, refusal.help);
        for word in words {
            assert!(said.contains(word), "{word}: {said}");
        }
        assert!(refusal.message.contains(path), "of several, it says which: {refusal:?}");
        assert!(!refusal.help.is_empty() && !refusal.message.contains(&refusal.help), "{refusal:?}");
        assert!(refusal.report.is_none() && !said.contains("change:"), "{refusal:?}");
    };
    refuse("modules.teller.params.first", "-1", &["outside 0 to 1000000"]);
    refuse("modules.teller.params.frist", "1", &["no parameter `frist`", "did you mean `first`"]);
    refuse("modules.teller.params.first", "fast", &["`first` is f64"]);
    refuse("modules.teler.params.first", "1", &["teler", "did you mean `teller`"]);
    refuse("modules.teller.stage", "Act", &["can't change while the agent runs", "next start"]);
    refuse("loop.period", "10ms", &["`loop.period` can't change"]);
    refuse("agent.seed", "3", &["`agent.seed` can't change"]);
    refuse("modules.teller.inputs.inptu.value", "3", &["no input `inptu`"]);
    refuse("log.level", "loud", &["loud"]);
    assert_eq!(sequence(&agent, "teller/params"), before);
    assert!(client.differences().unwrap().is_empty());
}

#[test]
fn setting_to_present_value_is_no_difference() {
    let (_agent, _server, mut client) = open("same");
    let mut left = |changes: &[(&str, &str)]| {
        client.set(&changes.iter().map(|(path, value)| change(path, value)).collect::<Vec<_>>()).unwrap();
        client.differences().unwrap().into_iter().map(|different| different.path).collect::<Vec<_>>()
    };
    let (first, second) = ("modules.teller.params.first", "modules.teller.params.second");
    assert_eq!(left(&[(first, "3.0"), (second, "4.0")]), [first, second]);
    // The file says 2.0 of the first, and nothing of the second, whose default is 1.0.
    assert_eq!(left(&[(first, "2"), (second, "4.0")]), [second]);
    assert!(left(&[(second, "1")]).is_empty());
    assert_eq!(left(&[(second, "1.5")]), [second]);
}

#[test]
fn inputs_without_a_link_and_levels_of_the_log_change() {
    let log = MemoryTarget::default();
    let mut agent = load(&database("levels"), log.clone());
    let database = agent.database().unwrap().clone();
    agent.step();
    database.set(&[("modules.teller.inputs.input.value", "6"), ("log.levels.teller", "debug")]).unwrap();
    assert_eq!(number(&agent, "teller/input/value"), 6.0);
    agent.step();
    eventually(|| log.lines().iter().any(|line| line.to_string().contains("told")));
    let taken_back = database.revert("modules.teller.inputs").unwrap_err().to_string();
    assert!(taken_back.contains("can't be taken back"), "{taken_back}");
    // The agent goes, and judges nothing any more.
    drop(agent);
    database.set(&[("loop.period", "10ms")]).unwrap();
}

#[test]
fn modules_are_switched_by_name() {
    let (mut agent, _server, mut client) = open("switch");
    client.enable("teller", false).unwrap();
    agent.step();
    assert_eq!(agent.counts("teller").unwrap().0, 0);
    let teller = client.modules().unwrap().into_iter().find(|module| module.name == "teller").unwrap();
    assert_eq!((teller.kind.as_str(), teller.condition.as_str(), teller.ticks), ("teller", "INACTIVE", 0));
    assert_eq!(client.differences().unwrap()[0].path, "modules.teller.enabled");
    assert!(!client.enable("teller", false).unwrap().changed, "it is off already");
    let on = EnableResult { changed: true, needs_reload: None };
    assert_eq!(client.enable("teller", true).unwrap(), on);
    assert!(!client.enable("teller", true).unwrap().changed, "it is on already");
    assert!(client.differences().unwrap().is_empty(), "as the file says");
    agent.step();
    assert_eq!(agent.counts("teller").unwrap().0, 1);
}

#[test]
fn switching_what_does_nothing_is_refused() {
    let (mut agent, _server, mut client) = open("useless");
    for on in [true, false] {
        let unknown = refused(client.enable("telle", on));
        assert_eq!(unknown.message, "no module is called `telle`");
        assert_eq!(unknown.help, "did you mean teller?");
    }
    let clock = refused(client.enable("counter", false));
    assert!(clock.message.contains("`counter` is the time source"), "{clock:?}");
    assert!(agent.step());
    let before = agent.now();
    assert!(agent.step() && agent.now() > before, "time continues");
    // Each panic but the last one is followed by a fresh start.
    client.set(&[change("modules.teller.params.third", "13")]).unwrap();
    (0..20).for_each(|_| assert!(agent.step()));
    let teller = client.modules().unwrap().into_iter().find(|module| module.name == "teller").unwrap();
    assert_eq!(teller.condition, "FAULTED");
    let faulted = refused(client.enable("teller", true));
    assert!(faulted.message.contains("`teller` has failed for good"), "{faulted:?}");
    assert!(faulted.help.contains(&format!("slate plugin reload {}", teller.plugin)), "{faulted:?}");
    assert!(client.enable("teller", false).unwrap().changed, "off it can be");
    assert!(!client.enable("teller", false).unwrap().changed);
    let on = EnableResult { changed: true, needs_reload: Some(teller.plugin) };
    assert_eq!(client.enable("teller", true).unwrap(), on, "and on again, for when it is reloaded");
    assert_eq!(client.read("/teller/enabled/value").unwrap().unwrap().value, true);
    assert!(client.differences().unwrap().iter().all(|different| !different.path.ends_with("enabled")));
    refused(client.enable("teller", true));
    // What a link switches is switched by that alone, whatever it says at the moment.
    client.link("teller/enabled", "relay/enabled", &[], false).unwrap();
    for on in [true, false] {
        let linked = refused(client.enable("teller", on));
        assert!(linked.message.contains("switched by a link, from /relay/enabled"), "{linked:?}");
        assert!(linked.help.contains("slate unlink teller/enabled"), "{linked:?}");
    }
}

#[test]
fn parameters_of_an_absent_module_are_checked_by_its_last_kind() {
    let (_agent, _server, mut client) = open("away");
    let plugins = client.plugins().unwrap();
    let teller = plugins.iter().find(|plugin| plugin.modules == ["teller"]).unwrap().name.clone();
    client.unload(&teller).unwrap();
    let unknown = refused(client.set(&[change("modules.teller.params.nope", "1")]));
    assert!(unknown.message.contains("no parameter `nope`"), "{unknown:?}");
    let text = refused(client.set(&[change("modules.teller.params.first", "text")]));
    assert!(text.message.contains("`first` is f64"), "{text:?}");
    client.set(&[change("modules.teller.params.first", "3")]).unwrap();
    client.load(&teller).unwrap();
}

#[test]
fn changes_are_taken_back() {
    let (agent, _server, mut client) = open("back");
    let [first, second] = ["first", "second"].map(|name| format!("modules.teller.params.{name}"));
    client.set(&[change(&first, "3"), change(&second, "4")]).unwrap();
    let back = client.revert(&second).unwrap();
    assert_eq!((back.len(), &back[0].path), (1, &second));
    assert_eq!((number(&agent, "teller/params/first"), number(&agent, "teller/params/second")), (3.0, 1.0));
    client.revert("").unwrap();
    assert_eq!(number(&agent, "teller/params/first"), 2.0);
    assert!(client.differences().unwrap().is_empty() && client.revert("").unwrap().is_empty());
}
