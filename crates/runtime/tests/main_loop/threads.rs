use std::time::Duration;

use slate_runtime::synchronization::Count;
use slate_runtime::{Control, End};

use super::{run, ticks, wall_clock, witnesses};

const LONG: Duration = Duration::from_secs(60);

#[test]
fn a_thread_outside_falls_in_with_the_stages_of_the_loop() {
    const ROUNDS: u64 = 100;
    let (mut agent, _) = wall_clock(&format!("loop.period = \"1ms\"\n{}", witnesses(&[("motor", "Act")])));
    let points = |name| agent.synchronization().point(name).unwrap();
    let (start, end, cycle) = (points("/stage/Act/start"), points("/stage/Act/end"), points("/cycle/end"));
    let modules = agent.composer();
    let stopper = agent.stopper();
    let thread = std::thread::spawn(move || {
        let ticks = || modules.modules()[0].ticks;
        let mut seen = Count::ZERO;
        for _ in 0..ROUNDS {
            seen = start.wait(seen, LONG).unwrap();
            // What follows the start of the stage: its end, and the end of its cycle.
            end.wait(Count::ZERO, LONG).unwrap();
            let (ended, cycles) = (end.count(), cycle.count());
            assert!(start.count() >= ended);
            assert!(ticks() >= cycles.get(), "when a cycle ends, its modules have run");
        }
        stopper.stop();
        seen.get()
    });
    assert_eq!(agent.run(Box::new(|_| Control::Continue)).unwrap(), End::Stopped);
    let seen = thread.join().unwrap();
    assert!(seen >= ROUNDS && seen <= ticks(&agent, "motor"));
    let names = agent.synchronization().names();
    for name in ["/cycle/start", "/stage/PreLoop/start", "/stage/PostLoop/end"] {
        assert!(names.iter().any(|other| **other == *name), "{name}");
    }
}

#[test]
fn a_point_is_emitted_once_it_or_one_above_it_is_requested() {
    let (mut agent, _) = wall_clock(&format!("loop.period = \"1ms\"\n{}", witnesses(&[("motor", "Act")])));
    run(&mut agent, 5);
    let stages = agent.synchronization().point("/stage").unwrap();
    let start = agent.synchronization().point("/cycle/start").unwrap();
    assert_eq!((stages.count(), start.count()), (Count::ZERO, Count::ZERO), "nobody waited");
    run(&mut agent, 5);
    // Ten stages, each with a start and an end.
    assert_eq!((stages.count().get(), start.count().get()), (5 * 20, 5));
    let end = agent.synchronization().point("/cycle/end").unwrap();
    assert_eq!(end.count(), Count::ZERO);
}

#[test]
fn an_agent_stopped_before_its_run_makes_no_cycle() {
    let (mut agent, _) = wall_clock(&format!("loop.period = \"1ms\"\n{}", witnesses(&[("motor", "Act")])));
    agent.stopper().stop();
    assert_eq!(agent.run(Box::new(|_| Control::Continue)).unwrap(), End::Stopped);
    assert_eq!(ticks(&agent, "motor"), 0);
    run(&mut agent, 3);
    assert!(ticks(&agent, "motor") >= 3);
    // One that comes after a run means that one.
    agent.stopper().stop();
    run(&mut agent, 3);
    assert!(ticks(&agent, "motor") >= 6);
}
