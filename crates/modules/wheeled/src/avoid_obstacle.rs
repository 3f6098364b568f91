//! Reflex: avoids obstacles on the way to the goal.

use serde::{Deserialize, Serialize};
use slate_avoidance::{Avoider, Decision, Footprint, Other, Parameters};
use slate_plugin::interfaces::{
    Echo, Orientation, Point2, Pose2, Position, Sightings, SonarPlacement, SonarScan, Twist2, WheelSpeeds,
};
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};
use crate::knowledge::WheeledModel;
use crate::own_motion::OwnMotion;
use crate::tracks::{Track, Tracks};

/// Sensors and knowledge of the reflex.
#[ports]
pub struct AvoidObstacleSensors {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    #[stale(after = "200ms")]
    position: Input<Position>,
    #[stale(after = "200ms")]
    orientation: Input<Orientation>,
    /// Other robots, if a sensor detects them.
    #[stale(after = "500ms")]
    robots: Input<Sightings>,
    /// Goal, from Knowledge.
    goal: Input<Point2>,
    /// Twist that the Plan intends, if it reports one; else straight to the goal.
    #[stale(after = "1s")]
    motion: Input<Twist2>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Parameters of [`AvoidObstacleModel`].
#[params]
pub struct AvoidObstacleParams {
    #[param(default = 0.4, range = 0.0..=3.0, unit = "m/s", doc = "maximum linear velocity")]
    max_linear_velocity: f64,
    #[param(default = 1.2, range = 0.1..=5.0, unit = "rad/s", doc = "maximum angular velocity")]
    max_angular_velocity: f64,
    #[param(default = 0.025, range = 0.0..=1.0, unit = "m", doc = "minimum clearance from static obstacles")]
    pub min_clearance: f64,
    #[param(default = 0.28, range = 0.0..=10.0, unit = "m", doc = "radius of other robots")]
    other_robot_radius: f64,
    #[param(default = 6.0, range = 0.1..=1e6, unit = "s", doc = "age after which an obstacle is forgotten; more without sonars all around")]
    obstacle_timeout: f64,
    #[param(default = 4.0, range = 0.0..=1e6, unit = "s", doc = "time without progress after which it accepts less clearance")]
    progress_timeout: f64,
    #[param(default = 1e6, range = 0.0..=1e6, unit = "m", doc = "half the side of a known square room about the origin")]
    pub room_half_width: f64,
}

/// State of [`AvoidObstacleModel`].
#[derive(Default, Serialize, Deserialize)]
pub struct AvoidObstacleState {
    avoider: Option<Avoider>,
    others: Tracks,
    motion: OwnMotion,
}

/// Duration of a command unless it is renewed, seconds.
const HOLD: f64 = 0.1;

/// Tolerance of an echo from a detected robot, metres.
const SPREAD: f64 = 0.1;

/// Leads the robot round obstacles that its sonars detect.
pub struct AvoidObstacleModel;

impl ReactiveModel for AvoidObstacleModel {
    const NAME: &'static str = "avoid_obstacle_model";
    const DOC: &'static str = "Leads the robot round obstacles that its sonars detect.";
    type Sensors = AvoidObstacleSensors;
    type Params = AvoidObstacleParams;
    type State = AvoidObstacleState;

    fn run(
        memory: &mut AvoidObstacleState,
        sensors: &AvoidObstacleSensors,
        params: &AvoidObstacleParams,
        now: &Tick,
    ) -> Option<ActionRequest> {
        let (scan, position, orientation) =
            (sensors.sonar.fresh()?, sensors.position.fresh()?, sensors.orientation.fresh()?);
        let (goal, robot) = (sensors.goal.fresh()?, sensors.robot.fresh()?);
        let AvoidObstacleState { avoider, others, motion } = memory;
        let avoider = match avoider {
            Some(avoider) => avoider,
            None => {
                let corners: Vec<_> =
                    robot.chassis.outline.iter().map(|corner| [corner.x, corner.y]).collect();
                // The simulator or driver has checked that it is convex; without an outline the reflex is off.
                avoider.insert(Avoider::new(Footprint::new(&corners).ok()?))
            }
        };
        let pose = Pose2 { x: position.x, y: position.y, theta: orientation.theta };
        let moving = motion.notice(pose, now.seconds());
        let usual = Parameters::default();
        let deceleration = robot.deceleration();
        let parameters = Parameters {
            max_linear_velocity: params.max_linear_velocity,
            max_angular_velocity: params.max_angular_velocity,
            min_clearance: params.min_clearance,
            obstacle_timeout: params.obstacle_timeout,
            progress_timeout: params.progress_timeout,
            // The present motion of a robot that stops at once makes no difference.
            sides: robot.sides().filter(|sides| sides.acceleration < usual.deceleration),
            room_half_width: (params.room_half_width < 1e6).then_some(params.room_half_width),
            deceleration,
            angular_deceleration: math::min(
                usual.angular_deceleration,
                2.0 * deceleration / robot.chassis.track,
            ),
            ..usual
        };
        let mut scan = *scan;
        if let Some(room) = parameters.room_half_width {
            leave_out(&mut scan, |placement, echo, scan| is_echo_of_room(pose, placement, echo, scan, room));
        }
        if let Some(robots) = sensors.robots.fresh() {
            // An older detection, transformed by the present pose, would move.
            if sensors.robots.updated().is_some() {
                others.see(pose, robots, now.seconds());
            }
            // Echoes of robots are no static obstacles.
            leave_out(&mut scan, |placement, echo, scan| {
                others
                    .iter()
                    .any(|other| is_echo_of(pose, placement, echo, scan, other, params.other_robot_radius))
            });
            let disc = |other: &Track| Other {
                x: other.x,
                y: other.y,
                radius: params.other_robot_radius,
                velocity: other.velocity,
            };
            avoider.see(others.iter().map(disc), now.seconds());
        }
        avoider.hear(pose, &scan, &parameters, now.seconds());
        let planned = sensors.motion.fresh().copied();
        let decision = avoider.guard(pose, moving, *goal, planned, &parameters, now.seconds());
        let Decision::Avoid(twist) = decision else { return None };
        let WheelSpeeds { left, right } = robot.wheels_for(twist.linear, twist.angular);
        Some(AvoidObstacle::request(Evasion { angle: 0.0, left, right, duration: HOLD }))
    }
}

/// Replaces known echoes by NaN, so that they mark no obstacle.
fn leave_out(scan: &mut SonarScan, is_known: impl Fn(&SonarPlacement, &Echo, &SonarScan) -> bool) {
    let mut echoes = [Echo::default(); 16];
    for ((heard, echo), placement) in echoes.iter_mut().zip(scan.echoes.iter()).zip(scan.placements.iter()) {
        let range = if is_known(placement, echo, scan) { f64::NAN } else { echo.range };
        *heard = Echo { range, ..*echo };
    }
    scan.echoes = Sequence::new(&echoes[..scan.echoes.len()]);
}

/// Returns whether an echo may come from a wall of the known room, whose position is known better.
fn is_echo_of_room(
    pose: Pose2,
    placement: &SonarPlacement,
    echo: &Echo,
    scan: &SonarScan,
    room: f64,
) -> bool {
    let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
    let x = pose.x + cosine * placement.x - sine * placement.y;
    let y = pose.y + sine * placement.x + cosine * placement.y;
    let along = |angle: f64| {
        let (east, north) = (math::cos(angle), math::sin(angle));
        let to = |at: f64, way: f64| {
            if way.abs() > 1e-6 { (room - at * way.signum()) / way.abs() } else { f64::INFINITY }
        };
        math::min(to(x, east), to(y, north))
    };
    let (axis, half) = (pose.theta + placement.theta, scan.field_of_view / 2.0);
    let nearest = math::min(along(axis), math::min(along(axis - half), along(axis + half)));
    echo.heard.get() && echo.range >= nearest - SPREAD
}

/// Returns whether an echo may come from a detected robot.
fn is_echo_of(
    pose: Pose2,
    placement: &SonarPlacement,
    echo: &Echo,
    scan: &SonarScan,
    other: &Track,
    radius: f64,
) -> bool {
    let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
    let dx = other.x - (pose.x + cosine * placement.x - sine * placement.y);
    let dy = other.y - (pose.y + sine * placement.x + cosine * placement.y);
    let distance = math::hypot(dx, dy);
    let aside = math::angle_between(pose.theta + placement.theta, math::atan2(dy, dx)).abs();
    let wide = math::atan2(radius, distance) + scan.field_of_view / 2.0;
    echo.heard.get() && aside <= wide && (echo.range - distance).abs() <= radius + SPREAD
}
