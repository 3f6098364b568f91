//! Limits of a command's values.
#![allow(clippy::unwrap_used, reason = "what these functions set up exists")]

use crate::common;

use common::*;
use slate_module::Priority::{Plan, Reflex};
use slate_module::blackboard::interface::View;
use slate_module::blackboard::interface::{Interface, Value, edit, find};
use slate_safety::{ConfigurationError, Gate, GateConfiguration, Verdict};

fn mixed() -> GateConfiguration {
    GateConfiguration::new("mixed", Mixed::DESCRIPTOR)
}

/// Offers a command with one field set; returns the verdict and what that field has at the actuator.
fn through(gate: &mut Gate, field: &str, value: Value, now: u64) -> (Verdict, Value) {
    let mut command = vec![0; Mixed::DESCRIPTOR.size];
    edit(Mixed::DESCRIPTOR, &mut command, 0, field, &value).unwrap();
    let verdict = gate.offer(PLANNER, Plan, &command, now);
    let output = gate.output(now).command;
    let place = find(Mixed::DESCRIPTOR, field).unwrap();
    (verdict, View::new(Mixed::DESCRIPTOR, output, 0).unwrap().at(&place).unwrap())
}

#[test]
fn limits_are_a_closed_interval() {
    let mut gate = armed(configuration().limit("left", -1.0, 2.0).unwrap());
    for (value, verdict, result) in [
        (-1.0, Verdict::Passed, -1.0),
        (2.0, Verdict::Passed, 2.0),
        (0.5, Verdict::Passed, 0.5),
        (2.0_f64.next_up(), Verdict::Limited, 2.0),
        ((-1.0_f64).next_down(), Verdict::Limited, -1.0),
        (f64::MAX, Verdict::Limited, 2.0),
        (f64::MIN, Verdict::Limited, -1.0),
    ] {
        assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(value, value)), 0), verdict, "{value}");
        assert_eq!(given(&mut gate, 0), wheels(result, value), "only the field that has limits");
    }
}

#[test]
fn later_limits_of_a_field_replace_earlier_ones() {
    let wider = configuration().limit("left", -1.0, 1.0).unwrap().limit("left", -3.0, 3.0).unwrap();
    let mut gate = armed(wider);
    assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(3.0, 0.0)), 0), Verdict::Passed);
}

#[test]
fn a_limit_reaches_nested_fields_and_items_of_arrays() {
    for field in ["wheels/right", "joints/2"] {
        let mut gate = armed(mixed().limit(field, -1.0, 1.0).unwrap());
        assert_eq!(through(&mut gate, field, Value::Float(5.0), 0), (Verdict::Limited, Value::Float(1.0)));
        assert_eq!(
            through(&mut gate, "joints/1", Value::Float(5.0), 0),
            (Verdict::Passed, Value::Float(5.0))
        );
    }
}

#[test]
fn a_limit_of_a_single_means_the_nearest_single() {
    let mut gate = armed(mixed().limit("single", -0.1, 0.1).unwrap());
    let tenth = Value::Float(f64::from(0.1_f32));
    assert_eq!(through(&mut gate, "single", tenth.clone(), 0), (Verdict::Passed, tenth.clone()));
    assert_eq!(through(&mut gate, "single", Value::Float(0.2), 0), (Verdict::Limited, tenth));
}

#[test]
fn integers_of_every_width_are_limited() {
    for (field, low, high) in [
        ("large", 10, 20),
        ("negative", -20, -10),
        ("count", -20, 20),
        ("word", 10, 20),
        ("short", -20, 20),
        ("byte", 10, 20),
        ("tiny", -20, 20),
    ] {
        let mut gate = armed(mixed().limit(field, low as f64, high as f64).unwrap());
        for value in [low, high] {
            assert_eq!(
                through(&mut gate, field, Value::Integer(value), 0),
                (Verdict::Passed, Value::Integer(value))
            );
        }
        assert_eq!(
            through(&mut gate, field, Value::Integer(high + 1), 0),
            (Verdict::Limited, Value::Integer(high))
        );
        let below = if low == 10 { 0 } else { low - 1 };
        assert_eq!(
            through(&mut gate, field, Value::Integer(below), 0),
            (Verdict::Limited, Value::Integer(low))
        );
    }
}

#[test]
fn limits_between_integers_are_rounded_inwards() {
    let mut gate = armed(mixed().limit("count", -1.5, 2.5).unwrap());
    assert_eq!(through(&mut gate, "count", Value::Integer(3), 0), (Verdict::Limited, Value::Integer(2)));
    assert_eq!(through(&mut gate, "count", Value::Integer(-3), 0), (Verdict::Limited, Value::Integer(-1)));
}

#[test]
fn large_integers_are_limited_exactly() {
    let limit = 1_i128 << 60;
    let mut gate = armed(mixed().limit("large", 0.0, limit as f64).unwrap());
    assert_eq!(
        through(&mut gate, "large", Value::Integer(limit), 0),
        (Verdict::Passed, Value::Integer(limit))
    );
    assert_eq!(
        through(&mut gate, "large", Value::Integer(limit + 1), 0),
        (Verdict::Limited, Value::Integer(limit))
    );
    let mut gate = armed(mixed().rate_limit("large", 1e30).unwrap());
    gate.output(0);
    let odd = Value::Integer(limit + 1);
    assert_eq!(through(&mut gate, "large", odd.clone(), MILLISECOND), (Verdict::Passed, odd));
}

#[test]
fn a_rate_limit_bounds_the_change_between_commands() {
    let mut gate = armed(configuration().rate_limit("left", 10.0).unwrap());
    assert_eq!(given(&mut gate, 0), wheels(0.0, 0.0));
    for cycle in 1..=3 {
        let now = cycle * 20 * MILLISECOND;
        assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(0.7, 7.0)), now), Verdict::Limited);
        // Outputs between the offers neither speed a ramp up nor slow it down.
        for later in 1..10 {
            let output = given(&mut gate, now + later * MILLISECOND);
            assert!((output.left - 0.2 * cycle as f64).abs() < 1e-12, "{output:?}");
            assert_eq!(output.right, 7.0);
        }
    }
    assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(0.7, 7.0)), 80 * MILLISECOND), Verdict::Passed);
    assert_eq!(given(&mut gate, 80 * MILLISECOND), wheels(0.7, 7.0));
    assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(-9.0, 7.0)), 90 * MILLISECOND), Verdict::Limited);
    assert!((given(&mut gate, 90 * MILLISECOND).left - 0.6).abs() < 1e-12);
}

#[test]
fn a_rate_limit_never_delays_the_safe_command() {
    let mut gate = armed(configuration().rate_limit("left", 1.0).unwrap());
    let mut now = 0;
    for _ in 0..100 {
        gate.output(now);
        now += 50 * MILLISECOND;
        gate.offer(PLANNER, Plan, bytes(&wheels(3.0, 0.0)), now);
    }
    assert_eq!(given(&mut gate, now), wheels(3.0, 0.0));
    assert_eq!(given(&mut gate, now + TIME_TO_LIVE), wheels(0.0, 0.0));
    gate.offer(PLANNER, Plan, bytes(&wheels(3.0, 0.0)), now + TIME_TO_LIVE + 10 * MILLISECOND);
    let restart = given(&mut gate, now + TIME_TO_LIVE + 10 * MILLISECOND).left;
    assert!((restart - 0.01).abs() < 1e-12, "the next ramp begins at the safe command, not at {restart}");
}

#[test]
fn rates_count_from_the_actuators_value_after_preemption() {
    let mut gate = armed(configuration().rate_limit("left", 10.0).unwrap());
    gate.output(0);
    let now = 20 * MILLISECOND;
    gate.offer(PLANNER, Plan, bytes(&wheels(1.0, 0.0)), now);
    gate.offer(BUMPER, Reflex, bytes(&wheels(-1.0, 0.0)), now);
    assert!((given(&mut gate, now).left + 0.2).abs() < 1e-12);
}

#[test]
fn after_a_pause_a_step_is_bounded_by_the_time_to_live() {
    let mut gate = armed(configuration().rate_limit("left", 10.0).unwrap());
    gate.output(0);
    let now = 3_600_000 * MILLISECOND;
    assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(100.0, 0.0)), now), Verdict::Limited);
    assert!((given(&mut gate, now).left - 1.0).abs() < 1e-12);
}

#[test]
fn a_slow_ramp_of_an_integer_arrives() {
    let mut gate = armed(mixed().rate_limit("byte", 2.0).unwrap());
    gate.output(0);
    let mut seen = vec![];
    for cycle in 1..=100 {
        let (_, value) = through(&mut gate, "byte", Value::Integer(3), cycle * 20 * MILLISECOND);
        if seen.last() != Some(&value) {
            seen.push(value);
        }
    }
    assert_eq!(seen, [0, 1, 2, 3].map(Value::Integer));
}

#[test]
fn limits_stand_above_the_rate() {
    let safe = wheels(5.0, 0.0);
    let configuration = configuration().limit("left", -1.0, 1.0).unwrap().rate_limit("left", 0.1).unwrap();
    let mut gate = armed(configuration.safe(bytes(&safe)).unwrap());
    assert_eq!(given(&mut gate, 0), safe, "the safe command is not limited");
    assert_eq!(gate.offer(PLANNER, Plan, bytes(&wheels(0.0, 0.0)), MILLISECOND), Verdict::Limited);
    assert_eq!(given(&mut gate, MILLISECOND), wheels(1.0, 0.0));
}

#[test]
fn a_wrong_configuration_is_refused_in_words() {
    let says = |result: Result<GateConfiguration, ConfigurationError>, message: &str| {
        assert_eq!(result.unwrap_err().to_string(), message);
    };
    says(
        configuration().limit("lef", 0.0, 1.0),
        "gate `drive`: Wheels has no field `lef`; it has left, right",
    );
    says(
        configuration().rate_limit("", 1.0),
        "gate `drive`: no field of Wheels is named; it has left, right",
    );
    let array = "gate `mixed`: `joints` is 3 x f64; only a single number can be limited";
    says(mixed().limit("joints", 0.0, 1.0), array);
    says(
        mixed().limit("wheels", 0.0, 1.0),
        "gate `mixed`: `wheels` is Wheels; only a single number can be limited",
    );
    let item = "gate `mixed`: `spare/0` is not part of every command; \
                only fields and items of arrays can be limited";
    says(mixed().limit("spare/0", 0.0, 1.0), item);
    says(
        mixed().limit("joints/3", 0.0, 1.0),
        "gate `mixed`: 3 x f64 has no field `3`; it has indices from 0",
    );
    says(
        configuration().limit("left", 2.0, 1.0),
        "gate `drive`: the limits of `left`, 2 to 1, leave it no value",
    );
    says(
        mixed().limit("byte", 300.0, 400.0),
        "gate `mixed`: the limits of `byte`, 300 to 400, leave it no value",
    );
    says(
        mixed().limit("count", 0.2, 0.8),
        "gate `mixed`: the limits of `count`, 0.2 to 0.8, leave it no value",
    );
    for (low, high) in [(f64::NAN, 1.0), (0.0, f64::NAN), (0.0, f64::INFINITY), (f64::NEG_INFINITY, 0.0)] {
        assert!(matches!(
            configuration().limit("left", low, high),
            Err(ConfigurationError::EmptyLimits { .. })
        ));
    }
    assert!(matches!(mixed().limit("single", 1e300, 1e301), Err(ConfigurationError::EmptyLimits { .. })));
    for rate in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            configuration().rate_limit("left", rate),
            Err(ConfigurationError::WrongRate { .. })
        ));
    }
    says(configuration().safe(&[0; 8]), "gate `drive`: the safe command has 8 bytes, but Wheels has 16");
    let safe = configuration().safe(bytes(&wheels(0.0, f64::NAN)));
    says(safe, "gate `drive`: the safe command has a number that is not finite");
}
