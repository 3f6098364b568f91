//! Reflex: turns away from obstacles and drives on.

use slate_avoidance::{Disc, Footprint, Maneuver, ROBOT_SENSOR, ReflexInput, SONAR, react};
use slate_plugin::interfaces::{Odometry, Sightings, SonarScan};
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};
use crate::knowledge::WheeledModel;
use crate::late_sensors::{is_blind, is_late};
use crate::rules::WheeledRules;

/// Sensors and knowledge of the reflex.
#[ports]
pub struct AvoidObstacleSensors {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    /// Other robots, if a sensor detects them.
    #[stale(after = "200ms")]
    robots: Input<Sightings>,
    /// Twist of the robot: a fast one reacts earlier, and one of unknown speed as at its greatest.
    #[stale(after = "200ms")]
    odometry: Input<Odometry>,
    /// Thresholds, from Knowledge.
    rules: Input<WheeledRules>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Name of the wheel encoders in a robot model.
const ODOMETRY: &str = "odometry";

/// Maps the newest measurements to `AvoidObstacle`, by the rules in Knowledge. It has no memory.
///
/// It stops the robot while a sensor with a rule is late, and without rules or a valid outline.
pub struct AvoidObstacleModel;

impl ReactiveModel for AvoidObstacleModel {
    const NAME: &'static str = "avoid_obstacle_model";
    const DOC: &'static str = "Turns away from obstacles that the sensors detect, and drives on.";
    type Sensors = AvoidObstacleSensors;
    type Params = ();
    type State = ();

    fn run(_: &mut (), sensors: &AvoidObstacleSensors, (): &(), now: &Tick) -> Option<ActionRequest> {
        let robot = sensors.robot.get()?;
        let Maneuver { angle, linear, duration } = maneuver(sensors, robot, now)?;
        let wheels = robot.wheels_for(linear, 0.0);
        Some(AvoidObstacle::request(Evasion { angle, left: wheels.left, right: wheels.right, duration }))
    }
}

fn maneuver(sensors: &AvoidObstacleSensors, robot: &WheeledModel, now: &Tick) -> Option<Maneuver> {
    let AvoidObstacleSensors { sonar, robots, odometry, rules, .. } = sensors;
    let is_blind =
        is_blind(SONAR, sonar, rules, robot, now) || is_blind(ROBOT_SENSOR, robots, rules, robot, now);
    // Without an outline or a rule nothing is known to be far enough away.
    let (false, Ok(footprint), Some(thresholds)) =
        (is_blind, Footprint::of(&robot.chassis.outline), rules.get())
    else {
        return Some(Maneuver::STOP);
    };
    let seen = robots.get().filter(|_| !is_late(ROBOT_SENSOR, robots, robot, now));
    let discs = seen.into_iter().flat_map(|robots| robots.list.iter()).map(|seen| Disc {
        x: seen.range * math::cos(seen.bearing),
        y: seen.range * math::sin(seen.bearing),
        radius: robot.detected_radius,
    });
    let speed = match odometry.get() {
        Some(odometry) if !is_late(ODOMETRY, &sensors.odometry, robot, now) => odometry.twist.linear,
        // Encoders that have stopped, or never measured, may hide the greatest speed.
        _ => robot.chassis.maximum_wheel_speed * robot.chassis.wheel_radius,
    };
    react(&thresholds.avoid_obstacle, &footprint, &ReflexInput::new(sonar.get()?, discs, speed))
}
