//! Decorators and built-in leaves.

use slate_behavior_tree::TreeExecutor;

use crate::common::{Answers, step, trace, tree};

#[test]
fn decorators_change_what_a_child_returns() {
    for (tag, succeeded, failed) in [
        ("Inverter", "Failed", "Succeeded"),
        ("ForceSuccess", "Succeeded", "Succeeded"),
        ("ForceFailure", "Failed", "Failed"),
        ("KeepRunningUntilFailure", "Running", "Failed"),
    ] {
        let found = trace(&format!("<{tag}><A/></{tag}>"), &[("A", "RSF")], 3);
        let expected =
            ["start A: Running".into(), format!("go on A: {succeeded}"), format!("start A: {failed}")];
        assert_eq!(found, expected, "{tag}");
    }
}

#[test]
fn repeat_and_retry_run_one_cycle_in_a_tick() {
    let found = trace("<Repeat num_cycles=\"2\"><A/></Repeat>", &[("A", "S")], 3);
    assert_eq!(found, ["start A: Running", "start A: Succeeded", "start A: Running"]);
    let found =
        trace("<RetryUntilSuccessful num_attempts=\"2\"><A/></RetryUntilSuccessful>", &[("A", "F")], 2);
    assert_eq!(found, ["start A: Running", "start A: Failed"]);
    let found = trace("<Repeat num_cycles=\"-1\"><A/></Repeat>", &[("A", "SSSF")], 4);
    assert_eq!(found[3], "start A: Failed");
}

#[test]
fn a_node_that_wants_another_tick_says_so() {
    let mut executor = TreeExecutor::new(tree("<Repeat num_cycles=\"2\"><A/></Repeat>"));
    let mut host = Answers::new(&[("A", "S")]);
    step(&mut executor, &mut host, 0);
    assert!(executor.wants_tick());
    step(&mut executor, &mut host, 0);
    assert!(!executor.wants_tick());
}

#[test]
fn a_timeout_halts_what_runs_too_long() {
    let found = trace("<Timeout msec=\"200\"><A/></Timeout>", &[], 4);
    assert_eq!(found, ["start A: Running", "go on A: Running", "halt A: Failed", "start A: Running"]);
    let found = trace("<Timeout msec=\"0\"><A/></Timeout>", &[], 9);
    assert_eq!(found[8], "go on A: Running");
}

#[test]
fn delay_and_sleep_wait_for_the_time_of_the_host() {
    let found = trace("<Delay delay_msec=\"150\"><A/></Delay>", &[("A", "S")], 4);
    assert_eq!(found, [": Running", ": Running", "start A: Succeeded", ": Running"]);
    assert_eq!(trace("<Sleep msec=\"150\"/>", &[], 3), [": Running", ": Running", ": Succeeded"]);
}

#[test]
fn a_halted_timer_begins_anew() {
    let node = "<ReactiveFallback><P/><Delay delay_msec=\"150\"><A/></Delay></ReactiveFallback>";
    let found = trace(node, &[("P", "FFSFFF"), ("A", "S")], 6);
    assert_eq!(found[2], "ask P: Succeeded");
    assert_eq!(found[3..], ["ask P: Running", "ask P: Running", "ask P, start A: Succeeded"]);
}

#[test]
fn run_once_skips_or_repeats_its_result() {
    let found = trace("<RunOnce><A/></RunOnce>", &[("A", "F")], 2);
    assert_eq!(found, ["start A: Failed", ": Skipped"]);
    let found = trace("<RunOnce then_skip=\"false\"><A/></RunOnce>", &[("A", "F")], 2);
    assert_eq!(found, ["start A: Failed", ": Failed"]);
}

#[test]
fn a_halted_precondition_is_evaluated_again() {
    let node = "<Sequence>\
                  <RunOnce><Script code=\"is_free := true\"/></RunOnce>\
                  <ReactiveFallback>\
                    <P _onSuccess=\"is_free = false\"/>\
                    <Precondition if=\"is_free\" else=\"FAILURE\"><A/></Precondition>\
                  </ReactiveFallback>\
                </Sequence>";
    let found = trace(node, &[("P", "FSF")], 3);
    assert_eq!(found, ["ask P, start A: Running", "ask P, halt A: Succeeded", "ask P: Failed"]);
}

#[test]
fn entries_are_set_copied_and_unset() {
    let node = "<Sequence>\
                  <SetBlackboard value=\"41\" output_key=\"x\"/><Script code=\"x += 1\"/>\
                  <SetBlackboard value=\"{x}\" output_key=\"y\"/><A n=\"{y}\"/>\
                  <UnsetBlackboard key=\"y\"/><B n=\"{y}\"/>\
                </Sequence>";
    assert_eq!(trace(node, &[("A", "S"), ("B", "S")], 1), ["start A n=42, start B: Succeeded"]);
}
