use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{atan2, max};

use super::social_force::{drive, interaction, limited, repulsion};
use super::walk_field::WalkField;
use super::walk_grid::WalkGrid;
use crate::contact::Motion;
use crate::geometry::{Point, Pose};

/// Interval between updates of the path, ns.
const PATH_UPDATE_PERIOD: u64 = 200_000_000;
/// Goal tolerance at a place, m; large, as there may be others.
const ARRIVED: f64 = 0.6;
/// Time without progress after which a person chooses another place, ns.
const STUCK_TIME: u64 = 8_000_000_000;
/// Smallest progress in that time, m.
const PROGRESS: f64 = 0.5;
/// Clearance that a person keeps to everything, m.
const MARGIN: f64 = 0.03;
/// Braking time of a person near an obstacle, s.
const BRAKING_TIME: f64 = 0.25;
/// Speed below which a person does not turn, m/s.
const TURNING_SPEED: f64 = 0.05;

/// Walking person.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Person {
    pub name: String,
    pub position: Point,
    /// Heading of the person, rad.
    pub heading: f64,
    /// Velocity including pushes, m/s.
    pub velocity: Point,
    /// Intended motion.
    pub motion: Motion,
    pub radius: f64,
    /// Desired speed, m/s.
    speed: f64,
    /// Number of the destination.
    destination: usize,
    /// Current waypoint.
    target: Point,
    #[serde(rename = "looked")]
    path_updated_at: Option<u64>,
    /// End of the stay at a place, ns.
    stays_until: u64,
    /// Position and time of the last progress, m and ns.
    progress: (Point, u64),
    random: Random,
}

/// Obstacle near a person.
#[derive(Clone, Copy, Debug)]
pub(super) struct PersonObstacle {
    /// Unit direction to its nearest point.
    pub towards: Point,
    /// Distance from the person's side, m.
    pub gap: f64,
    /// Own velocity minus that of the other; `None` for a wall.
    pub closing: Option<Point>,
}

/// Paths of people.
#[derive(Debug)]
pub(super) struct PersonPaths<'a> {
    pub grid: &'a WalkGrid,
    /// Centers of the places, and the paths to each.
    pub places: &'a [(Point, WalkField)],
    /// Shortest and longest stay at a place, s.
    pub pause: [f64; 2],
}

impl Person {
    pub fn new(name: &str, position: Point, radius: f64, speed: f64, random: Random) -> Self {
        Self {
            name: name.into(),
            position,
            heading: 0.0,
            velocity: Point::default(),
            motion: Motion { origin: position, ..Motion::default() },
            radius,
            speed,
            destination: usize::MAX,
            target: position,
            path_updated_at: None,
            stays_until: 0,
            progress: (position, 0),
            random,
        }
    }

    /// Returns the pose of the person.
    pub fn pose(&self) -> Pose {
        Pose { x: self.position.x, y: self.position.y, theta: self.heading }
    }

    /// Computes the person's motion in the next `step` seconds.
    pub(super) fn walk(&mut self, ways: &PersonPaths<'_>, near: &[PersonObstacle], now: u64, step: f64) {
        self.find_way(ways, now);
        let way = self.target.minus(self.position);
        let distance = way.norm();
        let is_going = now >= self.stays_until && distance > 1e-3;
        let desired = if is_going { self.speed / distance } else { 0.0 };
        let mut force = drive(self.velocity, Point::default().plus(way, desired));
        for PersonObstacle { towards, gap, closing } in near {
            force = force.plus(
                match closing {
                    // Between two people that is the distance of their middles.
                    Some(closing) => interaction(*towards, max(*gap, 0.0) + 2.0 * self.radius, *closing),
                    None => repulsion(Point::default().minus(*towards), *gap),
                },
                1.0,
            );
        }
        let velocity = limited(self.velocity.plus(force, step), self.speed);
        let velocity = held_back(velocity, near);
        self.motion = Motion { origin: self.position, velocity, angular: 0.0 };
    }

    /// Updates position and velocity from the physics.
    pub fn moved(&mut self, position: Point, velocity: Point) {
        (self.position, self.velocity) = (position, velocity);
        if velocity.norm() > TURNING_SPEED {
            self.heading = atan2(velocity.y, velocity.x);
        }
    }

    /// Updates the waypoint if it is due; chooses another place after an arrival.
    fn find_way(&mut self, ways: &PersonPaths<'_>, now: u64) {
        if self.path_updated_at.is_some_and(|path_updated_at| now < path_updated_at + PATH_UPDATE_PERIOD) {
            return;
        }
        self.path_updated_at = Some(now);
        let has_place = self.destination < ways.places.len();
        let is_there = has_place && ways.places[self.destination].0.minus(self.position).norm() < ARRIVED;
        if now < self.stays_until || self.position.minus(self.progress.0).norm() > PROGRESS {
            self.progress = (self.position, now);
        }
        let is_stuck = now >= self.progress.1 + STUCK_TIME;
        if !has_place || is_there || is_stuck {
            self.choose_place(ways, now, is_there);
        }
        if let Some(target) = ways.places[self.destination].1.ahead(ways.grid, self.position) {
            self.target = target;
        }
    }

    fn choose_place(&mut self, ways: &PersonPaths<'_>, now: u64, is_there: bool) {
        let count = ways.places.len();
        let others = if self.destination < count { count - 1 } else { count };
        let drawn = ((self.random.unit() * others as f64) as usize).min(others - 1);
        // The drawn number is among those of the other places.
        self.destination = if drawn >= self.destination { drawn + 1 } else { drawn };
        self.progress = (self.position, now);
        let [shortest, longest] = ways.pause;
        let pause = self.random.uniform(shortest, longest);
        if is_there {
            self.stays_until = now + (pause * 1e9) as u64;
        }
    }
}

/// Limits a velocity so that the person can stop before each obstacle.
fn held_back(velocity: Point, near: &[PersonObstacle]) -> Point {
    let most = |obstacle: &PersonObstacle| max(obstacle.gap - MARGIN, 0.0) / BRAKING_TIME;
    let mut held = velocity;
    for _ in 0..4 {
        for obstacle in near {
            let excess = held.dot(obstacle.towards) - most(obstacle);
            if excess > 0.0 {
                held = held.plus(obstacle.towards, -excess);
            }
        }
    }
    let is_held = near.iter().all(|obstacle| held.dot(obstacle.towards) <= most(obstacle) + 1e-3);
    // In a wedge of obstacles there may be no such velocity but to stand.
    if is_held { held } else { Point::default() }
}
