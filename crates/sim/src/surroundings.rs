//! Static bodies and robots, with neighborhood queries.

use std::ops::Range;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_module::math::{max, min};

use crate::geometry::{Extent, Frame, Point, Polygon};
use crate::grid::Grid;
use crate::wall_map::WorldMap;

/// Hull of a moving body, such as a robot, at its current pose.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Hull {
    /// Shape in the body's own frame.
    shape: Polygon,
    /// Radius of the bounding circle around the reference point, m.
    radius: f64,
    frame: Frame,
    /// Outline in the world.
    outline: Polygon,
}

impl Hull {
    /// Creates a hull from a shape in its own frame, at a pose.
    pub fn new(shape: Polygon, frame: Frame) -> Self {
        let mut outline = Polygon::default();
        shape.place(&frame, &mut outline);
        Self { radius: shape.radius(), shape, frame, outline }
    }

    /// Moves the hull to a pose.
    pub fn place(&mut self, frame: Frame) {
        self.frame = frame;
        self.shape.place(&frame, &mut self.outline);
    }

    /// Returns the pose of the robot as a frame.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Returns the outline in the world.
    pub fn outline(&self) -> &Polygon {
        &self.outline
    }

    /// Returns the radius of the bounding circle around the reference point, m.
    pub fn radius(&self) -> f64 {
        self.radius
    }
}

/// Bodies around a robot, nearest first.
#[derive(Clone, Debug, Default)]
pub struct Nearby {
    edges: Vec<(Point, Point)>,
    bodies: Vec<NearBody>,
}

/// Body around a robot.
#[derive(Clone, Debug)]
pub struct NearBody {
    edges: Range<usize>,
    /// Lower bound of its distance from the robot's reference point, m.
    pub distance: f64,
    /// Center of its bounding circle.
    pub center: Point,
    /// Radius of its bounding circle, m.
    pub radius: f64,
}

impl Nearby {
    /// Returns the bodies with their reachable edges, counter-clockwise.
    pub fn bodies(&self) -> impl Iterator<Item = (&NearBody, &[(Point, Point)])> {
        self.bodies.iter().map(|body| (body, &self.edges[body.edges.clone()]))
    }
}

/// Kind of a moving body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mover {
    /// A robot.
    Robot,
    /// A person.
    Person,
    /// The leaf of a door.
    Door,
}

/// Bodies that can be touched, heard or seen.
/// They are numbered: first the static ones, then the movers, which are robots, people and doors in that order.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Surroundings {
    bodies: Vec<(String, Polygon)>,
    extents: Vec<Extent>,
    body_grid: Grid,
    /// All movers.
    robots: Vec<Hull>,
    robot_grid: Grid,
    /// Radius of the widest mover, m.
    widest: f64,
    /// Number of people among the movers.
    #[serde(default, skip_serializing_if = "is_zero")]
    people: usize,
    /// Number of doors among the movers.
    #[serde(default, skip_serializing_if = "is_zero")]
    doors: usize,
    /// Map whose walls are the first static bodies.
    /// It never changes, and is not part of the state.
    #[serde(skip)]
    map: Option<Arc<WorldMap>>,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(number: &usize) -> bool {
    *number == 0
}

impl Surroundings {
    /// Creates surroundings of named static bodies.
    /// The first ones are the walls of `map`, if any.
    pub fn new(bodies: Vec<(String, Polygon)>, map: Option<Arc<WorldMap>>) -> Self {
        let extents: Vec<_> = bodies.iter().map(|(_, polygon)| polygon.extent()).collect();
        let mut body_grid = Grid::default();
        body_grid.fill(extents.iter().copied());
        Self { bodies, extents, body_grid, map, ..Self::default() }
    }

    /// Sets the map whose walls are the first static bodies.
    pub fn set_map(&mut self, map: Option<Arc<WorldMap>>) {
        self.map = map;
    }

    /// Returns the map whose walls are the first static bodies.
    pub fn map(&self) -> Option<&Arc<WorldMap>> {
        self.map.as_ref()
    }

    /// Adds a robot.
    /// [`arrange`](Self::arrange) must follow.
    pub fn add(&mut self, hull: Hull) {
        self.add_mover(Mover::Robot, hull);
    }

    /// Adds a mover.
    /// It goes after those of its kind and before those of later kinds. [`arrange`](Self::arrange) must follow.
    pub fn add_mover(&mut self, mover: Mover, hull: Hull) {
        self.widest = max(self.widest, hull.radius);
        self.robots.push(hull);
        match mover {
            Mover::Robot => {}
            Mover::Person => self.people += 1,
            Mover::Door => self.doors += 1,
        }
    }

    /// Returns the movers for updates.
    /// [`arrange`](Self::arrange) must follow.
    pub fn hulls_mut(&mut self) -> &mut [Hull] {
        &mut self.robots
    }

    /// Updates the search grid to the current positions of the movers.
    pub fn arrange(&mut self) {
        let places = self.robots.iter().map(|hull| Extent::around(hull.frame.origin, 0.0));
        self.robot_grid.fill(places);
    }

    /// Returns the static bodies with their outlines.
    pub fn bodies(&self) -> &[(String, Polygon)] {
        &self.bodies
    }

    /// Returns the robots.
    pub fn robots(&self) -> &[Hull] {
        &self.robots[..self.robot_count()]
    }

    /// Returns the movers: robots, people and doors.
    pub fn hulls(&self) -> &[Hull] {
        &self.robots
    }

    /// Returns the number of robots, which is that of the first person, too.
    pub fn robot_count(&self) -> usize {
        self.robots.len() - self.people - self.doors
    }

    /// Returns the kind of a mover, by its number among the movers.
    pub fn mover(&self, number: usize) -> Mover {
        match number.checked_sub(self.robot_count()) {
            None => Mover::Robot,
            Some(other) if other < self.people => Mover::Person,
            Some(_) => Mover::Door,
        }
    }

    /// Returns the outline of a body, by its number.
    pub fn outline(&self, number: usize) -> &Polygon {
        match number.checked_sub(self.bodies.len()) {
            Some(robot) => &self.robots[robot].outline,
            None => &self.bodies[number].1,
        }
    }

    /// Returns the bounding circle of a body, by its number.
    pub fn circle(&self, number: usize) -> (Point, f64) {
        match number.checked_sub(self.bodies.len()) {
            Some(robot) => (self.robots[robot].frame.origin, self.robots[robot].radius),
            None => {
                let Extent { minimum, maximum } = self.extents[number];
                let half = maximum.minus(minimum);
                (minimum.plus(half, 0.5), half.norm() / 2.0)
            }
        }
    }

    /// Visits the bodies that may be within `reach` of a point, m.
    /// Each has its number and a lower bound of its distance.
    pub fn near(&self, center: Point, reach: f64, mut found: impl FnMut(usize, f64)) {
        self.near_bodies(center, reach, &mut found);
        self.near_movers(center, reach, |mover, distance| found(self.bodies.len() + mover, distance));
    }

    /// Visits static bodies like [`near`](Self::near).
    pub fn near_bodies(&self, center: Point, reach: f64, mut found: impl FnMut(usize, f64)) {
        self.body_grid.near(&Extent::around(center, reach), |body| {
            let distance = self.extents[body].distance(center);
            if distance <= reach {
                found(body, distance);
            }
        });
    }

    /// Visits movers like [`near`](Self::near), by their numbers among the movers.
    pub fn near_movers(&self, center: Point, reach: f64, mut found: impl FnMut(usize, f64)) {
        self.robot_grid.near(&Extent::around(center, reach + self.widest), |robot| {
            let hull = &self.robots[robot];
            let distance = hull.frame.origin.minus(center).norm() - hull.radius;
            if distance <= reach {
                found(robot, distance);
            }
        });
    }

    /// Collects bodies that a robot's sensors can detect, with edges that face them.
    /// The sensors are at most `aside` from its reference point and reach `range`, both in meters.
    pub fn find_near(&self, robot: usize, range: f64, aside: f64, into: &mut Nearby) {
        self.find_near_with(robot, range, aside, 0, into);
    }

    /// Collects bodies like [`find_near`](Self::find_near), but no map walls.
    /// For sensors that cast rays in the map itself.
    pub fn find_near_outside_map(&self, robot: usize, range: f64, aside: f64, into: &mut Nearby) {
        let walls = self.map.as_ref().map_or(0, |map| map.walls);
        self.find_near_with(robot, range, aside, walls, into);
    }

    /// Collects detectable bodies from number `first_body` on.
    fn find_near_with(&self, robot: usize, range: f64, aside: f64, first_body: usize, into: &mut Nearby) {
        let Nearby { edges, bodies } = into;
        edges.clear();
        bodies.clear();
        let center = self.robots[robot].frame.origin;
        let own = self.bodies.len() + robot;
        let squares = (aside * aside, (range + aside) * (range + aside));
        self.near(center, range + aside, |number, distance| {
            if number == own || number < first_body {
                return;
            }
            let first = edges.len();
            edges.extend(self.outline(number).edges().filter(|(a, b)| {
                let along = b.minus(*a);
                // How far the reference point is outside of the edge, times its length.
                let outside = along.cross(a.minus(center));
                let (square, length) = (outside * outside, along.dot(along));
                if outside > 0.0 { square <= squares.1 * length } else { square <= squares.0 * length }
            }));
            let (center, radius) = self.circle(number);
            bodies.push(NearBody { edges: first..edges.len(), distance, center, radius });
        });
        bodies.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance));
    }

    /// Returns the distance from a robot's body to the nearest other one, m.
    /// Infinite without another body.
    pub fn clearance(&self, robot: usize) -> f64 {
        let Hull { radius, frame, outline, .. } = &self.robots[robot];
        let own = self.bodies.len() + robot;
        let mut reach = radius + min(self.robot_grid.cell_size(), self.body_grid.cell_size());
        loop {
            let mut nearest = f64::INFINITY;
            self.near(frame.origin, reach, |number, distance| {
                // The distance is one from the reference point, and the body's own parts are nearer by its radius.
                if number != own && distance - radius < nearest {
                    nearest = min(nearest, outline.gap(self.outline(number)).distance);
                }
            });
            // The bodies left out are farther from the reference point than `reach`.
            if nearest <= reach - radius || reach.is_infinite() {
                return nearest;
            }
            let looked_at = Extent::around(frame.origin, reach);
            let everywhere = self.robot_grid.covered_by(&looked_at) && self.body_grid.covered_by(&looked_at);
            reach = if everywhere { f64::INFINITY } else { 2.0 * reach };
        }
    }
}
