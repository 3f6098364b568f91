//! Analyze: local map with a short memory of echoes and tracks of robots.

use serde::{Deserialize, Serialize};
use slate_avoidance::{Footprint, LocalMap, Parameters};
use slate_plugin::interfaces::{
    Echo, Orientation, Pose2, Position, Sightings, SonarPlacement, SonarScan, Twist2,
};
use slate_plugin::prelude::*;

use crate::knowledge::WheeledModel;
use crate::tracks::{Track, Tracks};
use crate::twist_estimator::TwistEstimator;

/// Obstacle that echoes mark.
#[interface]
#[derive(PartialEq)]
pub struct MarkedObstacle {
    /// x in the map frame.
    #[unit("m")]
    pub x: f64,
    /// y in the map frame.
    #[unit("m")]
    pub y: f64,
    /// Time of the first echo.
    #[unit("s")]
    pub since: f64,
}

/// Tracked robot.
#[interface]
#[derive(PartialEq)]
pub struct TrackedRobot {
    /// x in the map frame.
    #[unit("m")]
    pub x: f64,
    /// y in the map frame.
    #[unit("m")]
    pub y: f64,
    /// Radius.
    #[unit("m")]
    pub radius: f64,
    /// Velocity along x.
    #[unit("m/s")]
    pub velocity_x: f64,
    /// Velocity along y.
    #[unit("m/s")]
    pub velocity_y: f64,
}

/// Obstacles around the robot, present ones and those of the last seconds.
#[interface]
pub struct LocalObstacles {
    /// Pose of the robot in the map frame.
    pub pose: Pose2,
    /// Twist of the robot.
    pub twist: Twist2,
    /// True if a sensor detects robots.
    /// `robots` are then all that are in sight.
    pub sees_robots: Bool,
    /// Other robots.
    pub robots: Sequence<TrackedRobot, 8>,
    /// Static obstacles.
    pub obstacles: [MarkedObstacle],
}

/// Percepts and knowledge of the Analyze.
#[ports]
pub struct ObservedObstacles {
    range: Observed<SonarScan>,
    #[stale(after = "200ms")]
    position: Observed<Position>,
    #[stale(after = "200ms")]
    orientation: Observed<Orientation>,
    /// Other robots, if a sensor detects them.
    #[stale(after = "500ms")]
    robots: Observed<Sightings>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
    /// Local map, as large as the area of its marks.
    #[capacity(1024)]
    change: Change<LocalObstacles>,
}

/// Parameters of [`MapObstacles`].
#[params]
pub struct MapObstaclesParams {
    #[param(default = 6.0, range = 0.1..=1e6, unit = "s", doc = "age after which an obstacle is forgotten; more without sonars all around")]
    obstacle_timeout: f64,
    #[param(default = 1e6, range = 0.0..=1e6, unit = "m", doc = "half the side of a known square room about the origin")]
    pub room_half_width: f64,
}

/// State of [`MapObstacles`].
#[derive(Default, Serialize, Deserialize)]
pub struct ObstacleMemory {
    map: LocalMap,
    footprint: Option<Footprint>,
    others: Tracks,
    motion: TwistEstimator,
}

/// Tolerance of an echo from a detected robot, meters.
const SPREAD: f64 = 0.1;

/// Local map of echoes and tracks of robots; reports them with each scan.
pub struct MapObstacles;

impl Analyze for MapObstacles {
    const NAME: &'static str = "map_obstacles";
    const DOC: &'static str = "Keeps a local map of obstacles.";
    type Observed = ObservedObstacles;
    type Params = MapObstaclesParams;
    type State = ObstacleMemory;
    type Value = InPlace<LocalObstacles>;

    fn process(
        memory: &mut ObstacleMemory,
        observed: &ObservedObstacles,
        params: &MapObstaclesParams,
        now: &Tick,
    ) -> Option<InPlace<LocalObstacles>> {
        let (position, orientation) = (observed.position.fresh()?, observed.orientation.fresh()?);
        let mut scan = *observed.range.updated()?;
        let ObstacleMemory { map, footprint, others, motion } = memory;
        let footprint = match footprint {
            Some(footprint) => footprint,
            None => {
                // The simulator or driver has checked that it is convex; without an outline the map stays empty.
                footprint.insert(Footprint::of(&observed.robot.fresh()?.chassis.outline).ok()?)
            }
        };
        let pose = Pose2 { x: position.x, y: position.y, theta: orientation.theta };
        let radius = observed.robot.get()?.detected_radius;
        let twist = motion.update(pose, now.seconds());
        let parameters = Parameters { obstacle_timeout: params.obstacle_timeout, ..Parameters::default() };
        if params.room_half_width < 1e6 {
            let room = params.room_half_width;
            leave_out(&mut scan, |placement, echo, scan| is_echo_of_room(pose, placement, echo, scan, room));
        }
        let robots = observed.robots.fresh();
        if let Some(robots) = robots {
            // An older detection, transformed by the present pose, would move.
            if observed.robots.updated().is_some() {
                others.update(pose, robots, now.seconds());
            }
            // Echoes of robots are no static obstacles.
            leave_out(&mut scan, |placement, echo, scan| {
                others.iter().any(|other| is_echo_of(pose, placement, echo, scan, other, radius))
            });
        }
        map.update(pose, &scan, footprint, &parameters, now.seconds());
        let count = map.obstacles().count().min(observed.change.capacity());
        Some(observed.change.write(count, |report| {
            (report.pose, report.twist) = (pose, twist);
            report.sees_robots = robots.is_some().into();
            report.robots = tracked(others, radius);
            fill(&mut report.obstacles, map.obstacles(), |mark| MarkedObstacle {
                x: mark.x,
                y: mark.y,
                since: mark.since,
            });
        }))
    }
}

/// Lists tracked robots of a radius (meters).
fn tracked(others: &Tracks, radius: f64) -> Sequence<TrackedRobot, 8> {
    let mut robots = [TrackedRobot::default(); 8];
    let seen = fill(&mut robots, others.iter(), |other| TrackedRobot {
        x: other.x,
        y: other.y,
        radius,
        velocity_x: other.velocity[0],
        velocity_y: other.velocity[1],
    });
    Sequence::new(&robots[..seen])
}

/// Fills a list with as many items as fit, and returns their number.
fn fill<T, I>(list: &mut [T], items: impl Iterator<Item = I>, make: impl Fn(I) -> T) -> usize {
    let places = list.iter_mut().zip(items);
    places.map(|(place, item)| *place = make(item)).count()
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

/// Returns true if an echo may come from a wall of the known room.
/// The wall's position is known better than the echo's.
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
