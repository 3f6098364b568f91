//! Ends of runs, and the right to end them.

use std::time::{Duration, Instant};

use slate_runtime::{Control, End, Mode, Options};

use crate::faults::common::{lockstep, number};
use crate::faults::{after, agent, count};

#[test]
fn an_observer_ends_a_run_after_its_cycle_and_it_can_go_on() {
    let mut agent = lockstep("[modules.counter]\n");
    assert_eq!(agent.run(after(5)).unwrap(), End::Stopped);
    assert_eq!(number(&agent, "counter/number/value"), 5.0);
    assert_eq!(agent.run(after(5)).unwrap(), End::Stopped);
    assert_eq!(number(&agent, "counter/number/value"), 10.0);
}

#[test]
fn panic_of_observer_reaches_caller_of_run() {
    let mut agent = lockstep("[modules.counter]\n");
    let run = std::panic::AssertUnwindSafe(|| agent.run(Box::new(|_| panic!("the application's"))));
    let panic = std::panic::catch_unwind(run).unwrap_err();
    assert_eq!(panic.downcast_ref::<&str>(), Some(&"the application's"));
    assert_eq!(agent.run(after(1)).unwrap(), End::Stopped);
    assert_eq!(count(&agent, "counter"), 2);
}

#[test]
fn a_stopper_ends_a_run_from_another_thread() {
    for (mode, trigger) in [(Mode::Staged, ""), (Mode::Threaded, "every = \"1ms\"")] {
        let text = format!("loop.period = \"1ms\"\n[modules.counter]\n{trigger}\n[modules.sender]\n");
        let mut agent = agent(&text, Options { mode, ..Options::default() });
        for _ in 0..3 {
            let stopper = agent.stopper();
            let thread = std::thread::spawn(move || {
                std::thread::sleep(Duration::from_millis(30));
                stopper.stop();
            });
            assert_eq!(agent.run(Box::new(|_| Control::Continue)).unwrap(), End::Stopped);
            thread.join().unwrap();
            let ticks = (count(&agent, "counter"), count(&agent, "sender"));
            assert!(ticks.0 > 0 && ticks.1 > 0);
            std::thread::sleep(Duration::from_millis(10));
            assert_eq!((count(&agent, "counter"), count(&agent, "sender")), ticks);
        }
    }
}

#[test]
fn a_stop_does_not_wait_for_the_next_cycle() {
    let mut agent = agent("loop.period = \"20s\"\n[modules.counter]\n", Options::default());
    let stopper = agent.stopper();
    let thread = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(50));
        stopper.stop();
    });
    let start = Instant::now();
    agent.run(Box::new(|_| Control::Continue)).unwrap();
    thread.join().unwrap();
    assert!(start.elapsed() < Duration::from_secs(5));
}
