//! Guarantees of lockstep: order by links, the same bytes again, and faults that stay where they are.

use crate::common;

use common::{complaint, lockstep, number};
use slate_runtime::Agent;

const CHAIN: &str = r#"
[modules.counter]
[modules.b]
kind = "relay"
[modules.a]
kind = "relay"
[links]
"b/input" = "counter/number"
"a/input" = "b/output"
"#;

#[test]
fn a_chain_is_run_in_the_order_of_its_links_within_one_cycle() {
    let mut agent = lockstep(CHAIN);
    agent.step();
    agent.step();
    assert_eq!(number(&agent, "counter/number/value"), 2.0);
    assert_eq!(number(&agent, "b/output/value"), 3.0);
    assert_eq!(number(&agent, "a/output/value"), 4.0);
    // An input's URL shows what it reads.
    assert_eq!(number(&agent, "a/input/value"), 3.0);
}

#[test]
fn a_link_marked_previous_reads_the_last_cycle() {
    let mut agent = lockstep(
        &CHAIN.replace(r#""a/input" = "b/output""#, r#""a/input" = { from = "b/output", previous = true }"#),
    );
    for _ in 0..3 {
        agent.step();
    }
    assert_eq!(number(&agent, "b/output/value"), 4.0);
    assert_eq!(number(&agent, "a/output/value"), 4.0, "last cycle's 3 plus one");
}

#[test]
fn a_cycle_of_links_is_refused_by_name() {
    let text = complaint(
        r#"
[modules.a]
kind = "relay"
[modules.b]
kind = "relay"
[links]
"a/input" = "b/output"
"b/input" = "a/output"
"#,
    );
    assert!(
        text.contains("test.toml:8")
            && text.contains("cyclic dependency")
            && text.contains("`previous = true`"),
        "{text}"
    );
}

#[test]
fn messages_and_queues_deliver_every_value_in_order() {
    let mut agent = lockstep(
        r#"
[modules.counter]
[modules.sender]
[modules.receiver]
[links]
"receiver/notes" = "sender/note"
"receiver/history" = "counter/number"
"#,
    );
    for _ in 0..4 {
        agent.step();
    }
    assert_eq!(number(&agent, "receiver/sum/first"), 10.0);
    assert_eq!(number(&agent, "receiver/sum/second"), 10.0);
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let run = |seed: u64| {
        let mut agent = lockstep(&format!("agent.seed = {seed}\n[modules.dice]\n[modules.counter]\n"));
        for _ in 0..100 {
            agent.step();
        }
        agent.digest().unwrap()
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn another_module_changes_no_random_numbers() {
    let run = |more: &str| {
        let mut agent = lockstep(&format!("[modules.dice]\n{more}"));
        agent.step();
        number(&agent, "dice/number/value")
    };
    assert_eq!(run(""), run("[modules.aaa]\nkind = \"dice\"\n"));
}

#[test]
fn a_panic_stays_in_its_module_and_its_outputs_become_safe() {
    let mut agent = lockstep(&CHAIN.replace("[modules.counter]", "[modules.counter]\nparams.panic_at = 2"));
    agent.step();
    agent.step();
    assert_eq!(number(&agent, "counter/number/value"), -1.0, "the safe value");
    assert_eq!(number(&agent, "b/output/value"), 0.0, "the others go on");
    agent.step();
    assert_eq!(number(&agent, "counter/number/value"), 1.0, "started anew");
    assert_eq!(agent.counts("counter"), Some((3, 0, 1)));
}

#[test]
fn enabled_is_enforced() {
    let mut agent = lockstep(CHAIN);
    agent.step();
    agent
        .board()
        .write("counter/enabled/value", &slate_blackboard::interface::Value::Bool(false), 0)
        .unwrap();
    for _ in 0..5 {
        agent.step();
    }
    assert_eq!(agent.counts("counter").unwrap().0, 1);
    assert_eq!(
        number(&agent, "counter/number/value"),
        -1.0,
        "a module that is switched off leaves safe values"
    );
}

/// It may have ticked long before, or never.
#[test]
fn effects_of_switch_have_time_of_switch() {
    let mut agent = lockstep("[modules.counter]\nevery = \"1s\"\nenabled = false\n");
    let time = |agent: &Agent, path: &str| agent.board().read(path).unwrap().unwrap().1.time;
    for on in [true, false] {
        for _ in 0..10 {
            agent.step();
        }
        agent.composer().enable("counter", on).unwrap();
        agent.step();
        let now = agent.now();
        assert!(now > 0);
        assert_eq!(time(&agent, "counter/state"), now, "{on}");
        assert_eq!(time(&agent, "counter/number"), now, "a number, or the safe one");
    }
}

#[test]
fn a_value_that_stops_becomes_stale() {
    let mut agent = lockstep(&CHAIN.replace("[modules.counter]", "[modules.counter]\nevery = \"1s\""));
    for _ in 0..20 {
        agent.step();
    }
    let relay = agent.board().read("b/output").unwrap().unwrap();
    assert_eq!(relay.1.sequence, 1, "it runs on new input only");
}

#[test]
fn periods_do_not_drift() {
    let mut agent = lockstep("loop.period = \"20ms\"\n[modules.counter]\nevery = \"50ms\"\n");
    for _ in 0..501 {
        agent.step();
    }
    assert_eq!(agent.counts("counter").unwrap().0, 201, "10 s at 20 Hz, from time 0");
}

#[test]
fn every_module_shows_its_state_and_its_timing() {
    let mut agent = lockstep(&CHAIN.replace("[modules.counter]", "[modules.counter]\nparams.panic_at = 12"));
    for _ in 0..11 {
        agent.step();
    }
    let text = |agent: &slate_runtime::Agent, path: &str| agent.board().read(path).unwrap().unwrap().0;
    assert_eq!(text(&agent, "counter/state/condition").as_str(), Some("WORKING"));
    assert_eq!(number(&agent, "counter/timing/period"), 20e6);
    assert_eq!(number(&agent, "counter/timing/jitter"), 0.0);
    agent.step();
    assert_eq!(text(&agent, "counter/state/condition").as_str(), Some("FAILED"));
    assert_eq!(number(&agent, "counter/state/panics"), 1.0);
}
