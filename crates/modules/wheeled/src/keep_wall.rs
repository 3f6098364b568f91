//! Reflex: follows a wall at a distance.
//!
//! The side sonars give distance and direction of the wall. The robot steers by pure pursuit (Coulter, 1992)
//! for a lookahead point along the wall, at the set distance from it. At a wall ahead it turns away from the one
//! beside. Where the foremost sonar of that side has lost the wall and another one has not, it drives on an arc
//! about the end, an action that lasts until a wall is heard again or its time is up.

use slate_avoidance::{ReflexRules, SONAR};
use slate_plugin::interfaces::{SonarScan, WheelSpeeds};
use slate_plugin::prelude::*;

use crate::actions::{KeepWall, Speeds};
use crate::knowledge::WheeledModel;
use crate::late_sensors::{is_blind, is_late};
use crate::monitors::is_valid;

/// Sensors and knowledge of the reflex.
#[ports]
pub struct KeepWallSensors {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    /// Which sensors must not stop, from Knowledge.
    rules: Input<ReflexRules>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Parameters of [`KeepWallModel`].
#[params]
pub struct KeepWallParams {
    #[param(default = 0.5, range = -10.0..=10.0, unit = "m", doc = "distance of the robot's center from a wall on the left; negative: on the right")]
    pub wall_distance: f64,
    #[param(default = 0.3, range = 0.0..=1.2, unit = "m/s", doc = "linear velocity along the wall")]
    linear_velocity: f64,
    #[param(default = 1.2, range = 0.1..=5.0, unit = "rad/s", doc = "maximum angular velocity")]
    max_angular_velocity: f64,
    #[param(default = 0.4, range = 0.05..=10.0, unit = "m", doc = "lookahead distance of pure pursuit")]
    lookahead_distance: f64,
    #[param(default = 1.0, range = 0.0..=10.0, unit = "m", doc = "maximum range at which a wall is followed")]
    max_wall_range: f64,
    #[param(default = 4.0, range = 0.0..=60.0, unit = "s", doc = "time of the arc about the end of a wall")]
    wall_timeout: f64,
}

/// Tolerance in direction of a sonar to the side, and ahead, radians.
const SIDE: f64 = 0.4;
const AHEAD: f64 = 0.6;
/// Margin over the wall distance at which it turns away from an obstacle ahead, metres.
const ROOM: f64 = 0.3;
/// Angle by which it turns away from an obstacle ahead, radians.
const AWAY: f64 = 1.0;
/// Duration of a command unless it is renewed, seconds.
const HOLD: f64 = 0.1;

/// Follows the wall on one side. It has neither a goal nor a memory.
pub struct KeepWallModel;

impl ReactiveModel for KeepWallModel {
    const NAME: &'static str = "keep_wall_model";
    const DOC: &'static str = "Follows a wall at a distance.";
    /// Below the avoidance of obstacles.
    const RANK: i32 = -1;
    type Sensors = KeepWallSensors;
    type Params = KeepWallParams;
    type State = ();

    fn run(
        (): &mut (),
        sensors: &KeepWallSensors,
        params: &KeepWallParams,
        now: &Tick,
    ) -> Option<ActionRequest> {
        let KeepWallSensors { sonar, rules, robot } = sensors;
        let robot = robot.get()?;
        let is_invalid = sonar.get().is_some_and(|scan| !is_valid(scan));
        if is_invalid || is_blind(SONAR, sonar, rules, robot, now) {
            return Some(KeepWall::request(Speeds { left: 0.0, right: 0.0, duration: HOLD }));
        }
        let scan = sonar.get().filter(|_| !is_late(SONAR, sonar, robot, now))?;
        let ([x, y], duration) = params.target(scan)?;
        let bearing = math::atan2(y, x);
        let linear = params.linear_velocity * math::max(math::cos(bearing), 0.0);
        // Pure pursuit: curvature 2 sin(bearing) / lookahead; saturated where the arc is too narrow.
        let angular = 2.0 * params.linear_velocity * math::sin(bearing) / params.lookahead_distance;
        let limit = params.max_angular_velocity;
        let WheelSpeeds { left, right } = robot.wheels_for(linear, math::clamp(angular, -limit, limit));
        Some(KeepWall::request(Speeds { left, right, duration }))
    }
}

impl KeepWallParams {
    /// The point to pursue, in the robot's frame, metres, and for how long, seconds; `None` without a wall on that side.
    fn target(&self, scan: &SonarScan) -> Option<([f64; 2], f64)> {
        let (side, wanted) = (self.wall_distance.signum(), self.wall_distance.abs());
        let lookahead = self.lookahead_distance;
        if ahead(scan) < wanted + ROOM {
            return Some(([math::cos(AWAY), -side * math::sin(AWAY)].map(|part| part * lookahead), HOLD));
        }
        let (wall, is_ending) = beside(scan, side, self.max_wall_range)?;
        if is_ending {
            // The arc through this point, along the present heading, leads about the end of the wall.
            let turn = math::asin(math::min(lookahead / (2.0 * math::max(wanted, 0.01)), 1.0));
            let point = [math::cos(turn), side * math::sin(turn)].map(|part| part * lookahead);
            return Some((point, self.wall_timeout));
        }
        let ([across, towards], distance) = wall;
        // A distant wall is approached at an angle, not head-on.
        let error = math::clamp(distance - wanted, -lookahead, lookahead);
        let along = [side * towards, -side * across];
        Some(([lookahead * along[0] + error * across, lookahead * along[1] + error * towards], HOLD))
    }
}

/// Direction towards a wall, of length 1, and its distance from the robot's center.
type Wall = ([f64; 2], f64);

/// Returns the wall beside, and whether the foremost sonar of that side does not hear it.
fn beside(scan: &SonarScan, side: f64, max_range: f64) -> Option<(Wall, bool)> {
    let (mut front, mut back): (Option<[f64; 3]>, Option<[f64; 3]>) = (None, None);
    let mut foremost = f64::NEG_INFINITY;
    for (placement, echo) in scan.placements.iter().zip(scan.echoes.iter()) {
        let aside = math::angle_between(side * std::f64::consts::FRAC_PI_2, placement.theta).abs();
        if aside > SIDE {
            continue;
        }
        foremost = math::max(foremost, placement.x);
        if !echo.heard.get() || !echo.range.is_finite() || echo.range > max_range {
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
    let (front, back) = (front?, back?);
    let base = front[0] - back[0];
    // A sonar measures the nearest point of a wall, so ranges differ by the mounts' distances from the wall.
    let across = if base > 0.05 { math::clamp((back[2] - front[2]) / base, -0.7, 0.7) } else { 0.0 };
    let towards = side * (1.0 - across * across).sqrt();
    let distance = |[x, y, range]: [f64; 3]| range + x * across + y * towards;
    let wall = ([across, towards], (distance(front) + distance(back)) / 2.0);
    Some((wall, front[0] < foremost))
}

/// Returns the distance from the robot's center to the nearest obstacle ahead.
fn ahead(scan: &SonarScan) -> f64 {
    let both = scan.placements.iter().zip(scan.echoes.iter());
    let heard = both.filter(|(placement, echo)| placement.theta.abs() <= AHEAD && echo.heard.get());
    let distances = heard.map(|(placement, echo)| placement.x + echo.range * math::cos(placement.theta));
    distances.filter(|distance| distance.is_finite()).fold(f64::INFINITY, math::min)
}
