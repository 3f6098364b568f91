//! Changes that a recorder receives.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and one waits for a loop on the wall clock"
)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use slate_blackboard::message::Tap;
use slate_blackboard::{Property, Stamp, Taps};
use slate_runtime::configuration::Database;
use slate_runtime::recording::{Change, Recording};
use slate_runtime::{Agent, Control, Options, Rate};

use crate::common::plugins;

/// Notes changes, and panics once when a switch is written after it was `armed`.
#[derive(Default)]
struct Scribe {
    changes: Mutex<Vec<Change>>,
    /// Cycle and time of each stop.
    moments: Mutex<Vec<(u64, u64)>>,
    armed: Arc<AtomicBool>,
}

struct PanicTap(Arc<AtomicBool>);

impl Tap for PanicTap {
    fn wrote(&self, _: &[u8], _: usize, _: Stamp) {
        assert!(!self.0.swap(false, Ordering::Relaxed), "as the test wants");
    }
}

impl Taps for Scribe {
    fn tap(&self, property: &Property) -> Option<Arc<dyn Tap>> {
        let is_switch = property.path() == "relay/enabled";
        is_switch.then(|| Arc::new(PanicTap(Arc::clone(&self.armed))) as _)
    }
}

impl Recording for Scribe {
    fn changed(&self, cycle: u64, time: u64, changes: &[Change]) {
        if let [Change::Stop { .. }] = changes {
            self.moments.lock().unwrap().push((cycle, time));
        }
        self.changes.lock().unwrap().extend_from_slice(changes);
    }
}

const ROBOT: &str = r#"
time.source = "counter"
loop.period = "2ms"
[modules.counter]
[modules.relay]
[links]
"relay/input" = "counter/number"
"#;

fn recorded(text: &str) -> (Agent, Arc<Scribe>) {
    let scribe = Arc::<Scribe>::default();
    let recording = Some(Arc::clone(&scribe) as Arc<dyn Recording>);
    let options = Options { rate: Rate::REALTIME, armed: true, recording, ..Options::default() };
    let database = Database::from_text("robot.toml", text, Default::default()).unwrap();
    (Agent::load_with(&database, &plugins(), options).unwrap(), scribe)
}

#[test]
fn refused_snapshot_is_no_change_for_the_recording() {
    let (mut agent, scribe) = recorded(ROBOT);
    agent.step();
    let snapshot = agent.composer().snapshot().unwrap();
    for other in [
        format!("agent.name = \"other\"\n{ROBOT}"),
        ROBOT.replace("[modules.relay]", "[modules.relay]\n[modules.more]\nkind = \"dice\""),
    ] {
        let (mut other, scribe) = recorded(&other);
        other.step();
        other.restore(&snapshot).unwrap_err();
        other.composer().restore(&snapshot, None).unwrap_err();
        other.restore_under_own_settings(&snapshot).unwrap_err();
        assert!(scribe.changes.lock().unwrap().is_empty());
    }
    agent.restore(&snapshot).unwrap();
    let changes = scribe.changes.lock().unwrap();
    assert!(matches!(&changes[..], [Change::Other { what }] if what == "a restore from a snapshot"));
}

#[test]
fn loop_goes_on_after_a_change_that_panics() {
    let (mut agent, scribe) = recorded(ROBOT);
    let (composer, stopper) = (agent.composer(), agent.stopper());
    let running = std::thread::spawn(move || agent.run(Box::new(|_| Control::Continue)));
    let goes_on = || {
        let (begin, before) = (Instant::now(), composer.cycles());
        while composer.cycles() < before + 5 {
            assert!(begin.elapsed() < Duration::from_secs(20), "the loop stands still");
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    goes_on();
    composer.enable("relay", false).unwrap();
    scribe.armed.store(true, Ordering::Relaxed);
    let panicked = catch_unwind(AssertUnwindSafe(|| composer.enable("relay", true)));
    assert!(panicked.is_err(), "the tap was not called");
    goes_on();
    stopper.stop();
    running.join().unwrap().unwrap();
}

#[test]
fn changes_are_told_before_the_next_cycle_and_the_next_change() {
    let (mut agent, scribe) = recorded(ROBOT);
    agent.set_rate(Rate::Max);
    let composer = agent.composer();
    let stopper = agent.stopper();
    let threads = ["one", "other"].map(|reason| {
        let composer = composer.clone();
        std::thread::spawn(move || (0..200).for_each(|_| composer.stop_actuators(reason)))
    });
    std::thread::scope(|scope| {
        scope.spawn(|| {
            threads.into_iter().for_each(|thread| thread.join().unwrap());
            stopper.stop();
        });
        agent.run(Box::new(|_| Control::Continue)).unwrap();
    });
    let moments = scribe.moments.lock().unwrap();
    // On a busy machine one may not wait for the end of a cycle any longer.
    assert!(moments.len() > 100, "{moments:?}");
    assert!(moments.is_sorted(), "changes are reported in their order");
    // Each with the time of the cycle that it came after.
    let period = 2_000_000;
    let is_later = |(cycle, time): &&(u64, u64)| *time != cycle.saturating_sub(1) * period;
    assert_eq!(moments.iter().filter(is_later).collect::<Vec<_>>(), Vec::<&(u64, u64)>::new());
}
