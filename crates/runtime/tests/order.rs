//! In which order modules of a stage run, beyond what plain links say.

use crate::common;

use common::{lockstep, number};

#[test]
fn a_reader_of_a_command_that_passed_runs_after_its_commander() {
    // By name it would run before.
    let mut agent = lockstep(
        r#"
[modules.counter]
[modules.driver]
[modules.a]
kind = "relay"
stage = "Act"
[links]
"driver/input" = "counter/number"
"a/input" = "wheel/command"
[actuators.wheel]
command = "driver/wheel"
"#,
    );
    (0..3).for_each(|_| assert!(agent.step()));
    assert_eq!(number(&agent, "wheel/command/value"), 3.0);
    assert_eq!(number(&agent, "a/output/value"), 4.0);
}

#[test]
fn a_reader_of_the_last_command_runs_before_its_commander() {
    let mut agent = lockstep(
        r#"
[modules.counter]
[modules.driver]
[modules.z]
kind = "relay"
stage = "Act"
[links]
"driver/input" = "counter/number"
"z/input" = { from = "wheel/command", previous = true }
[actuators.wheel]
command = "driver/wheel"
"#,
    );
    (0..3).for_each(|_| assert!(agent.step()));
    assert_eq!(number(&agent, "z/output/value"), 3.0, "last cycle's 2 plus one");
}

#[test]
fn a_module_may_read_what_it_wrote_in_the_last_cycle() {
    let mut agent = lockstep(
        "[modules.relay]\nevery = \"1ms\"\n[links]\n\"relay/input\" = { from = \"relay/output\", previous = true }\n",
    );
    (0..5).for_each(|_| assert!(agent.step()));
    assert_eq!(number(&agent, "relay/output/value"), 5.0);
}

#[test]
fn a_sender_may_send_for_the_next_cycle() {
    let run = |link: &str| {
        let mut agent = lockstep(&format!(
            "[modules.sender]\n[modules.receiver]\nstage = \"Think\"\n[links]\n\"receiver/notes\" = {link}\n"
        ));
        (0..3).for_each(|_| assert!(agent.step()));
        number(&agent, "receiver/sum/first")
    };
    assert_eq!(run("\"sender/note\""), 6.0);
    assert_eq!(run("{ from = \"sender/note\", previous = true }"), 3.0);
}
