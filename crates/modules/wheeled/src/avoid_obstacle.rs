//! The reactive behaviour: round what the sonars hear, towards the goal.

use serde::{Deserialize, Serialize};
use slate_avoidance::{Avoider, Decision, Footprint, Other, Parameters};
use slate_plugin::interfaces::{
    Echo, Orientation, Point2, Pose2, Position, Sightings, SonarPlacement, SonarScan, Twist2, WheelSpeeds,
};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};
use crate::knowledge::WheeledModel;
use crate::own_motion::OwnMotion;
use crate::tracks::{Track, Tracks};

/// The sensors it reacts to, and what it knows.
#[ports]
pub struct AvoidObstacleSensors {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    #[stale(after = "200ms")]
    position: Input<Position>,
    #[stale(after = "200ms")]
    orientation: Input<Orientation>,
    /// Other robots, if there is a sensor that sees them.
    #[stale(after = "500ms")]
    robots: Input<Sightings>,
    /// Where the robot shall go, from its knowledge.
    goal: Input<Point2>,
    /// How the Plan would move now, if it says so; else it is taken to go straight to the goal.
    #[stale(after = "1s")]
    motion: Input<Twist2>,
    /// The robot's body, from its knowledge.
    robot: Input<WheeledModel>,
}

/// How it avoids.
#[params]
pub struct AvoidObstacleParams {
    #[param(default = 0.4, range = 0.0..=3.0, unit = "m/s", doc = "highest speed forward")]
    speed: f64,
    #[param(default = 1.2, range = 0.1..=5.0, unit = "rad/s", doc = "highest rate of turn")]
    turn_rate: f64,
    #[param(default = 0.025, range = 0.0..=1.0, unit = "m", doc = "least distance to what stands")]
    pub margin: f64,
    #[param(default = 0.28, range = 0.0..=10.0, unit = "m", doc = "radius of the other robots that are seen")]
    other_radius: f64,
    #[param(default = 6.0, range = 0.1..=1e6, unit = "s", doc = "what was heard is remembered so long; longer without sonars all around")]
    memory: f64,
    #[param(default = 4.0, range = 0.0..=1e6, unit = "s", doc = "without progress for so long it gets bolder")]
    patience: f64,
    #[param(default = 1e6, range = 0.0..=1e6, unit = "m", doc = "the room is known to reach so far from the origin to each side")]
    pub room: f64,
}

/// What it remembers.
#[derive(Default, Serialize, Deserialize)]
pub struct Memory {
    avoider: Option<Avoider>,
    others: Tracks,
    motion: OwnMotion,
}

/// A command holds for this long unless it is renewed, seconds.
const HOLD: f64 = 0.1;

/// An echo may be off by so much from where a robot is seen, metres.
const SPREAD: f64 = 0.1;

/// Leads the robot round what its sonars hear.
pub struct AvoidObstacleModel;

impl ReactiveModel for AvoidObstacleModel {
    const NAME: &'static str = "avoid_obstacle_model";
    const DOC: &'static str = "Leads the robot round what its sonars hear.";
    type Sensors = AvoidObstacleSensors;
    type Params = AvoidObstacleParams;
    type State = Memory;

    fn run(
        memory: &mut Memory,
        sensors: &AvoidObstacleSensors,
        params: &AvoidObstacleParams,
        now: &Tick,
    ) -> Option<ActionRequest> {
        let (scan, position, orientation) =
            (sensors.sonar.fresh()?, sensors.position.fresh()?, sensors.orientation.fresh()?);
        let (goal, robot) = (sensors.goal.fresh()?, sensors.robot.fresh()?);
        let Memory { avoider, others, motion } = memory;
        let avoider = match avoider {
            Some(avoider) => avoider,
            None => {
                let corners: Vec<_> =
                    robot.chassis.outline.iter().map(|corner| [corner.x, corner.y]).collect();
                // Whoever embodies the robot has looked whether it is convex; without an outline there is no reflex.
                avoider.insert(Avoider::new(Footprint::new(&corners).ok()?))
            }
        };
        let pose = Pose2 { x: position.x, y: position.y, theta: orientation.theta };
        let moving = motion.notice(pose, now.seconds());
        let usual = Parameters::default();
        let deceleration = robot.deceleration();
        let parameters = Parameters {
            speed: params.speed,
            turn_rate: params.turn_rate,
            margin: params.margin,
            memory: params.memory,
            patience: params.patience,
            // Of one that stops at once it does not matter how it moves now.
            sides: robot.sides().filter(|sides| sides.acceleration < usual.deceleration),
            room: (params.room < 1e6).then_some(params.room),
            deceleration,
            angular_deceleration: math::min(
                usual.angular_deceleration,
                2.0 * deceleration / robot.chassis.track,
            ),
            ..usual
        };
        let mut scan = *scan;
        if let Some(room) = parameters.room {
            leave_out(&mut scan, |placement, echo, scan| is_echo_of_room(pose, placement, echo, scan, room));
        }
        if let Some(robots) = sensors.robots.fresh() {
            // An older look, placed from where the robot is now, would be a robot that moves.
            if sensors.robots.new().is_some() {
                others.see(pose, robots, now.seconds());
            }
            // What a robot answers is no obstacle that stays behind when it drives on.
            leave_out(&mut scan, |placement, echo, scan| {
                others.iter().any(|other| is_echo_of(pose, placement, echo, scan, other, params.other_radius))
            });
            let disc = |other: &Track| Other {
                x: other.x,
                y: other.y,
                radius: params.other_radius,
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

/// Makes echoes no numbers, so that nothing is marked where they come from.
fn leave_out(scan: &mut SonarScan, is_known: impl Fn(&SonarPlacement, &Echo, &SonarScan) -> bool) {
    let mut echoes = [Echo::default(); 16];
    for ((heard, echo), placement) in echoes.iter_mut().zip(scan.echoes.iter()).zip(scan.placements.iter()) {
        let range = if is_known(placement, echo, scan) { f64::NAN } else { echo.range };
        *heard = Echo { range, ..*echo };
    }
    scan.echoes = Sequence::new(&echoes[..scan.echoes.len()]);
}

/// Whether a sonar on a robot at `pose` may have heard a wall of the known room, whose place an echo tells less well.
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

/// Whether a sonar on a robot at `pose` may have heard another robot that is seen.
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
