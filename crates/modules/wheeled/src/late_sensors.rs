//! Sensors that measure too late for a reflex.

use slate_plugin::mapek::Device;
use slate_plugin::prelude::*;

use crate::knowledge::WheeledModel;
use crate::rules::WheeledRules;

/// Returns whether a sensor that the reflexes have a rule for gives no timely measurement: it counts as near, and all reflexes
/// that read it stop the robot.
pub fn is_blind<T: Interface + ?Sized>(
    name: &str,
    input: &Input<T>,
    rules: &Input<WheeledRules>,
    robot: &WheeledModel,
    now: &Tick,
) -> bool {
    rules.get().is_some_and(|rules| rules.is_required(name)) && is_late(name, input, robot, now)
}

/// Returns whether a sensor has not measured yet or is late, by its rate in the robot model.
pub fn is_late<T: Interface + ?Sized>(
    name: &str,
    input: &Input<T>,
    robot: &WheeledModel,
    now: &Tick,
) -> bool {
    let stamp = input.stamp();
    let age = now.now().saturating_sub(stamp.time) as f64 * 1e-9;
    let after = robot.robot.sensor(name).map_or_else(|| Device::default().late_after(), Device::late_after);
    stamp.sequence == 0 || age > after
}
