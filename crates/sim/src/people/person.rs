use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{atan2, max};

use super::social_force::{drive, interaction, limited, repulsion};
use super::walk_field::WalkField;
use super::walk_grid::WalkGrid;
use crate::contact::Motion;
use crate::geometry::{Point, Pose};

/// Time between two looks for the way, ns.
const LOOK: u64 = 200_000_000;
/// Distance from a place at which a person has arrived, m: there may be others.
const ARRIVED: f64 = 0.6;
/// Time without progress after which a person goes elsewhere, ns.
const STUCK_TIME: u64 = 8_000_000_000;
/// Least progress in that time, m.
const PROGRESS: f64 = 0.5;
/// Free space that a person leaves to everything, m.
const MARGIN: f64 = 0.03;
/// Time in which a person who comes near something stops, s.
const BRAKING_TIME: f64 = 0.25;
/// Speed below which a person does not turn, m/s.
const TURNING_SPEED: f64 = 0.05;

/// A person who walks.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Person {
    pub name: String,
    pub position: Point,
    /// Where the person looks, rad.
    pub heading: f64,
    /// Velocity, with all pushes.
    pub velocity: Point,
    /// Velocity as the person wants it.
    pub motion: Motion,
    pub radius: f64,
    /// Desired speed, m/s.
    speed: f64,
    /// Number of the place to go to.
    destination: usize,
    /// Point of the way to go to now.
    target: Point,
    looked: Option<u64>,
    /// End of the stay at a place, ns.
    stays_until: u64,
    /// Where and when the person last made progress.
    progress: (Point, u64),
    random: Random,
}

/// Something near a person.
#[derive(Clone, Copy, Debug)]
pub(super) struct PersonObstacle {
    /// Direction to its nearest point, of length 1.
    pub towards: Point,
    /// Distance from the person's side, m.
    pub gap: f64,
    /// Own velocity less that of the other; of a wall none.
    pub closing: Option<Point>,
}

/// The ways of people.
#[derive(Debug)]
pub(super) struct Ways<'a> {
    pub grid: &'a WalkGrid,
    /// Middles of the places, and the paths to each.
    pub places: &'a [(Point, WalkField)],
    /// Least and greatest time at a place, s.
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
            looked: None,
            stays_until: 0,
            progress: (position, 0),
            random,
        }
    }

    /// Where the person is.
    pub fn pose(&self) -> Pose {
        Pose { x: self.position.x, y: self.position.y, theta: self.heading }
    }

    /// Decides how the person walks in the next `step` seconds.
    pub(super) fn walk(&mut self, ways: &Ways<'_>, near: &[PersonObstacle], now: u64, step: f64) {
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

    /// Takes over where physics has moved the person.
    pub fn moved(&mut self, position: Point, velocity: Point) {
        (self.position, self.velocity) = (position, velocity);
        if velocity.norm() > TURNING_SPEED {
            self.heading = atan2(velocity.y, velocity.x);
        }
    }

    /// Looks for the way, if it is time to, and chooses another place after an arrival.
    fn find_way(&mut self, ways: &Ways<'_>, now: u64) {
        if self.looked.is_some_and(|looked| now < looked + LOOK) {
            return;
        }
        self.looked = Some(now);
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

    fn choose_place(&mut self, ways: &Ways<'_>, now: u64, is_there: bool) {
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

/// A velocity as fast towards each obstacle as lets the person stop before it.
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
