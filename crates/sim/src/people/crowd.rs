use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_module::Random;

use super::description::PeopleLayout;
use super::person::{Person, PersonObstacle, PersonPaths};
use super::walk_field::WalkField;
use super::walk_grid::WalkGrid;
use crate::geometry::Point;
use crate::surroundings::{Mover, Surroundings};

/// Distance at which people see others, m.
const SIGHT: f64 = 5.0;
/// Distance at which walls repel people, m.
const WALL_REPULSION_RANGE: f64 = 1.0;

/// People of a world.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Crowd {
    people: Vec<Person>,
    /// Paths to all places.
    /// They never change, and are no part of the state.
    #[serde(skip)]
    paths: Option<Arc<Paths>>,
    /// Scratch memory for obstacles near a person.
    #[serde(skip)]
    near: Vec<PersonObstacle>,
}

/// Paths to all places.
#[derive(Debug)]
struct Paths {
    grid: Arc<WalkGrid>,
    places: Vec<(Point, WalkField)>,
    pause: [f64; 2],
}

impl Crowd {
    /// Creates the people of a layout.
    pub fn new(layout: &PeopleLayout, seed: u64) -> Self {
        let PeopleLayout { description, grid, places, people } = layout;
        let person = |start: &super::description::PersonStart| {
            let random = Random::new(seed, &format!("simulation/{}/walk", start.name));
            Person::new(&start.name, start.position, description.radius, start.speed, random)
        };
        let places = places.iter().map(|place| (grid.center(*place), WalkField::new(grid, *place)));
        let paths = Paths { grid: grid.clone(), places: places.collect(), pause: description.pause };
        Self { people: people.iter().map(person).collect(), paths: Some(Arc::new(paths)), near: Vec::new() }
    }

    /// Returns whether the world has no people.
    pub fn is_empty(&self) -> bool {
        self.people.is_empty()
    }

    /// Takes over the paths from another crowd of the same world.
    /// Paths are no part of the state.
    pub fn set_paths_of(&mut self, other: &Self) {
        self.paths = other.paths.clone();
    }

    /// Returns the people.
    pub fn people(&self) -> &[Person] {
        &self.people
    }

    /// Returns the people for updates.
    pub fn people_mut(&mut self) -> &mut [Person] {
        &mut self.people
    }

    /// Computes the velocities of all people for the next `step` seconds.
    /// `velocities` are those of all movers, by number.
    pub fn walk(&mut self, surroundings: &Surroundings, velocities: &[Point], now: u64, step: f64) {
        let Self { people, paths, near } = self;
        let Some(paths) = paths else { return };
        let ways = PersonPaths { grid: &paths.grid, places: &paths.places, pause: paths.pause };
        let first = surroundings.robot_count();
        for (number, person) in people.iter_mut().enumerate() {
            find_near(first + number, person, surroundings, velocities, &paths.grid, near);
            person.walk(&ways, near, now, step);
        }
    }
}

/// Collects the obstacles near a person, which is mover number `own`.
fn find_near(
    own: usize,
    person: &Person,
    surroundings: &Surroundings,
    velocities: &[Point],
    grid: &WalkGrid,
    near: &mut Vec<PersonObstacle>,
) {
    near.clear();
    let (position, radius) = (person.position, person.radius);
    let toward = |nearest: Point, closing: Option<Point>| {
        let way = nearest.minus(position);
        let distance = way.norm();
        // In the middle of another there is no direction.
        (distance > 1e-9).then(|| PersonObstacle {
            towards: Point::default().plus(way, 1.0 / distance),
            gap: distance - radius,
            closing,
        })
    };
    let mut wall: Option<PersonObstacle> = None;
    surroundings.near_bodies(position, radius + WALL_REPULSION_RANGE, |body, _| {
        let found = toward(surroundings.outline(body).nearest(position), None);
        if let Some(found) = found.filter(|found| wall.is_none_or(|wall| found.gap < wall.gap)) {
            wall = Some(found);
        }
    });
    near.extend(wall);
    surroundings.near_movers(position, radius + SIGHT, |mover, distance| {
        if mover == own {
            return;
        }
        let (center, size) = surroundings.circle(surroundings.bodies().len() + mover);
        let closing = person.velocity.minus(velocities[mover]);
        let found = match surroundings.mover(mover) {
            Mover::Person => {
                toward(center, Some(closing)).map(|found| PersonObstacle { gap: found.gap - size, ..found })
            }
            Mover::Robot => toward(surroundings.hulls()[mover].outline().nearest(position), Some(closing)),
            Mover::Door if distance < WALL_REPULSION_RANGE => {
                toward(surroundings.hulls()[mover].outline().nearest(position), None)
            }
            Mover::Door => None,
        };
        if let Some(found) = found.filter(|found| found.gap < 0.5 || grid.is_in_sight(position, center)) {
            near.push(found);
        }
    });
}
