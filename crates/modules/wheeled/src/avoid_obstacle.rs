//! Reflex: turns away from obstacles and drives on.

use slate_avoidance::{Disc, Footprint, Maneuver, ROBOT_SENSOR, ReflexInput, ReflexRules, react};
use slate_plugin::interfaces::{Odometry, Point2, Sightings, SonarScan};
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};
use crate::knowledge::WheeledModel;

/// Sensors and knowledge of the reflex.
#[ports]
pub struct AvoidObstacleSensors {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    /// Other robots, if a sensor detects them.
    #[stale(after = "500ms")]
    robots: Input<Sightings>,
    /// Twist of the robot, if a sensor measures it: a fast robot reacts earlier.
    #[stale(after = "200ms")]
    odometry: Input<Odometry>,
    /// Thresholds, from Knowledge.
    rules: Input<ReflexRules>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Radius of other robots, metres.
const ROBOT_RADIUS: f64 = 0.28;

/// Maps the newest measurements to `AvoidObstacle`, by the rules in Knowledge. It has no memory.
pub struct AvoidObstacleModel;

impl ReactiveModel for AvoidObstacleModel {
    const NAME: &'static str = "avoid_obstacle_model";
    const DOC: &'static str = "Turns away from obstacles that the sensors detect, and drives on.";
    type Sensors = AvoidObstacleSensors;
    type Params = ();
    type State = ();

    fn run(_: &mut (), sensors: &AvoidObstacleSensors, (): &(), _: &Tick) -> Option<ActionRequest> {
        let (rules, robot) = (sensors.rules.fresh()?, sensors.robot.fresh()?);
        let Maneuver { angle, linear, duration } = maneuver(sensors, rules, &robot.chassis.outline)?;
        let wheels = robot.wheels_for(linear, 0.0);
        Some(AvoidObstacle::request(Evasion { angle, left: wheels.left, right: wheels.right, duration }))
    }
}

fn maneuver(sensors: &AvoidObstacleSensors, rules: &ReflexRules, outline: &[Point2]) -> Option<Maneuver> {
    let robots = sensors.robots.fresh();
    // A sensor with a rule that has stopped counts as near.
    let is_blind = rules.distance(ROBOT_SENSOR).is_some() && robots.is_none();
    let Some(scan) = sensors.sonar.fresh().filter(|_| !is_blind) else { return Some(Maneuver::STOP) };
    let discs = robots.into_iter().flat_map(|robots| robots.list.iter()).map(|seen| Disc {
        x: seen.range * math::cos(seen.bearing),
        y: seen.range * math::sin(seen.bearing),
        radius: ROBOT_RADIUS,
    });
    let speed = sensors.odometry.fresh().map_or(0.0, |odometry| odometry.twist.linear);
    // The simulator or driver has checked that the outline is convex; without one the reflex is off.
    let footprint = Footprint::of(outline).ok()?;
    react(rules, &footprint, &ReflexInput::new(scan, discs, speed))
}
