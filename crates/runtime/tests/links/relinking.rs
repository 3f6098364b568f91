//! Links that change while the agent runs.

use std::time::Duration;

use slate_runtime::configuration::{Configuration, SaveTo};
use slate_runtime::sharing::{RemoteDemand, RemotePath, Sharing, SharingError, Site};
use slate_runtime::{Agent, NewLink};
use slate_sorted::SortedMap;

use crate::links::common::number;
use crate::links::support::{agent, lockstep, steps};
use slate_runtime::Mode;

const TEXT: &str = r#"
[modules.a]
kind = "counter"
[modules.b]
kind = "dice"
[modules.relay]
inputs.input.value = 7.0
stage = "Think"
[modules.sum]
kind = "receiver"
[links]
# The relay follows the counter.
"relay/input" = "a/number"
"#;

fn link(agent: &Agent, to: &str, from: &str) {
    agent.composer().link(&NewLink::new(to, from)).unwrap();
}

#[test]
fn an_input_goes_over_to_another_output_and_its_module_goes_on() {
    let text = TEXT.replace("inputs.input.value = 7.0", "on = \"input\"");
    let mut agent = lockstep(&text);
    steps(&mut agent, 5);
    assert_eq!(number(&agent, "relay/output/value"), 6.0);
    let changes = agent.composer().link(&NewLink::new("/relay/input", "slate://test/b/number")).unwrap();
    assert_eq!(changes.len(), 1);
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "relay/output/value"), number(&agent, "b/number/value") + 1.0);
    assert_eq!(number(&agent, "relay/input/value"), number(&agent, "b/number/value"));
    let counts = agent.counts("relay").unwrap();
    assert_eq!(counts.0, 6, "no tick was lost or added, and the count goes on");
}

#[test]
fn an_input_without_a_link_has_its_value_again() {
    let text = TEXT.replace("[links]", "").replace("\"relay/input\" = \"a/number\"", "");
    let mut agent = lockstep(&text);
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "relay/output/value"), 8.0);
    link(&agent, "relay/input", "a/number");
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "relay/output/value"), 4.0);
    // It leaves nothing behind, as no file has it.
    let changes = agent.composer().unlink("relay/input").unwrap();
    let link = changes.iter().find(|change| change.path.starts_with("links"));
    assert!(link.is_some_and(|change| change.after.is_none()), "{changes:?}");
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "relay/output/value"), 8.0);
    // And it can be set by hand again.
    agent.board().write("relay/input/value", &slate_blackboard::interface::Value::Float(1.5), 0).unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "relay/output/value"), 2.5);
}

#[test]
fn unset_inputs_are_stale_and_zero_again() {
    let text = TEXT.replace("inputs.input.value = 7.0", "");
    let mut agent = lockstep(&text);
    steps(&mut agent, 3);
    agent.composer().unlink("relay/input").unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "relay/output/value"), 1.0);
    assert!(agent.board().read("relay/input").unwrap().is_none());
}

#[test]
fn a_dry_run_and_a_refusal_change_nothing() {
    let mut agent = lockstep(TEXT.replace("inputs.input.value = 7.0", "").as_str());
    steps(&mut agent, 1);
    let composer = agent.composer();
    assert_eq!(composer.check_link(&NewLink::new("relay/input", "b/number")).unwrap().len(), 1);
    assert_eq!(composer.check_unlink("relay/input").unwrap().len(), 1);
    let refused = |to: &str, from: &str, words: &[&str]| {
        for report in [
            composer.link(&NewLink::new(to, from)).unwrap_err(),
            composer.check_link(&NewLink::new(to, from)).unwrap_err(),
        ] {
            let text = format!("{report} {:?}", report.diagnostics()[0].help_text());
            words.iter().for_each(|word| assert!(text.contains(word), "{word}: {text}"));
        }
    };
    refused("relay/input", "a/numbr", &["no output `numbr`", "did you mean number?"]);
    refused("relay/input", "c/number", &["nothing is called `/c/number`", "did you mean a or b?"]);
    refused("relay/inptu", "a/number", &["`relay` has no port `inptu`", "did you mean input?"]);
    refused("rely/input", "a/number", &["no module owns `rely/input`", "did you mean relay?"]);
    refused("relay/input", "sum/sum", &["Number", "Pair"]);
    refused("relay/input", "slate://other/a/number", &["belongs to agent `other`"]);
    refused("slate://other/relay/input", "a/number", &["belongs to agent `other`"]);
    refused("relay/output", "a/number", &["`relay/output` is an output"]);
    refused("relay/input", "relay/output", &["cyclic dependency", "previous"]);
    let none = composer.unlink("sum/history").unwrap_err();
    assert!(none.to_string().contains("`sum/history` has no link"));
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "relay/output/value"), 3.0);
    assert_eq!(composer.links().len(), 1);
    assert!(agent.database().unwrap().diff().is_empty());
}

#[test]
fn a_refusal_of_a_file_has_a_caret() {
    let mut agent = lockstep(TEXT.replace("inputs.input.value = 7.0", "").as_str());
    steps(&mut agent, 1);
    let report = agent.database().unwrap().set(&[("links.\"relay/input\"", "b/nmber")]).unwrap_err();
    let text = report.render(false);
    assert!(text.contains("`b` has no output `nmber`") && text.contains("here"), "{text}");
}

#[test]
fn the_order_of_the_modules_follows_the_links() {
    // By its name it comes before what it reads.
    let text = r#"
[modules.z]
kind = "counter"
stage = "Think"
[modules.a]
kind = "relay"
stage = "Think"
"#;
    let mut agent = lockstep(&text.replace("[modules.a]", "[modules.a]\non = \"input\""));
    steps(&mut agent, 2);
    link(&agent, "a/input", "z/number");
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "a/output/value"), 4.0, "this cycle's value");
    let previous = NewLink::new("a/input", "z/number").previous(true).stale(Duration::from_millis(200));
    agent.composer().link(&previous).unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "a/output/value"), 4.0, "last cycle's value");
    let links = agent.composer().links();
    let said: Vec<_> = links[0].options.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
    assert_eq!(said, [("previous", "true"), ("stale", "\"200000000ns\"")]);
    // Options of the link before do not stay.
    link(&agent, "a/input", "z/number");
    assert!(agent.composer().links()[0].options.is_empty());
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "a/output/value"), 6.0);
}

#[test]
fn queues_outboxes_and_switches_are_linked_too() {
    let text = r#"
[modules.a]
kind = "counter"
[modules.b]
kind = "counter"
[modules.sender]
[modules.sum]
kind = "receiver"
[links]
"sum/history" = "a/number"
"#;
    let mut agent = lockstep(text);
    steps(&mut agent, 3);
    let read = |agent: &Agent, field: &str| number(agent, &format!("sum/sum/{field}"));
    assert_eq!((read(&agent, "first"), read(&agent, "second")), (0.0, 6.0));
    link(&agent, "sum/notes", "sender/note");
    steps(&mut agent, 2);
    assert_eq!((read(&agent, "first"), read(&agent, "second")), (9.0, 15.0), "the queue's cursor goes on");
    agent.composer().unlink("sum/notes").unwrap();
    agent.composer().unlink("sum/history").unwrap();
    steps(&mut agent, 2);
    assert_eq!((read(&agent, "first"), read(&agent, "second")), (9.0, 15.0));
}

#[test]
fn an_outbox_goes_over_to_another_inbox_and_other_senders_stay() {
    let text = r#"
[modules.a]
kind = "counter"
[modules.sender]
[modules.second]
kind = "sender"
[modules.sum]
kind = "receiver"
[modules.other]
kind = "receiver"
[links]
"sum/notes" = ["sender/note", "second/note"]
"#;
    let mut agent = lockstep(text);
    let inboxes = |agent: &Agent| {
        let links = agent.composer().links().into_iter().filter(|link| link.sends);
        links.map(|link| (link.from, link.to)).collect::<SortedMap<_, _>>()
    };
    let both = |of_sender: &str| {
        let links = [("/sender/note", of_sender), ("/second/note", "sum/notes")];
        links.map(|(from, to)| (from.to_owned(), to.to_owned())).into()
    };
    steps(&mut agent, 1);
    agent.composer().check_link(&NewLink::new("other/notes", "sender/note")).unwrap();
    assert_eq!(inboxes(&agent), both("sum/notes"));
    for to in ["other/notes", "sum/notes", "other/notes"] {
        link(&agent, to, "sender/note");
        assert_eq!(inboxes(&agent), both(to));
        steps(&mut agent, 1);
    }
    // What can't be linked leaves the link as it is.
    agent.composer().link(&NewLink::new("a/number", "sender/note")).unwrap_err();
    agent.composer().link(&NewLink::new("other/nots", "sender/note")).unwrap_err();
    assert_eq!(inboxes(&agent), both("other/notes"));
}

#[test]
fn value_options_are_refused_for_messages() {
    let text = r#"
[modules.a]
kind = "counter"
[modules.sender]
[modules.sum]
kind = "receiver"
"#;
    let mut agent = lockstep(text);
    steps(&mut agent, 1);
    let options = [("every", "3"), ("when", "\"value > 1\""), ("stale", "\"1s\"")];
    for (option, value) in options {
        let link = NewLink::new("sum/notes", "sender/note").with(option, value);
        let report = agent.composer().link(&link).unwrap_err().to_string();
        assert!(report.contains(&format!("`{option}` has no meaning for messages")), "{report}");
    }
    link(&agent, "sum/notes", "sender/note");
}

/// Shares with agents that never come.
struct Nobody;

impl Sharing for Nobody {
    fn start(&mut self, _: Site) -> Result<(), SharingError> {
        Ok(())
    }

    fn set_demands(&mut self, _: SortedMap<RemotePath, RemoteDemand>) {}
}

#[test]
fn saved_links_keep_comments() {
    let folder = std::env::temp_dir().join(format!("slate-links-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("robot.toml");
    let text = format!("time.source = \"a\"\n{}", TEXT.replace("inputs.input.value = 7.0", ""));
    std::fs::write(&file, text).unwrap();
    let database =
        slate_runtime::configuration::Database::open(&file, slate_runtime::configuration::Options::default())
            .unwrap();
    let options = slate_runtime::Options {
        rate: slate_runtime::Rate::Max,
        sharing: Some(Box::new(Nobody)),
        ..slate_runtime::Options::default()
    };
    let agent = Agent::load_with(&database, &crate::links::support::all(), options).unwrap();
    link(&agent, "relay/input", "b/number");
    database.save(SaveTo::Origin).unwrap();
    let saved = std::fs::read_to_string(&file).unwrap();
    assert!(saved.contains("# The relay follows the counter.\n\"relay/input\" = \"/b/number\""), "{saved}");
    agent.composer().link(&NewLink::new("relay/input", "a/number").with("every", "2")).unwrap();
    database.save(SaveTo::Origin).unwrap();
    let saved = std::fs::read_to_string(&file).unwrap();
    assert!(saved.contains("# The relay follows the counter.") && saved.contains("every = 2"), "{saved}");
    let saved = || {
        database.save(SaveTo::Origin).unwrap();
        let saved = std::fs::read_to_string(&file).unwrap();
        assert!(saved.contains("# The relay follows the counter."), "{saved}");
        saved
    };
    agent.composer().unlink("relay/input").unwrap();
    assert!(!saved().contains("b/number"));
    link(&agent, "relay/input/value", "b/number/value");
    assert!(saved().contains("b/number/value"));
    agent.composer().unlink("relay/input/value").unwrap();
    assert!(!saved().contains("b/number"));
    let elsewhere = NewLink::new("relay/input", "slate://other/b/number").with("rate", "\"20Hz\"");
    agent.composer().link(&elsewhere).unwrap();
    let text = saved();
    assert!(text.contains("slate://other/b/number") && text.contains("rate = \"20Hz\""), "{text}");
    drop(Configuration::load(&file, &Default::default()).unwrap());
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_thread_is_woken_by_what_it_is_linked_to() {
    let text = r#"
[loop]
period = "2ms"
[modules.a]
kind = "counter"
[modules.relay]
"#;
    let mut agent = agent(text, Mode::Threaded);
    let composer = agent.composer();
    let stopper = agent.stopper();
    let board = std::sync::Arc::clone(agent.board());
    let run = std::thread::spawn(move || agent.run(Box::new(|_| slate_runtime::Control::Continue)));
    composer.link(&NewLink::new("relay/input", "a/number")).unwrap();
    let read = |path: &str| board.read(path).unwrap().and_then(|(value, _)| value.as_f64()).unwrap_or(0.0);
    let start = std::time::Instant::now();
    while read("relay/output/value") < 50.0 && start.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(read("relay/output/value") >= 50.0);
    composer.unlink("relay/input").unwrap();
    stopper.stop();
    run.join().unwrap().unwrap();
}

/// It reads what is written after its turn, which is news to it in the next cycle, whatever is linked in between.
#[test]
fn others_are_linked_otherwise_and_a_module_is_woken_as_before() {
    let text = "[modules.a]\nkind = \"counter\"\n[modules.b]\nkind = \"dice\"\n[modules.front]\nkind = \"relay\"\n\
                stage = \"PreLoop\"\n[modules.relay]\n[links]\n\"front/input\" = \"a/number\"\n\"relay/input\" = \"a/number\"\n";
    let mut agent = lockstep(text);
    steps(&mut agent, 5);
    assert_eq!(agent.counts("front").unwrap().0, 4);
    link(&agent, "relay/input", "b/number");
    steps(&mut agent, 1);
    assert_eq!((agent.counts("front").unwrap().0, number(&agent, "front/output/value")), (5, 6.0));
}

#[test]
fn value_of_last_cycle_wakes_once_when_seen() {
    let text = "[modules.a]\nkind = \"counter\"\n[modules.relay]\nstage = \"Think\"\n[links]\n\
                \"relay/input\" = { from = \"a/number\", previous = true }\n";
    let mut agent = lockstep(text);
    steps(&mut agent, 1);
    assert_eq!(agent.counts("relay").unwrap().0, 0, "there was nothing in the last cycle");
    steps(&mut agent, 4);
    assert_eq!((agent.counts("relay").unwrap().0, number(&agent, "relay/output/value")), (4, 5.0));
    agent.database().unwrap().set(&[("modules.a.enabled", "false")]).unwrap();
    steps(&mut agent, 3);
    // The last number, and the safe value.
    assert_eq!(agent.counts("relay").unwrap().0, 6);
}

/// A counter, and two relays of which one follows the other's input.
const THROUGH: &str = r#"
[modules.a]
kind = "counter"
[modules.relay]
stage = "Think"
[modules.second]
kind = "relay"
stage = "Act"
[modules.sum]
kind = "receiver"
[links]
"relay/input" = { from = "a/number", previous = true }
"#;

#[test]
fn an_input_of_the_last_cycle_is_read_through_as_it_is() {
    let written = lockstep(&format!("{THROUGH}\"second/input\" = \"relay/input\"\n"));
    let linked = lockstep(THROUGH);
    link(&linked, "second/input", "relay/input");
    for mut agent in [written, linked] {
        for cycle in 2..6 {
            steps(&mut agent, if cycle == 2 { 2 } else { 1 });
            assert_eq!(number(&agent, "a/number/value"), f64::from(cycle));
            let outputs = ["relay", "second"].map(|it| number(&agent, &format!("{it}/output/value")));
            assert_eq!(outputs, [f64::from(cycle); 2], "both have last cycle's number");
        }
        // The same as its link changes.
        link(&agent, "relay/input", "a/number");
        steps(&mut agent, 1);
        let outputs = ["relay", "second"].map(|it| number(&agent, &format!("{it}/output/value")));
        assert_eq!(outputs, [7.0; 2], "both have this cycle's number");
        agent.composer().link(&NewLink::new("relay/input", "a/number").previous(true)).unwrap();
        steps(&mut agent, 1);
        let outputs = ["relay", "second"].map(|it| number(&agent, &format!("{it}/output/value")));
        assert_eq!(outputs, [7.0; 2]);
    }
}

#[test]
fn a_queue_of_some_values_is_no_source_of_a_link() {
    let agent = lockstep(THROUGH);
    agent.composer().link(&NewLink::new("sum/history", "a/number").with("every", "2")).unwrap();
    let report = agent.composer().link(&NewLink::new("second/input", "sum/history")).unwrap_err();
    let text = format!("{report} {:?}", report.diagnostics()[0].help_text());
    for word in ["`/sum/history` takes only some values of `/a/number`", "link to `/a/number`"] {
        assert!(text.contains(word), "{word}: {text}");
    }
}
