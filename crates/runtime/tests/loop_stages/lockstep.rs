//! In lockstep all that happens is known to the cycle.

use super::*;

#[test]
fn the_stages_of_a_module_hold_from_the_cycle_after_its_claim() {
    let (mut agent, log) = lockstep("take_at = 3");
    assert_eq!(ticks_in(&mut agent, 2), all(2));
    assert_eq!(shown(agent.board()), ten());
    assert_eq!(ticks_in(&mut agent, 1), all(1), "in this cycle it takes the loop");
    // The cycles 4 to 23: in the even ones it acts.
    assert_eq!(ticks_in(&mut agent, 20), halves(20, 10));
    assert_eq!(number(&agent, "director/has/value"), 1.0);
    agent.publish_timing();
    assert_eq!(shown(agent.board()), ["Act", "Sense"]);
    let said = lines(&log, "main loop");
    assert_eq!(said, ["director has the main loop, with the stages Sense, Act"]);
    // What is measured of a stage stays with its name.
    step(&mut agent, 200);
    agent.publish_timing();
    assert!(number(&agent, "loop/Sense/histogram/count") > number(&agent, "loop/Act/histogram/count"));
}

#[test]
fn the_former_stages_hold_from_the_cycle_after_its_release() {
    for (how, said) in [
        ("give_at = 11", BACK),
        ("fail_at = 11", BACK),
        ("panic_at = 11", BACK),
        ("policy_panics_at = 11", "the policy of director panicked; it is not called any more"),
        (
            "policy_errs_at = 11",
            "the policy of director chose stage 7 of 2, from 0; it is not called any more",
        ),
    ] {
        let (mut agent, log) = lockstep(how);
        step(&mut agent, 10);
        // Without a policy the stages run in order.
        assert_eq!(ticks_in(&mut agent, 1), all(1), "{how}");
        assert_eq!(ticks_in(&mut agent, 20), all(20), "{how}");
        assert_eq!(shown(agent.board()), ten(), "{how}");
        assert_eq!(number(&agent, "director/has/value"), 0.0, "{how}");
        assert_eq!(lines(&log, said).len(), 1, "{how}: {:?}", lines(&log, "loop"));
        assert_eq!(lines(&log, BACK).len(), 1, "{how}");
        agent.publish_timing();
        let (count, _) = agent.board().read("loop/Think/histogram/count").unwrap().unwrap();
        assert!(count.as_f64() > Some(0.0), "what was measured before is still there");
    }
}

#[test]
fn a_module_switched_off_or_unloaded_restores_the_stages() {
    for forgets in [0, 5] {
        let (mut agent, log) = lockstep(&format!("policy_forgets_at = {forgets}"));
        step(&mut agent, 10);
        agent.composer().enable("director", false).unwrap();
        // Also when its policy gives it no turn in which it would see it.
        step(&mut agent, 1);
        assert_eq!(ticks_in(&mut agent, 20), all(20));
        assert_eq!((shown(agent.board()), lines(&log, BACK).len()), (ten(), 1));
    }
    let (mut agent, log) = lockstep("");
    step(&mut agent, 10);
    agent.composer().unload("director").unwrap();
    assert_eq!(shown(agent.board()), ten());
    assert_eq!(ticks_in(&mut agent, 20), all(20));
    assert_eq!(lines(&log, BACK).len(), 1);
    // And again, afresh.
    agent.composer().load("director").unwrap();
    assert_eq!(ticks_in(&mut agent, 1), all(1));
    assert_eq!(ticks_in(&mut agent, 20), halves(20, 10));
    assert_eq!(shown(agent.board()), ["Act", "Sense"]);
}

#[test]
fn invalid_stages_are_refused_with_the_reason() {
    let (mut agent, log) = lockstep("take_at = 0, refused_at = 2");
    assert_eq!(ticks_in(&mut agent, 20), all(20));
    assert_eq!((shown(agent.board()), number(&agent, "director/has/value")), (ten(), 0.0));
    let said = lines(&log, "refused: ");
    let name = "can't name a stage: expected up to 32 letters, digits and `_`";
    let expected = [
        "no stage of the loop runs the modules of PreLoop, SensorAcquire",
        "no stage of the loop runs the modules of ActExec, PostLoop",
        "two stages are named `All`",
        "the modules of Think would run both in `All` and in `Again`",
        name,
        name,
    ];
    assert_eq!(said.len(), expected.len());
    assert!(said.iter().zip(expected).all(|(said, expected)| said.contains(expected)), "{said:?}");
    // What it has meanwhile stays.
    let (mut agent, _) = lockstep("refused_at = 5");
    step(&mut agent, 10);
    assert_eq!(ticks_in(&mut agent, 20), halves(20, 10));
}

#[test]
fn a_module_takes_the_loop_with_stages_or_an_order_alone() {
    let (mut agent, log) = lockstep("one_at = 11, order_at = 21, give_at = 31");
    step(&mut agent, 11);
    assert_eq!(ticks_in(&mut agent, 9), all(9));
    assert_eq!(shown(agent.board()), ["One"]);
    step(&mut agent, 1);
    assert_eq!(ticks_in(&mut agent, 9), halves(9, 0));
    assert_eq!(shown(agent.board()), ten());
    step(&mut agent, 1);
    assert_eq!(ticks_in(&mut agent, 9), all(9));
    let said = lines(&log, "director has");
    assert_eq!(said.len(), 4, "{said:?}");
    assert_eq!(said[1], "director has the main loop, with the stages One");
    assert_eq!(said[2], "director has the main loop, and selects the next stage");
}

#[test]
fn wait_for_all_stages_covers_loops_stages() {
    let (mut agent, _) = lockstep("take_at = 0, one_at = 3, give_at = 6");
    let stages = agent.synchronization().point("/stage").unwrap();
    let think = agent.synchronization().point("/stage/Think/end").unwrap();
    for cycle in 1..=10 {
        let (all, one) = (stages.mark(), think.count());
        step(&mut agent, 1);
        stages.wait_all(&all, Duration::ZERO).unwrap();
        // In the cycles 4 to 6 another stage has its modules.
        assert_eq!(think.count() > one, !(4..=6).contains(&cycle), "{cycle}");
    }
}

/// Leaves out the stage `Late`.
struct NotLate;

impl LoopPolicy for NotLate {
    fn next(&mut self, place: &LoopPosition<'_>) -> Option<usize> {
        place.after.is_none().then(|| place.find("Early").unwrap_or_default())
    }
}

#[test]
fn stages_and_policy_set_by_the_program_meanwhile_return() {
    let (mut agent, _) = lockstep("give_at = 21");
    step(&mut agent, 10);
    let scheduled = |name: &str, members: &[Stage]| ScheduledStage {
        name: name.into(),
        members: members.into(),
        timeout: None,
    };
    let (early, late) = Stage::ALL.split_at(2);
    let schedule = Schedule::new(vec![scheduled("Early", early), scheduled("Late", late)]).unwrap();
    agent.composer().set_schedule(schedule);
    agent.composer().set_policy(Some(Box::new(NotLate)));
    assert_eq!(ticks_in(&mut agent, 10), halves(10, 5));
    assert_eq!(shown(agent.board()), ["Act", "Sense"]);
    step(&mut agent, 1);
    let expected = std::array::from_fn(|stage| if stage < 2 { 10 } else { 0 });
    assert_eq!(ticks_in(&mut agent, 10), expected);
    assert_eq!(shown(agent.board()), ["Early", "Late"]);
    agent.composer().set_policy(None);
    assert_eq!(ticks_in(&mut agent, 10), all(10));
}

#[test]
fn modules_come_and_go_while_a_module_has_the_loop() {
    let (mut agent, _) = lockstep("give_at = 31");
    step(&mut agent, 10);
    agent.composer().unload("worker").unwrap_err(); // One of them is the clock.
    let before = agent.counts("think").unwrap().0;
    agent.composer().enable("think", false).unwrap();
    step(&mut agent, 10);
    assert_eq!(agent.counts("think").unwrap().0, before);
    agent.composer().enable("think", true).unwrap();
    assert_eq!(ticks_in(&mut agent, 10), halves(10, 5));
    step(&mut agent, 1);
    assert_eq!(ticks_in(&mut agent, 10), all(10));
}

#[test]
fn of_two_modules_that_want_the_loop_one_is_refused() {
    let text = "[modules.a]\nkind = \"director\"\n[modules.b]\nkind = \"director\"\n";
    let Err(StartError::Configuration(report)) = load(text, Mode::Staged, Rate::Max) else {
        panic!("two modules can't have the loop");
    };
    assert!(report.to_string().contains("`a` and `b` both want the main loop"), "{report}");
}

#[test]
fn in_lockstep_stages_change_in_the_same_cycle_of_each_run() {
    let run = |workers: usize| {
        let log = MemoryTarget::default();
        let text = format!(
            "time.source = \"preloop\"\n[modules.director]\nparams = {{ take_at = 3, one_at = 11, give_at = 21 }}\n{}",
            self::workers()
        );
        let options = Options {
            rate: Rate::Max,
            workers,
            always_help: workers > 0,
            log: vec![Box::new(log.clone())],
            ..Options::default()
        };
        let plugins = [Plugin::linked::<Director>(), Plugin::linked::<Worker>()];
        let mut agent = Agent::load(&configuration(&text), &plugins, options).unwrap();
        step(&mut agent, 30);
        let lines = log.lines().into_iter().filter(|line| line.text.contains("main loop"));
        (lines.map(|line| (line.time, line.text)).collect::<Vec<_>>(), agent.digest())
    };
    let first = run(0);
    assert_eq!(first.0.iter().map(|(time, _)| time / 20_000_000).collect::<Vec<_>>(), [3, 11, 21]);
    for workers in [0, 0, 2] {
        assert_eq!(run(workers), first);
    }
}
