use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::clamp;

use super::walk_grid::WalkGrid;
use crate::error::DescriptionError;
use crate::geometry::{Point, Polygon, Pose};
use crate::world::World;

/// Largest number of people in a world.
const MOST_PEOPLE: usize = 500;
/// Largest number of places.
/// Each takes a byte per cell of the grid.
const MOST_PLACES: usize = 64;
/// Clearance between a person and a robot at the start, m.
const START_CLEARANCE: f64 = 0.5;
/// Clearance between two people at the start, m.
const START_SPACING: f64 = 0.2;
/// Largest number of attempts to place a person.
const MAX_ATTEMPTS: usize = 10_000;

/// Walking people: `[world.people]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PeopleDescription {
    /// Number of people.
    pub count: usize,
    /// Mean of the desired speeds, m/s.
    /// The default is that of Moussaïd et al. (2009).
    #[serde(default = "usual_speed")]
    pub speed: f64,
    /// Standard deviation of the desired speeds, m/s.
    /// The default is that of Moussaïd et al. (2009).
    #[serde(default = "usual_speed_stddev")]
    pub speed_stddev: f64,
    /// Radius of a person, m.
    #[serde(default = "usual_radius")]
    pub radius: f64,
    /// Places between which they walk, m; random ones if empty.
    #[serde(default)]
    pub places: Vec<[f64; 2]>,
    /// Number of random places if none are named.
    #[serde(default = "usual_places")]
    pub random_places: usize,
    /// Shortest and longest stay at a place, s.
    #[serde(default)]
    pub pause: [f64; 2],
}

fn usual_speed() -> f64 {
    1.29
}

fn usual_speed_stddev() -> f64 {
    0.19
}

fn usual_radius() -> f64 {
    0.25
}

fn usual_places() -> usize {
    8
}

/// Start positions of people, and the places between which they walk.
#[derive(Clone, Debug)]
pub struct PeopleLayout {
    pub(super) description: PeopleDescription,
    pub(super) grid: Arc<WalkGrid>,
    /// Cells of the places.
    pub(super) places: Vec<usize>,
    pub(super) people: Vec<PersonStart>,
}

/// Person at the start.
#[derive(Clone, Debug)]
pub(super) struct PersonStart {
    pub name: String,
    pub position: Point,
    /// Desired speed, m/s.
    pub speed: f64,
}

impl PeopleDescription {
    /// Returns the names of the people: `person_1` and so on.
    pub fn names(&self) -> impl Iterator<Item = String> {
        (1..=self.count).map(|number| format!("person_{number}"))
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// The setting that is out of its range.
    pub fn check(&self) -> Result<(), DescriptionError> {
        let within = |value: f64, least: f64, most: f64| value >= least && value <= most;
        let [shortest, longest] = self.pause;
        let is_finite = |place: &[f64; 2]| place.iter().all(|value| value.is_finite());
        let checks = [
            ("count", (1..=MOST_PEOPLE).contains(&self.count), "expected a number from 1 to 500"),
            ("speed", within(self.speed, 0.1, 3.0), "expected a speed from 0.1 to 3 m/s"),
            (
                "speed_stddev",
                within(self.speed_stddev, 0.0, 1.0),
                "expected a standard deviation from 0 to 1 m/s",
            ),
            ("radius", within(self.radius, 0.1, 0.5), "expected a radius from 0.1 to 0.5 m"),
            (
                "places",
                self.places.iter().all(is_finite)
                    && self.places.len() != 1
                    && self.places.len() <= MOST_PLACES,
                "expected from 2 to 64 places such as [1.0, 2.0]",
            ),
            (
                "random_places",
                (2..=MOST_PLACES).contains(&self.random_places),
                "expected a number from 2 to 64",
            ),
            (
                "pause",
                within(shortest, 0.0, longest) && within(longest, 0.0, 3600.0),
                "expected the least and the greatest time, from 0 to 3600 s",
            ),
        ];
        let wrong = checks.into_iter().find(|(_, right, _)| !right);
        wrong.map_or(Ok(()), |(key, _, message)| Err(problem(key, message)))
    }

    /// Determines the places and the start positions, clear of bodies and robots.
    /// `robots` are the outlines of the robots in the world.
    ///
    /// # Errors
    /// A place is in a wall or can't be reached from the others, or there is no room.
    pub fn lay_out(
        &self,
        world: &World,
        robots: &[Polygon],
        seed: u64,
    ) -> Result<PeopleLayout, DescriptionError> {
        let grid = WalkGrid::new(world, self.radius)?;
        let mut random = Random::new(seed, "simulation/people");
        let (places, reachable) = match self.places[..] {
            [] => self.draw_places(&grid, &mut random)?,
            _ => self.named_places(&grid)?,
        };
        let people = self.starts(&grid, &reachable, robots, &mut random)?;
        Ok(PeopleLayout { description: self.clone(), grid: Arc::new(grid), places, people })
    }

    /// Returns the cells of the named places, and the cells connected with them.
    fn named_places(&self, grid: &WalkGrid) -> Result<(Vec<usize>, Vec<bool>), DescriptionError> {
        let mut places = Vec::new();
        let mut reachable = Vec::new();
        for [x, y] in &self.places {
            let cell = grid.free_cell(Point::new(*x, *y)).ok_or_else(|| {
                let message = format!(
                    "[{x}, {y}] is outside of the world, or in or near a body; expected room for a person of radius {} m",
                    self.radius
                );
                problem("places", message)
            })?;
            if places.is_empty() {
                reachable = grid.reachable(cell);
            }
            if !reachable[cell] {
                let [first_x, first_y] = self.places[0];
                let message = format!(
                    "no path from [{first_x}, {first_y}] to [{x}, {y}] for a person of radius {} m; move the place, or make \
                     people narrower",
                    self.radius
                );
                return Err(problem("places", message));
            }
            places.push(cell);
        }
        Ok((places, reachable))
    }

    /// Draws places in the largest connected area.
    fn draw_places(
        &self,
        grid: &WalkGrid,
        random: &mut Random,
    ) -> Result<(Vec<usize>, Vec<bool>), DescriptionError> {
        let reachable = grid.largest_area();
        let cells: Vec<usize> = (0..reachable.len()).filter(|cell| reachable[*cell]).collect();
        if cells.len() < 2 {
            let message = format!("the world has no room for a person of radius {} m", self.radius);
            return Err(problem("radius", message));
        }
        let places = (0..self.random_places).map(|_| cells[draw(random, cells.len())]).collect();
        Ok((places, reachable))
    }

    fn starts(
        &self,
        grid: &WalkGrid,
        reachable: &[bool],
        robots: &[Polygon],
        random: &mut Random,
    ) -> Result<Vec<PersonStart>, DescriptionError> {
        let cells: Vec<usize> = (0..reachable.len()).filter(|cell| reachable[*cell]).collect();
        let mut people: Vec<PersonStart> = Vec::new();
        for name in self.names() {
            let is_clear = |position: &Point| {
                let spacing = 2.0 * self.radius + START_SPACING;
                let clearance = self.radius + START_CLEARANCE;
                people.iter().all(|other| other.position.minus(*position).norm() > spacing)
                    && robots.iter().all(|robot| distance(robot, *position) > clearance)
            };
            let mut draws = (0..MAX_ATTEMPTS).map(|_| grid.center(cells[draw(random, cells.len())]));
            let position = draws.find(is_clear).ok_or_else(|| {
                let message = format!("no room for {} people; expected fewer, or a larger world", self.count);
                problem("count", message)
            })?;
            let speed = self.speed + self.speed_stddev * random.normal();
            let speed = clamp(speed, 0.5 * self.speed, 1.5 * self.speed);
            people.push(PersonStart { name, position, speed });
        }
        Ok(people)
    }
}

impl PeopleLayout {
    /// Returns the names and poses of the people at the start.
    pub fn starts(&self) -> impl Iterator<Item = (&str, Pose)> {
        self.people.iter().map(|PersonStart { name, position: Point { x, y }, .. }| {
            (name.as_str(), Pose { x: *x, y: *y, theta: 0.0 })
        })
    }

    /// Returns the radius of a person, m.
    pub fn radius(&self) -> f64 {
        self.description.radius
    }

    /// Returns the outline of a person: a disc.
    pub fn outline(&self) -> Polygon {
        Polygon::disc(self.description.radius)
    }
}

fn problem(key: &str, message: impl Into<String>) -> DescriptionError {
    DescriptionError::new(&format!("world.people.{key}"), message)
}

/// Draws a number below `count`.
fn draw(random: &mut Random, count: usize) -> usize {
    ((random.unit() * count as f64) as usize).min(count - 1)
}

fn distance(body: &Polygon, point: Point) -> f64 {
    if body.contains(point) { 0.0 } else { body.nearest(point).minus(point).norm() }
}
