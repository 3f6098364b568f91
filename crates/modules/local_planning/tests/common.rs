//! A robot of 0.5 m by 0.4 m among columns.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_avoidance::Footprint;
use slate_interfaces::{Point2, Pose2};
use slate_local_planning::{MotionState, ObstacleField, PlanarVelocity};
use slate_module::math;

pub const PERIOD: f64 = 0.05;
/// Radius of a column, m.
pub const RADIUS: f64 = 0.1;

pub fn footprint() -> Footprint {
    Footprint::new(&[[0.25, 0.2], [-0.25, 0.2], [-0.25, -0.2], [0.25, -0.2]]).unwrap()
}

pub fn standing(x: f64, y: f64, theta: f64) -> MotionState {
    MotionState { pose: Pose2 { x, y, theta }, velocity: PlanarVelocity::ZERO }
}

pub fn line(from: [f64; 2], to: [f64; 2]) -> Vec<Point2> {
    [from, to].map(|[x, y]| Point2 { x, y }).to_vec()
}

/// Points on the rims of columns.
pub fn rims(columns: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let rim = |[x, y]: [f64; 2]| {
        (0..24).map(move |k| {
            let angle = f64::from(k) * std::f64::consts::PI / 12.0;
            [x + RADIUS * math::cos(angle), y + RADIUS * math::sin(angle)]
        })
    };
    columns.iter().flat_map(|column| rim(*column)).collect()
}

/// A wall of columns that touch each other.
pub fn wall(from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
    let length = math::hypot(to[0] - from[0], to[1] - from[1]);
    let count = (length / RADIUS).ceil();
    (0..=count as u32)
        .map(|k| f64::from(k) / count)
        .map(|share| [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])])
        .collect()
}

/// How a drive ended: where, after which time, and its least distance to a column.
#[derive(Debug)]
pub struct Ride {
    pub state: MotionState,
    pub time: f64,
    pub clearance: f64,
    pub has_arrived: bool,
}

/// Drives until the goal is within 0.2 m, at most for a time in s.
pub fn drive(
    start: MotionState,
    columns: &[[f64; 2]],
    goal: [f64; 2],
    most: f64,
    mut plan: impl FnMut(&MotionState, &ObstacleField) -> PlanarVelocity,
) -> Ride {
    let (footprint, points) = (footprint(), rims(columns));
    let mut field = ObstacleField::new(6.0, 0.05).unwrap();
    let mut ride = Ride { state: start, time: 0.0, clearance: f64::INFINITY, has_arrived: false };
    while ride.time < most && !ride.has_arrived {
        field.update([ride.state.pose.x, ride.state.pose.y], points.iter().copied());
        let velocity = plan(&ride.state, &field);
        ride.state = MotionState { pose: moved(ride.state.pose, velocity), velocity };
        ride.time += PERIOD;
        let Pose2 { x, y, theta } = ride.state.pose;
        let (sine, cosine) = (math::sin(theta), math::cos(theta));
        for [column_x, column_y] in columns {
            let (across, up) = (column_x - x, column_y - y);
            let distance = footprint.distance(across * cosine + up * sine, up * cosine - across * sine);
            ride.clearance = math::min(ride.clearance, distance - RADIUS);
        }
        ride.has_arrived = math::hypot(goal[0] - x, goal[1] - y) < 0.2;
    }
    ride
}

fn moved(pose: Pose2, velocity: PlanarVelocity) -> Pose2 {
    let middle = pose.theta + 0.5 * PERIOD * velocity.wz;
    let (sine, cosine) = (math::sin(middle), math::cos(middle));
    Pose2 {
        x: pose.x + PERIOD * (velocity.vx * cosine - velocity.vy * sine),
        y: pose.y + PERIOD * (velocity.vx * sine + velocity.vy * cosine),
        theta: math::wrap_angle(pose.theta + PERIOD * velocity.wz),
    }
}
