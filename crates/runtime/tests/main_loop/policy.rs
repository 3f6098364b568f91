use std::sync::{Arc, Mutex};

use slate_runtime::log::MemoryTarget;
use slate_runtime::{
    Agent, Control, End, LoopPolicy, LoopPosition, Options, Rate, STAGE_LIMIT, Schedule, Stage,
};

use super::{Collected, lines, load, lockstep, run, sense_act, ticks, wall_clock, witnesses};

fn two_stages() -> String {
    format!(
        "[loop]\nperiod = \"10ms\"\nstages = [\"Sense\", \"Act\"]\nmembers.Sense = {:?}\nmembers.Act = {:?}\n{}",
        Stage::ALL[..5].iter().map(|stage| stage.name()).collect::<Vec<_>>(),
        Stage::ALL[5..].iter().map(|stage| stage.name()).collect::<Vec<_>>(),
        witnesses(&[("sensor", "SensorAcquire"), ("motor", "ActExec")])
    )
}

/// What modules did in so many cycles.
fn in_cycles(agent: &mut Agent, cycles: u64) -> (u64, u64) {
    let before = (ticks(agent, "sensor"), ticks(agent, "motor"));
    run(agent, cycles);
    (ticks(agent, "sensor") - before.0, ticks(agent, "motor") - before.1)
}

/// Senses in every cycle, and acts in one of some.
fn acting(every: u64) -> Box<dyn LoopPolicy> {
    Box::new(By(move |place: &LoopPosition<'_>| match place.after {
        None => place.find("Sense"),
        Some(0) if place.cycle.is_multiple_of(every) => place.find("Act"),
        _ => None,
    }))
}

#[test]
fn a_stage_may_be_left_out_of_some_cycles() {
    let mut agent = lockstep(&two_stages());
    assert_eq!(in_cycles(&mut agent, 12), (12, 12), "without a policy both stages run");
    agent.composer().set_policy(Some(acting(3)));
    assert_eq!(in_cycles(&mut agent, 12), (12, 4));
    agent.composer().set_policy(None);
    assert_eq!(in_cycles(&mut agent, 12), (12, 12));
}

#[test]
fn the_loop_is_replaced_while_it_runs_and_back() {
    let text = witnesses(&[("sensor", "SensorAcquire"), ("motor", "ActExec")]);
    let (mut agent, _) = wall_clock(&format!("loop.period = \"1ms\"\n{text}"));
    let composer = agent.composer();
    let health = agent.composer();
    let stopper = agent.stopper();
    let made = move || {
        let modules = health.modules();
        let ticks = |name| modules.iter().find(|module| module.name == name).unwrap().ticks;
        (ticks("sensor"), ticks("motor"))
    };
    let watcher = std::thread::spawn(move || {
        let since = |before: (u64, u64)| move |now: (u64, u64)| (now.0 - before.0, now.1 - before.1);
        let wait = |cycles: u64| {
            let since = since(made());
            assert!(super::comes(|| since(made()).0 >= cycles));
            since(made())
        };
        let first = wait(20);
        composer.set_schedule(sense_act());
        composer.set_policy(Some(acting(1_000_000)));
        let sensing = wait(20);
        composer.set_policy(None);
        composer.set_schedule(Schedule::default());
        let last = wait(20);
        stopper.stop();
        [first, sensing, last]
    });
    assert_eq!(agent.run(Box::new(|_| Control::Continue)).unwrap(), End::Stopped);
    let [first, sensing, last] = watcher.join().unwrap();
    assert!(first.1 >= 19 && last.1 >= 19, "both stages: {first:?} {last:?}");
    assert!(sensing.1 <= 1, "only the first: {sensing:?}");
}

/// Chooses by a function.
struct By<F>(F);

impl<F: FnMut(&LoopPosition<'_>) -> Option<usize> + Send> LoopPolicy for By<F> {
    fn next(&mut self, place: &LoopPosition<'_>) -> Option<usize> {
        (self.0)(place)
    }
}

#[test]
fn a_policy_knows_the_stages_and_where_the_loop_stands() {
    let seen: Collected<(Option<usize>, u64, u64)> = Arc::default();
    let noted = Arc::clone(&seen);
    let mut agent = lockstep(&two_stages());
    let policy = By(move |place: &LoopPosition<'_>| {
        noted.lock().unwrap().push((place.after, place.now, place.cycle));
        // The stages in reverse order.
        match place.after {
            None => place.find("Act"),
            after if after == place.find("Act") => place.find("Sense"),
            _ => None,
        }
    });
    agent.composer().set_policy(Some(Box::new(policy)));
    run(&mut agent, 2);
    let ten = 10_000_000;
    let expected = [
        (None, 0, 1),
        (Some(1), 0, 1),
        (Some(0), 0, 1),
        (None, ten, 2),
        (Some(1), ten, 2),
        (Some(0), ten, 2),
    ];
    assert_eq!(*seen.lock().unwrap(), expected);
    assert_eq!(super::order(&agent, &["sensor", "motor"]), ["motor", "sensor"]);
}

#[test]
fn a_stage_may_come_again_in_a_cycle() {
    let mut agent = lockstep(&two_stages());
    let mut left = 0;
    let policy = By(move |place: &LoopPosition<'_>| {
        left = if place.after.is_none() { 3 } else { left - 1 };
        (left > 0).then_some(0)
    });
    agent.composer().set_policy(Some(Box::new(policy)));
    assert_eq!(in_cycles(&mut agent, 10), (30, 0));
}

/// Ten cycles with a policy that is at fault from the third on: how often the second stage ran, and what is said.
fn faulty(policy: impl FnMut(&LoopPosition<'_>) -> Option<usize> + Send + 'static) -> (u64, Vec<String>) {
    let log = MemoryTarget::default();
    let text = format!("time.source = \"sensor\"\n{}", two_stages());
    let options = Options { rate: Rate::Max, log: vec![Box::new(log.clone())], ..Options::default() };
    let mut agent = load(&text, options);
    let mut policy = policy;
    let policy = By(move |place: &LoopPosition<'_>| match (place.cycle, place.after) {
        (..3, None) => Some(0),
        (..3, Some(0)) => Some(1),
        (..3, _) => None,
        _ => policy(place),
    });
    agent.composer().set_policy(Some(Box::new(policy)));
    run(&mut agent, 10);
    (ticks(&agent, "motor"), lines(&log, "the policy of the main loop"))
}

#[test]
fn a_faulty_policy_is_removed_and_the_default_order_holds() {
    let (motor, said) = faulty(|_| Some(7));
    let text =
        "the policy of the main loop chose stage 7 of 2, from 0; it was removed, and the default holds";
    assert_eq!((motor, said), (10, vec![text.to_owned()]));
    let (motor, said) = faulty(|_| panic!("the policy's"));
    assert!(motor == 10 && said.len() == 1 && said[0].contains("panicked"), "{said:?}");
    // A cycle that does not end is ended.
    let calls = Arc::new(Mutex::new(0_u32));
    let counted = Arc::clone(&calls);
    let (motor, said) = faulty(move |_| {
        *counted.lock().unwrap() += 1;
        Some(0)
    });
    assert!(motor == 9 && said.len() == 1 && said[0].contains("1000 stages in a cycle"), "{said:?}");
    assert_eq!(*calls.lock().unwrap(), STAGE_LIMIT + 1);
}
