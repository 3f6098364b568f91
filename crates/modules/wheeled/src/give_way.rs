//! Reflex of a stopped robot: gives way to another robot that comes too close.

use slate_avoidance::{ROBOT_SENSOR, SONAR};
use slate_plugin::interfaces::{Echo, Odometry, Sighting, Sightings, SonarPlacement, SonarScan, WheelSpeeds};
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};
use crate::knowledge::{ODOMETRY, WheeledModel};
use crate::late_sensors::{has_lost, has_no_model, is_blind, is_late};
use crate::monitors::is_valid;
use crate::rules::{GiveWayRules, WheeledRules};

/// Sensors and knowledge of the reflex.
#[ports]
pub struct GiveWaySensors {
    #[stale(after = "200ms")]
    robots: Input<Sightings>,
    /// Obstacles in its path.
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    /// Twist of the robot, which gives way only when it does not drive on.
    #[stale(after = "200ms")]
    odometry: Input<Odometry>,
    /// Thresholds, from Knowledge.
    rules: Input<WheeledRules>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Duration of a command unless it is renewed, seconds.
const COMMAND_DURATION: f64 = 0.1;

/// Moves away from a robot ahead or behind.
/// It knows neither a goal nor a position, and has no memory.
pub struct GiveWayModel;

impl ReactiveModel for GiveWayModel {
    const NAME: &'static str = "give_way_model";
    const DOC: &'static str = "Gives way to a robot that comes too close to this one while it stands.";
    const RANK: i32 = 1;
    type Sensors = GiveWaySensors;
    type Params = ();
    type State = ();

    fn run((): &mut (), sensors: &GiveWaySensors, (): &(), now: &Tick) -> Option<ActionRequest> {
        let wheels = if has_no_model(&sensors.robot) {
            WheelSpeeds::ZERO
        } else {
            let robot = sensors.robot.get()?;
            robot.wheels_for(sensors.velocity(robot, now)?, 0.0)
        };
        let WheelSpeeds { left, right } = wheels;
        Some(AvoidObstacle::request(Evasion { angle: 0.0, left, right, duration: COMMAND_DURATION }))
    }
}

impl GiveWaySensors {
    /// Returns the linear velocity, m/s.
    /// Zero without rules, or while a sensor with a rule or the odometry is late.
    fn velocity(&self, robot: &WheeledModel, now: &Tick) -> Option<f64> {
        let Self { robots, sonar, odometry, rules, .. } = self;
        let is_blind = is_blind(SONAR, sonar, rules, robot, now)
            || is_blind(ROBOT_SENSOR, robots, rules, robot, now)
            || has_lost(ODOMETRY, odometry, robot, now);
        let (false, Some(rules)) = (is_blind || sonar.get().is_some_and(|scan| !is_valid(scan)), rules.get())
        else {
            return Some(0.0);
        };
        let scan = sonar.get().filter(|_| !is_late(SONAR, sonar, robot, now))?;
        let robots = robots.get().filter(|_| !is_late(ROBOT_SENSOR, robots, robot, now))?;
        rules.give_way.velocity(robots, scan, odometry.fresh()?.twist.linear)
    }
}

impl GiveWayRules {
    /// Returns the linear velocity away from all robots that are too close, m/s.
    /// `None` without such a robot, or without free space.
    fn velocity(&self, robots: &Sightings, scan: &SonarScan, speed: f64) -> Option<f64> {
        // NaN is nowhere.
        let near = |seen: &&Sighting| seen.range < self.min_separation && seen.bearing.is_finite();
        let side = |seen: &Sighting| match seen.bearing.abs() {
            ahead if ahead < self.max_bearing => Some(-self.linear_velocity),
            behind if behind > std::f64::consts::PI - self.max_bearing => Some(self.linear_velocity),
            // A robot from the side passes, or stops: this one can't make room.
            _ => None,
        };
        let mut ways = robots.list.iter().filter(near).filter_map(side);
        let linear = ways.next()?;
        // Between two robots, or towards another one, no direction is free: the others must give way.
        if ways.any(|way| way != linear) || speed * linear.signum() < -self.standing_velocity {
            return None;
        }
        let heard = |(echo, placement): (&Echo, &SonarPlacement)| {
            echo.heard.get() && echo.range < self.min_clearance && math::cos(placement.theta) * linear > 0.0
        };
        let mut echoes = scan.echoes.iter().zip(scan.placements.iter());
        (!echoes.any(heard)).then_some(linear)
    }
}
