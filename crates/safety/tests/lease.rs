//! The lease on an actuator, and its duration.

use crate::common;

use common::*;
use slate_module::Priority::{Plan, Reflex, Teleoperation};
use slate_safety::{LeasePriority, Reason, RefusalReason, Verdict};

#[test]
fn a_command_takes_effect_until_its_time_to_live_ends() {
    let mut gate = armed(configuration());
    let offered = 7;
    assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 2.0)), offered), Verdict::Passed);
    assert_eq!(given(&mut gate, offered), wheels(1.0, 2.0));
    assert_eq!(given(&mut gate, offered + TIME_TO_LIVE - 1), wheels(1.0, 2.0));
    assert_eq!(gate.output(offered + TIME_TO_LIVE - 1).state.age.get(), Some(&(TIME_TO_LIVE - 1)));
    assert_eq!(given(&mut gate, offered + TIME_TO_LIVE), wheels(0.0, 0.0));
    let state = gate.output(offered + TIME_TO_LIVE).state;
    assert_eq!((state.expired, state.age.get(), state.priority), (1, None, LeasePriority::NONE));
}

#[test]
fn an_expired_command_does_not_come_back() {
    let mut gate = armed(configuration());
    gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 0);
    assert_eq!(given(&mut gate, TIME_TO_LIVE), wheels(0.0, 0.0));
    assert_eq!(given(&mut gate, 1), wheels(0.0, 0.0), "not even when the clock goes back");
}

#[test]
fn a_clock_that_jumps_back_keeps_no_command_alive() {
    let mut gate = armed(configuration());
    let hour = 3_600_000 * MILLISECOND;
    gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 2 * hour);
    assert_eq!(
        given(&mut gate, 2 * hour - 1),
        wheels(1.0, 1.0),
        "an output may be timed just before the offer"
    );
    assert_eq!(given(&mut gate, hour), wheels(0.0, 0.0));
}

#[test]
fn the_time_to_live_is_configurable_and_zero_passes_nothing() {
    let mut gate = armed(configuration().time_to_live(5));
    gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 0);
    assert_eq!(given(&mut gate, 4), wheels(1.0, 1.0));
    assert_eq!(given(&mut gate, 5), wheels(0.0, 0.0));
    let mut gate = armed(configuration().time_to_live(0));
    gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 0);
    assert_eq!(given(&mut gate, 0), wheels(0.0, 0.0));
}

#[test]
fn each_offer_renews_the_lease() {
    let mut gate = armed(configuration());
    for cycle in 0..10 {
        gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), cycle * (TIME_TO_LIVE - 1));
        let leased = gate.offer(PERSON, Plan, bytes(&wheels(2.0, 2.0)), (cycle + 1) * (TIME_TO_LIVE - 1) - 1);
        assert_eq!(leased, Verdict::Refused(Reason::Leased { by: PLANNER, priority: Plan }));
    }
    assert_eq!(gate.output(9 * (TIME_TO_LIVE - 1)).state.expired, 0);
}

#[test]
fn refused_offer_renews_no_lease() {
    let mut gate = armed(configuration());
    gate.offer(BUMPER, Reflex, bytes(&wheels(-1.0, -1.0)), 0);
    gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), TIME_TO_LIVE - 1);
    assert_eq!(given(&mut gate, TIME_TO_LIVE), wheels(0.0, 0.0));
}

#[test]
fn only_a_higher_priority_preempts() {
    let order = [Plan, Teleoperation, Reflex];
    for (i, holder) in order.into_iter().enumerate() {
        for (j, other) in order.into_iter().enumerate() {
            let mut gate = armed(configuration());
            gate.offer(1, holder, bytes(&wheels(1.0, 1.0)), 0);
            let verdict = gate.offer(2, other, bytes(&wheels(2.0, 2.0)), 0);
            if j > i {
                assert_eq!(verdict, Verdict::Passed, "{other:?} preempts {holder:?}");
                assert_eq!(given(&mut gate, 0), wheels(2.0, 2.0));
            } else {
                assert_eq!(verdict, Verdict::Refused(Reason::Leased { by: 1, priority: holder }));
                assert_eq!(given(&mut gate, 0), wheels(1.0, 1.0), "{other:?} leaves {holder:?} alone");
            }
        }
    }
}

#[test]
fn an_expired_lease_lets_a_lower_priority_in() {
    let mut gate = armed(configuration());
    gate.offer(BUMPER, Reflex, bytes(&wheels(-1.0, -1.0)), 0);
    let refused = gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), TIME_TO_LIVE - 1);
    assert_eq!(refused, Verdict::Refused(Reason::Leased { by: BUMPER, priority: Reflex }));
    assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), TIME_TO_LIVE), Verdict::Passed);
    let output = gate.output(TIME_TO_LIVE);
    assert_eq!((output.state.holder, output.state.priority), (PLANNER, LeasePriority::PLAN));
    assert_eq!(output.state.last_refusal, RefusalReason::LEASED);
}

#[test]
fn a_withdrawn_lease_revives_no_older_command() {
    let mut gate = armed(configuration());
    gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 0);
    gate.offer(BUMPER, Reflex, bytes(&wheels(-1.0, -1.0)), 1);
    gate.withdraw(BUMPER, 2);
    assert_eq!(given(&mut gate, 2), wheels(0.0, 0.0));
    assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 2), Verdict::Passed);
    assert_eq!(given(&mut gate, 2), wheels(1.0, 1.0));
    assert_eq!(gate.output(2).state.expired, 0);
}

#[test]
fn only_the_holder_can_withdraw() {
    let mut gate = armed(configuration());
    gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 0);
    gate.withdraw(BUMPER, 0);
    assert_eq!(given(&mut gate, 0), wheels(1.0, 1.0));
}

#[test]
fn the_holder_may_change_its_own_priority() {
    let mut gate = armed(configuration());
    gate.offer(PLANNER, Reflex, bytes(&wheels(1.0, 1.0)), 0);
    assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(2.0, 2.0)), 0), Verdict::Passed);
    assert_eq!(gate.offer(PERSON, Teleoperation, bytes(&wheels(3.0, 3.0)), 0), Verdict::Passed);
}

#[test]
fn an_unusable_command_brings_the_safe_one() {
    for bad in [f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let safe = wheels(0.25, 0.5);
        let limited = configuration().limit("right", -1.0, 1.0).unwrap();
        let mut gate = armed(limited.safe(bytes(&safe)).unwrap());
        gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 0);
        for command in [wheels(bad, 0.0), wheels(0.0, bad)] {
            let verdict = gate.offer(PLANNER, Plan, bytes(&command), 0);
            assert_eq!(verdict, Verdict::Refused(Reason::NotFinite));
            assert_eq!(given(&mut gate, 0), safe);
        }
        assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 1), Verdict::Passed);
        assert_eq!(given(&mut gate, 1), wheels(1.0, 1.0));
    }
    let mut gate = armed(configuration());
    gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 0);
    for command in [&[][..], &[0; 15], &[0; 17]] {
        assert_eq!(gate.offer(PLANNER, Plan, command, 0), Verdict::Refused(Reason::WrongSize));
        assert_eq!(given(&mut gate, 0), wheels(0.0, 0.0));
    }
}

#[test]
fn an_unusable_reflex_still_takes_the_lease_from_the_plan() {
    let mut gate = armed(configuration());
    gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 0);
    gate.offer(BUMPER, Reflex, bytes(&wheels(f64::NAN, 0.0)), 1);
    let leased = gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 1.0)), 2);
    assert_eq!(leased, Verdict::Refused(Reason::Leased { by: BUMPER, priority: Reflex }));
    assert_eq!(given(&mut gate, 2), wheels(0.0, 0.0));
}

#[test]
fn an_unusable_plan_does_not_disturb_a_reflex() {
    let mut gate = armed(configuration());
    gate.offer(BUMPER, Reflex, bytes(&wheels(-1.0, -1.0)), 0);
    gate.offer(PLANNER, Plan, bytes(&wheels(f64::NAN, 0.0)), 1);
    gate.offer(PLANNER, Plan, &[], 1);
    assert_eq!(given(&mut gate, 2), wheels(-1.0, -1.0));
}

#[test]
fn the_state_counts_what_became_of_offers() {
    let mut gate = armed(configuration().limit("left", -1.0, 1.0).unwrap());
    gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 5.0)), 0);
    gate.offer(PLANNER, Plan, bytes(&wheels(2.0, 5.0)), 1);
    gate.offer(PLANNER, Plan, bytes(&wheels(-2.0, 5.0)), 2);
    gate.offer(PLANNER, Plan, bytes(&wheels(f64::NAN, 5.0)), 3);
    gate.offer(PLANNER, Plan, bytes(&wheels(0.0, 5.0)), 4);
    let state = gate.output(10 * TIME_TO_LIVE).state;
    assert_eq!((state.passed, state.limited, state.refused, state.expired), (2, 2, 1, 1));
    assert_eq!(state.last_refusal, RefusalReason::NOT_FINITE);
    gate.offer(PLANNER, Plan, bytes(&wheels(f64::NAN, 5.0)), 10 * TIME_TO_LIVE);
    assert_eq!(
        gate.output(20 * TIME_TO_LIVE).state.expired,
        1,
        "a refused command has nothing that could expire"
    );
}
