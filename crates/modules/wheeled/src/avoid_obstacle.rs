//! Reflex: turns away from obstacles and drives on.

use slate_avoidance::{Disc, Footprint, Maneuver, ROBOT_SENSOR, ReflexInput, SONAR, react};
use slate_plugin::interfaces::{Odometry, Sightings, SonarScan, Twist2};
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};
use crate::knowledge::{ODOMETRY, WheeledModel};
use crate::late_sensors::{has_lost, has_no_model, is_blind, is_late};
use crate::rules::WheeledRules;

/// Sensors and knowledge of the reflex.
#[ports]
pub struct AvoidObstacleSensors {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    /// Other robots, if a sensor detects them.
    #[stale(after = "200ms")]
    robots: Input<Sightings>,
    /// Twist of the robot.
    /// A fast one reacts earlier, and one of unknown speed as at its greatest.
    #[stale(after = "200ms")]
    odometry: Input<Odometry>,
    /// Thresholds, from Knowledge.
    rules: Input<WheeledRules>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Maps the newest measurements to `AvoidObstacle`, by the rules in Knowledge.
/// It has no memory.
///
/// It stops the robot while a sensor with a rule or the odometry is late, and without rules for the sonars, a robot model or a
/// valid outline.
pub struct AvoidObstacleModel;

impl ReactiveModel for AvoidObstacleModel {
    const NAME: &'static str = "avoid_obstacle_model";
    const DOC: &'static str = "Turns away from obstacles that the sensors detect, and drives on.";
    type Sensors = AvoidObstacleSensors;
    type Params = ();
    type State = ();

    fn run(_: &mut (), sensors: &AvoidObstacleSensors, (): &(), now: &Tick) -> Option<ActionRequest> {
        if has_no_model(&sensors.robot) {
            let Maneuver { angle, duration, .. } = Maneuver::STOP;
            return Some(AvoidObstacle::request(Evasion { angle, left: 0.0, right: 0.0, duration }));
        }
        let robot = sensors.robot.get()?;
        let Maneuver { angle, linear, duration } = maneuver(sensors, robot, now)?;
        let wheels = robot.wheels_for(linear, 0.0);
        Some(AvoidObstacle::request(Evasion { angle, left: wheels.left, right: wheels.right, duration }))
    }
}

fn maneuver(sensors: &AvoidObstacleSensors, robot: &WheeledModel, now: &Tick) -> Option<Maneuver> {
    let AvoidObstacleSensors { sonar, robots, odometry, rules, .. } = sensors;
    let is_blind = is_blind(SONAR, sonar, rules, robot, now)
        || is_blind(ROBOT_SENSOR, robots, rules, robot, now)
        || has_lost(ODOMETRY, odometry, robot, now);
    // The same without an outline, a rule or a scan.
    let (false, Ok(footprint), Some(thresholds), Some(scan)) =
        (is_blind, Footprint::of(&robot.chassis.outline), rules.get(), sonar.get())
    else {
        return Some(Maneuver::STOP);
    };
    let seen = robots.get().filter(|_| !is_late(ROBOT_SENSOR, robots, robot, now));
    let discs = seen.into_iter().flat_map(|robots| robots.list.iter()).map(|seen| Disc {
        x: seen.range * math::cos(seen.bearing),
        y: seen.range * math::sin(seen.bearing),
        radius: robot.detected_radius,
    });
    // A robot without encoders may be as fast as it can.
    let greatest = robot.chassis.maximum_wheel_speed * robot.chassis.wheel_radius;
    let twist = odometry.get().map_or(Twist2 { linear: greatest, angular: 0.0 }, |odometry| odometry.twist);
    react(&thresholds.avoid_obstacle, &footprint, &ReflexInput::new(scan, discs, twist))
}
