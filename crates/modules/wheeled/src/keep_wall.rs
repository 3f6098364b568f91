//! Reflex: follows a wall at a distance.
//!
//! The side sonars give distance and direction of the wall. The robot steers by pure pursuit (Coulter, 1992)
//! for a lookahead point along the wall, at the set distance from it. At a wall ahead it turns away from the one
//! beside; at the end of a wall it turns about the end.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Position, SonarScan};
use slate_plugin::prelude::*;

use crate::actions::{KeepWall, Speeds};
use crate::knowledge::WheeledModel;

/// Sensors and knowledge of the reflex.
#[ports]
pub struct KeepWallSensors {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    #[stale(after = "200ms")]
    position: Input<Position>,
    #[stale(after = "200ms")]
    orientation: Input<Orientation>,
    /// Goal without a wall, from Knowledge.
    goal: Input<Point2>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
    /// Lookahead point along the wall; without a wall, the goal.
    local_goal: Output<Point2>,
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
    #[param(default = 4.0, range = 0.0..=60.0, unit = "s", doc = "time that a lost wall is searched for")]
    wall_timeout: f64,
}

/// Time of the newest wall beside the robot, seconds.
#[derive(Default, Serialize, Deserialize)]
pub struct LastWall {
    heard: Option<f64>,
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

/// Follows the wall on one side.
pub struct KeepWallModel;

impl ReactiveModel for KeepWallModel {
    const NAME: &'static str = "keep_wall_model";
    const DOC: &'static str = "Follows a wall at a distance.";
    /// Below the avoidance of obstacles.
    const RANK: i32 = -1;
    type Sensors = KeepWallSensors;
    type Params = KeepWallParams;
    type State = LastWall;

    fn run(
        wall: &mut LastWall,
        sensors: &KeepWallSensors,
        params: &KeepWallParams,
        now: &Tick,
    ) -> Option<ActionRequest> {
        let (scan, position, orientation) =
            (sensors.sonar.fresh()?, sensors.position.fresh()?, sensors.orientation.fresh()?);
        let robot = sensors.robot.fresh()?;
        let (side, wanted) = (params.wall_distance.signum(), params.wall_distance.abs());
        let beside = beside(scan, side).filter(|(_, distance)| *distance < params.max_wall_range);
        if beside.is_some() {
            wall.heard = Some(now.seconds());
        }
        let is_ahead = ahead(scan) < wanted + ROOM;
        let remembered = wall.heard.is_some_and(|heard| now.seconds() - heard < params.wall_timeout);
        // In the robot's frame.
        let [x, y] = match beside {
            _ if is_ahead => {
                [math::cos(AWAY), -side * math::sin(AWAY)].map(|part| part * params.lookahead_distance)
            }
            Some(([across, towards], distance)) => {
                // A distant wall is approached at an angle, not head-on.
                let error =
                    math::clamp(distance - wanted, -params.lookahead_distance, params.lookahead_distance);
                let along = [side * towards, -side * across];
                [
                    params.lookahead_distance * along[0] + error * across,
                    params.lookahead_distance * along[1] + error * towards,
                ]
            }
            // The arc through this point, along the present heading, leads about the end of the wall.
            None if remembered => {
                let turn = math::min(params.lookahead_distance / (2.0 * math::max(wanted, 0.01)), 1.0);
                let turn = math::asin(turn);
                [math::cos(turn), side * math::sin(turn)].map(|part| part * params.lookahead_distance)
            }
            None => {
                if let Some(goal) = sensors.goal.fresh() {
                    sensors.local_goal.set(*goal);
                }
                return None;
            }
        };
        let (sine, cosine) = (math::sin(orientation.theta), math::cos(orientation.theta));
        sensors
            .local_goal
            .set(Point2 { x: position.x + cosine * x - sine * y, y: position.y + sine * x + cosine * y });
        let bearing = math::atan2(y, x);
        let linear = params.linear_velocity * math::max(math::cos(bearing), 0.0);
        // Pure pursuit: curvature 2 sin(bearing) / lookahead; saturated where the arc is too narrow.
        let angular = 2.0 * params.linear_velocity * math::sin(bearing) / params.lookahead_distance;
        let wheels = robot.wheels_for(
            linear,
            math::clamp(angular, -params.max_angular_velocity, params.max_angular_velocity),
        );
        Some(KeepWall::request(Speeds { left: wheels.left, right: wheels.right, duration: HOLD }))
    }
}

/// Direction of the wall beside, in the robot's frame, and its distance from the robot's center.
fn beside(scan: &SonarScan, side: f64) -> Option<([f64; 2], f64)> {
    let (mut front, mut back): (Option<[f64; 3]>, Option<[f64; 3]>) = (None, None);
    for (placement, echo) in scan.placements.iter().zip(scan.echoes.iter()) {
        let aside = math::angle_between(side * std::f64::consts::FRAC_PI_2, placement.theta).abs();
        if !echo.heard.get() || !echo.range.is_finite() || aside > SIDE {
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
    Some(([across, towards], (distance(front) + distance(back)) / 2.0))
}

/// Returns the distance from the robot's center to the nearest obstacle ahead.
fn ahead(scan: &SonarScan) -> f64 {
    let both = scan.placements.iter().zip(scan.echoes.iter());
    let heard = both.filter(|(placement, echo)| placement.theta.abs() <= AHEAD && echo.heard.get());
    let distances = heard.map(|(placement, echo)| placement.x + echo.range * math::cos(placement.theta));
    distances.filter(|distance| distance.is_finite()).fold(f64::INFINITY, math::min)
}
