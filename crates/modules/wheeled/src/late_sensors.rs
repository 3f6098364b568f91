//! Sensors that measure too late for a reflex.

use slate_plugin::mapek::{Device, DeviceHealth};
use slate_plugin::prelude::*;

use crate::knowledge::WheeledModel;
use crate::rules::WheeledRules;

/// Returns true if no Knowledge has a robot model for a reflex.
/// No obstacle is then known to be far enough away, and the reflex stops the robot. Before Knowledge has published its
/// first model, no action runs.
pub fn has_no_model(robot: &Input<WheeledModel>) -> bool {
    robot.get().is_none() && !robot.has_writer()
}

/// Returns true if a sensor with a rule gives no timely measurement.
/// The reflexes have the rule. The sensor counts as near, and all reflexes that read it stop the robot.
pub fn is_blind<T: Interface + ?Sized>(
    name: &str,
    input: &Input<T>,
    rules: &Input<WheeledRules>,
    robot: &WheeledModel,
    now: &Tick,
) -> bool {
    rules.get().is_some_and(|rules| rules.is_required(name)) && is_late(name, input, robot, now)
}

/// Returns whether a sensor that the robot has is late, with or without a rule.
pub fn has_lost<T: Interface + ?Sized>(
    name: &str,
    input: &Input<T>,
    robot: &WheeledModel,
    now: &Tick,
) -> bool {
    (input.has_writer() || input.get().is_some()) && is_late(name, input, robot, now)
}

/// Returns true if a sensor has not measured yet or is late.
/// Its rate and health in the robot model decide. Single measurements of a late one do not count: the robot would drive
/// on for a moment with each.
pub fn is_late<T: Interface + ?Sized>(
    name: &str,
    input: &Input<T>,
    robot: &WheeledModel,
    now: &Tick,
) -> bool {
    let stamp = input.stamp();
    let age = now.now().saturating_sub(stamp.time) as f64 * 1e-9;
    let device = robot.robot.sensor(name);
    let after = device.map_or_else(|| Device::default().late_after(), Device::late_after);
    let is_known_late =
        device.is_some_and(|device| matches!(device.health, DeviceHealth::LATE | DeviceHealth::SILENT));
    stamp.sequence == 0 || age > after || is_known_late
}
