//! A gate that continues in another process as if nothing had happened, but arms no real actuator.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use crate::common;

use common::{MILLISECOND, PERSON, PLANNER, armed, bytes, configuration, wheels};
use slate_module::Priority;
use slate_safety::{Gate, GateMode, GateSnapshot, Reason, StopLatch, Verdict};

/// The gate as it is after a file was written and read.
fn stored(gate: &Gate) -> GateSnapshot {
    let mut bytes = Vec::new();
    ciborium::into_writer(&gate.snapshot(), &mut bytes).unwrap();
    ciborium::from_reader(&*bytes).unwrap()
}

fn slow() -> slate_safety::GateConfiguration {
    configuration().rate_limit("left", 30.0).unwrap()
}

#[test]
fn a_gate_that_was_armed_goes_on_with_lease_command_and_rate() {
    let mut gate = armed(slow());
    let mut at = 0;
    for _ in 0..5 {
        at += 20 * MILLISECOND;
        gate.offer(PLANNER, Priority::Teleoperation, bytes(&wheels(10.0, 2.0)), at);
        gate.output(at);
    }
    let mut copy = Gate::new(slow());
    assert!(copy.restore(&stored(&gate), true));
    for step in 0..12 {
        at += 20 * MILLISECOND;
        let offer = |gate: &mut Gate| match step {
            0..3 => Some(gate.offer(PLANNER, Priority::Plan, bytes(&wheels(10.0, 2.0)), at)),
            3 => Some(gate.offer(PERSON, Priority::Plan, bytes(&wheels(1.0, 1.0)), at)),
            _ => None,
        };
        assert_eq!(offer(&mut copy), offer(&mut gate), "step {step}");
        let (its, own) = (copy.output(at), gate.output(at));
        assert_eq!((its.command, its.state), (own.command, own.state), "step {step}");
    }
}

#[test]
fn a_real_actuator_waits_for_a_person() {
    let mut gate = armed(configuration());
    gate.offer(PLANNER, Priority::Plan, bytes(&wheels(1.0, 1.0)), 0);
    let mut copy = armed(configuration());
    assert!(copy.restore(&stored(&gate), false));
    let output = copy.output(1);
    assert_eq!((output.state.mode, output.command), (GateMode::DISARMED, bytes(&wheels(0.0, 0.0))));
    let offered = copy.offer(PLANNER, Priority::Plan, bytes(&wheels(1.0, 1.0)), 1);
    assert_eq!(offered, Verdict::Refused(Reason::Disarmed));
    copy.arm().unwrap();
    assert_eq!(copy.output(2).state.passed, 1);
}

#[test]
fn a_stop_comes_along_and_one_that_is_there_stays() {
    let mut stopped = armed(configuration());
    stopped.stop("smoke");
    let mut copy = armed(configuration());
    assert!(copy.restore(&stored(&stopped), true));
    assert_eq!(copy.stop_reason().as_deref(), Some("smoke"));

    let latch = StopLatch::in_memory();
    let mut present = armed(configuration().stop_latch(&latch));
    latch.stop("fire").unwrap();
    assert!(present.restore(&stored(&armed(configuration())), true));
    assert_eq!(present.output(0).state.mode, GateMode::STOPPED);
}

#[test]
fn another_gate_is_refused() {
    let mut gate = armed(configuration());
    let before = gate.snapshot();
    assert!(!gate.restore(&Gate::new(slow()).snapshot(), true));
    assert_eq!(gate.snapshot(), before);
}
