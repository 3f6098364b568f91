//! Gates beside tools that look at them.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use slate_blackboard::channel::{Budget, Channel, Writer};
use slate_blackboard::interface::{Interface, View};
use slate_engine::actuators::Actuator;
use slate_engine::clock::Clock;
use slate_engine::digest::Digest;
use slate_module::{Priority, interface};
use slate_safety::{Gate, GateConfiguration, GateState};

/// The speed of a wheel.
#[interface]
pub struct Wheel {
    /// Forward.
    #[unit("rad/s")]
    pub speed: f64,
}

fn writer<I: Interface>() -> Writer {
    let budget = Budget { latest: 1, queues: 0, window: 0 };
    Channel::new(I::DESCRIPTOR.shape(0), 1, budget).writer().unwrap()
}

/// An actuator that is stopped for a reason which takes long to copy.
fn stopped(is_driven: bool) -> Actuator {
    let gate = Gate::new(GateConfiguration::new("wheel", Wheel::DESCRIPTOR));
    let own = (0, Arc::new(Clock::new(is_driven, None)));
    let names = vec!["planner/wheel".into()];
    let actuator = Actuator::new("wheel", names, gate, writer::<Wheel>(), writer::<GateState>(), own);
    actuator.stop(&"x".repeat(1 << 22), 0);
    actuator
}

/// Does `work` while another thread looks again and again why the actuator is stopped.
fn beside_a_tool(actuator: &Actuator, work: impl FnOnce()) {
    let (looks, ended) = (AtomicBool::new(false), AtomicBool::new(false));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !ended.load(Ordering::Relaxed) {
                assert!(actuator.stop_reason().is_some());
                looks.store(true, Ordering::Relaxed);
            }
        });
        while !looks.load(Ordering::Relaxed) {
            std::thread::yield_now();
        }
        let done = catch_unwind(AssertUnwindSafe(work));
        ended.store(true, Ordering::Relaxed);
        done.unwrap_or_else(|panic| resume_unwind(panic));
    });
}

const CYCLES: u64 = 200_000;

#[test]
fn no_command_is_lost_while_a_tool_reads_the_stop_reason() {
    let actuator = stopped(false);
    let mut wheel = Wheel { speed: 1.0 };
    let command = View::of(&mut wheel).bytes().to_vec();
    let mut refused = 0;
    beside_a_tool(&actuator, || {
        let commander = actuator.commander("planner/wheel").unwrap();
        for _ in 0..CYCLES {
            actuator.offer(commander, Priority::Plan, &command, u64::MAX / 2);
        }
        refused = actuator.try_state(0).map_or(0, |state| state.refused);
    });
    assert_eq!(refused, CYCLES);
}

#[test]
fn tool_that_reads_the_stop_reason_changes_no_digest() {
    let digest = |actuator: &Actuator| {
        let mut digest = Digest::default();
        (0..CYCLES).for_each(|cycle| actuator.expire(cycle, Some(&mut digest)));
        digest
    };
    let alone = digest(&stopped(true));
    let actuator = stopped(true);
    beside_a_tool(&actuator, || assert_eq!(digest(&actuator), alone));
}

#[test]
fn stop_reason_is_shown_until_the_reset() {
    let actuator = stopped(false);
    actuator.reset();
    assert_eq!(actuator.stop_reason(), None);
    actuator.stop("the bumper", 1);
    actuator.stop("another", 2);
    assert_eq!(actuator.stop_reason().as_deref(), Some("the bumper"));
    actuator.reset();
    assert!(actuator.arm());
}
