//! A reflex that has the robot go along a wall, which it keeps at a distance beside it.
//!
//! The sonars beside the robot tell how far away the wall is and which way it runs. The robot heads for a point that is a way
//! ahead along the wall and at the distance wanted from it, so it comes nearer the more slowly the nearer it is. Where a wall
//! stands ahead it turns away from the one beside, until what was ahead is beside; where the wall ends it turns about the end.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Position, SonarScan};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::actions::{KeepWall, Speeds};
use crate::knowledge::WheeledModel;

/// What it hears, and where it is.
#[ports]
pub struct KeepWallSensors {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    #[stale(after = "200ms")]
    position: Input<Position>,
    #[stale(after = "200ms")]
    orientation: Input<Orientation>,
    /// Where the robot shall go without a wall, from its knowledge.
    goal: Input<Point2>,
    /// The robot's body, from its knowledge.
    robot: Input<WheeledModel>,
    /// Where the robot heads: along the wall, or else for its goal. A reflex that leads it round obstacles leads it there.
    heading_for: Output<Point2>,
}

/// Which wall, and how it is kept.
#[params]
pub struct KeepWallParams {
    #[param(default = 0.5, range = -10.0..=10.0, unit = "m", doc = "the wall is kept so far to the left of the robot's middle; to the right when it is less than 0")]
    pub distance: f64,
    #[param(default = 0.3, range = 0.0..=1.2, unit = "m/s", doc = "speed along the wall")]
    speed: f64,
    #[param(default = 1.2, range = 0.1..=5.0, unit = "rad/s", doc = "highest rate of turn")]
    turn_rate: f64,
    #[param(default = 0.4, range = 0.05..=10.0, unit = "m", doc = "how far ahead the point is that it heads for; more is calmer")]
    look_ahead: f64,
    #[param(default = 1.0, range = 0.0..=10.0, unit = "m", doc = "what the robot's middle is farther away from is no wall to go along")]
    reach: f64,
    #[param(default = 4.0, range = 0.0..=60.0, unit = "s", doc = "it looks for a wall that has ended for so long")]
    memory: f64,
}

/// When it had the wall beside it last, seconds.
#[derive(Default, Serialize, Deserialize)]
pub struct LastWall {
    heard: Option<f64>,
}

/// A sonar looks to the side, or ahead, when it is at most so far off, radians.
const SIDE: f64 = 0.4;
const AHEAD: f64 = 0.6;
/// It begins to turn away from what is ahead so much before it is at the distance that it keeps, metres.
const ROOM: f64 = 0.3;
/// How far it turns from what is ahead, radians.
const AWAY: f64 = 1.0;
/// A command holds for this long unless it is renewed, seconds.
const HOLD: f64 = 0.1;

/// Goes along the wall on one side.
pub struct KeepWallModel;

impl ReactiveModel for KeepWallModel {
    const NAME: &'static str = "keep_wall_model";
    const DOC: &'static str = "Goes along a wall at a distance.";
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
        let (side, wanted) = (params.distance.signum(), params.distance.abs());
        let beside = beside(scan, side).filter(|(_, distance)| *distance < params.reach);
        if beside.is_some() {
            wall.heard = Some(now.seconds());
        }
        let is_ahead = ahead(scan) < wanted + ROOM;
        let remembered = wall.heard.is_some_and(|heard| now.seconds() - heard < params.memory);
        // In the robot's frame.
        let [x, y] = match beside {
            _ if is_ahead => [math::cos(AWAY), -side * math::sin(AWAY)].map(|part| part * params.look_ahead),
            Some(([across, towards], distance)) => {
                // A wall that is far is come to at an angle, and not head-on.
                let error = math::clamp(distance - wanted, -params.look_ahead, params.look_ahead);
                let along = [side * towards, -side * across];
                [
                    params.look_ahead * along[0] + error * across,
                    params.look_ahead * along[1] + error * towards,
                ]
            }
            // The arc through that point, along the present heading, is one about the end of the wall.
            None if remembered => {
                let turn = math::min(params.look_ahead / (2.0 * math::max(wanted, 0.01)), 1.0);
                let turn = math::asin(turn);
                [math::cos(turn), side * math::sin(turn)].map(|part| part * params.look_ahead)
            }
            None => {
                if let Some(goal) = sensors.goal.fresh() {
                    sensors.heading_for.set(*goal);
                }
                return None;
            }
        };
        let (sine, cosine) = (math::sin(orientation.theta), math::cos(orientation.theta));
        sensors
            .heading_for
            .set(Point2 { x: position.x + cosine * x - sine * y, y: position.y + sine * x + cosine * y });
        let bearing = math::atan2(y, x);
        let linear = params.speed * math::max(math::cos(bearing), 0.0);
        // The arc that leads there, and as fast a turn as there may be where it would be too narrow.
        let angular = 2.0 * params.speed * math::sin(bearing) / params.look_ahead;
        let wheels = robot.wheels_for(linear, math::clamp(angular, -params.turn_rate, params.turn_rate));
        Some(KeepWall::request(Speeds { left: wheels.left, right: wheels.right, duration: HOLD }))
    }
}

/// The wall beside the robot: the direction towards it in the robot's frame, and the distance of the robot's middle.
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
    // A sonar hears the nearest point of a wall, so its range falls by how much nearer to the wall it sits.
    let across = if base > 0.05 { math::clamp((back[2] - front[2]) / base, -0.7, 0.7) } else { 0.0 };
    let towards = side * (1.0 - across * across).sqrt();
    let distance = |[x, y, range]: [f64; 3]| range + x * across + y * towards;
    Some(([across, towards], (distance(front) + distance(back)) / 2.0))
}

/// How far ahead of the robot's middle the nearest thing is.
fn ahead(scan: &SonarScan) -> f64 {
    let both = scan.placements.iter().zip(scan.echoes.iter());
    let heard = both.filter(|(placement, echo)| placement.theta.abs() <= AHEAD && echo.heard.get());
    let distances = heard.map(|(placement, echo)| placement.x + echo.range * math::cos(placement.theta));
    distances.filter(|distance| distance.is_finite()).fold(f64::INFINITY, math::min)
}
