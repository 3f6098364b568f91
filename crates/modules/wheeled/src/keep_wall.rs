//! Reflex: follows a wall at a distance.
//!
//! The side sonars give distance and direction of the wall. The robot steers by pure pursuit (Coulter, 1992)
//! for a lookahead point along the wall, at the set distance from it. At a wall ahead it turns away from the one
//! beside. Where the foremost sonar of that side has lost the wall and another one has not, it drives on an arc
//! about the end, an action that lasts until a wall is detected again or its time is up.

use slate_avoidance::SONAR;
use slate_plugin::interfaces::{SonarScan, WheelSpeeds};
use slate_plugin::prelude::*;

use crate::actions::{KeepWall, Speeds};
use crate::knowledge::WheeledModel;
use crate::late_sensors::{has_no_model, is_blind, is_late};
use crate::monitors::is_valid;
use crate::rules::{KeepWallRules, WheeledRules};

/// Sensors and knowledge of the reflex.
#[ports]
pub struct KeepWallSensors {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    /// Thresholds, from Knowledge.
    rules: Input<WheeledRules>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Duration of a command unless it is renewed, seconds.
const COMMAND_DURATION: f64 = 0.1;

/// Follows the wall on one side. It has neither a goal nor a memory.
pub struct KeepWallModel;

impl ReactiveModel for KeepWallModel {
    const NAME: &'static str = "keep_wall_model";
    const DOC: &'static str = "Follows a wall at a distance.";
    /// Below the avoidance of obstacles.
    const RANK: i32 = -1;
    type Sensors = KeepWallSensors;
    type Params = ();
    type State = ();

    fn run((): &mut (), sensors: &KeepWallSensors, (): &(), now: &Tick) -> Option<ActionRequest> {
        let KeepWallSensors { sonar, rules, robot } = sensors;
        if has_no_model(robot) {
            return Some(stop());
        }
        let robot = robot.get()?;
        let is_blind = is_blind(SONAR, sonar, rules, robot, now);
        let (false, Some(known)) = (is_blind || sonar.get().is_some_and(|scan| !is_valid(scan)), rules.get())
        else {
            return Some(stop());
        };
        let rules = &known.keep_wall;
        let scan = sonar.get().filter(|_| !is_late(SONAR, sonar, robot, now))?;
        let ([x, y], duration) = rules.target(scan)?;
        let bearing = math::atan2(y, x);
        let linear = rules.linear_velocity * math::max(math::cos(bearing), 0.0);
        // Pure pursuit: curvature 2 sin(bearing) / lookahead; saturated where the arc is too narrow.
        let angular = 2.0 * rules.linear_velocity * math::sin(bearing) / rules.lookahead_distance;
        let limit = rules.max_angular_velocity;
        let WheelSpeeds { left, right } = robot.wheels_for(linear, math::clamp(angular, -limit, limit));
        Some(KeepWall::request(Speeds { left, right, duration }))
    }
}

fn stop() -> ActionRequest {
    KeepWall::request(Speeds { left: 0.0, right: 0.0, duration: COMMAND_DURATION })
}

impl KeepWallRules {
    /// Returns the point to pursue (robot's frame, meters) and its duration, seconds.
    /// `None` without a wall on that side.
    fn target(&self, scan: &SonarScan) -> Option<([f64; 2], f64)> {
        let (side, wanted) = (self.wall_distance.signum(), self.wall_distance.abs());
        let lookahead = self.lookahead_distance;
        if self.range_ahead(scan) < wanted + self.front_margin {
            let (sine, cosine) = (math::sin(self.turn_angle), math::cos(self.turn_angle));
            return Some(([cosine, -side * sine].map(|part| part * lookahead), COMMAND_DURATION));
        }
        let (wall, is_ending) = self.wall_beside(scan, side)?;
        if is_ending {
            // The arc through this point, along the present heading, leads about the end of the wall.
            let turn = math::asin(math::min(lookahead / (2.0 * math::max(wanted, 0.01)), 1.0));
            let point = [math::cos(turn), side * math::sin(turn)].map(|part| part * lookahead);
            return Some((point, self.timeout));
        }
        let ([across, towards], distance) = wall;
        // A distant wall is approached at an angle, not head-on.
        let error = math::clamp(distance - wanted, -lookahead, lookahead);
        let along = [side * towards, -side * across];
        Some((
            [lookahead * along[0] + error * across, lookahead * along[1] + error * towards],
            COMMAND_DURATION,
        ))
    }

    /// Returns the wall on one side, and whether it ends beside the robot.
    /// The side is 1 on the left, -1 on the right; the wall ends if the foremost sonar of that side does not detect it.
    fn wall_beside(&self, scan: &SonarScan, side: f64) -> Option<(Wall, bool)> {
        let (mut front, mut back): (Option<[f64; 3]>, Option<[f64; 3]>) = (None, None);
        let mut foremost = f64::NEG_INFINITY;
        for (placement, echo) in scan.placements.iter().zip(scan.echoes.iter()) {
            let aside = math::angle_between(side * std::f64::consts::FRAC_PI_2, placement.theta).abs();
            if aside > self.side_tolerance {
                continue;
            }
            foremost = math::max(foremost, placement.x);
            if !echo.heard.get() || !echo.range.is_finite() || echo.range > self.max_range {
                continue;
            }
            let heard = [placement.x, placement.y, echo.range];
            if front.is_none_or(|front| heard[0] > front[0]) {
                front = Some(heard);
            }
            if back.is_none_or(|back| heard[0] < back[0]) {
                back = Some(heard);
            }
        }
        let front = front?;
        Some((wall(front, back?, side), front[0] < foremost))
    }

    /// Returns the distance from the robot's center to the nearest obstacle ahead.
    fn range_ahead(&self, scan: &SonarScan) -> f64 {
        let both = scan.placements.iter().zip(scan.echoes.iter());
        let heard = both
            .filter(|(placement, echo)| placement.theta.abs() <= self.front_tolerance && echo.heard.get());
        let distances = heard.map(|(placement, echo)| placement.x + echo.range * math::cos(placement.theta));
        distances.filter(|distance| distance.is_finite()).fold(f64::INFINITY, math::min)
    }
}

/// Direction towards a wall, of length 1, and its distance from the robot's center.
type Wall = ([f64; 2], f64);

/// Returns the wall through the echoes of a front and a rear sonar.
/// Each echo is x, y and range, meters.
fn wall(front: [f64; 3], back: [f64; 3], side: f64) -> Wall {
    let base = front[0] - back[0];
    // A sonar measures the nearest point of a wall, so ranges differ by the mounts' distances from the wall.
    let across = if base > 0.05 { math::clamp((back[2] - front[2]) / base, -0.7, 0.7) } else { 0.0 };
    let towards = side * (1.0 - across * across).sqrt();
    let distance = |[x, y, range]: [f64; 3]| range + x * across + y * towards;
    ([across, towards], (distance(front) + distance(back)) / 2.0)
}
