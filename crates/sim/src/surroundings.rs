//! Static bodies and robots, with queries of those nearby.

use std::ops::Range;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_module::math::{max, min};

use crate::geometry::{Extent, Frame, Point, Polygon};
use crate::grid::Grid;
use crate::wall_map::WorldMap;

/// Body of something that moves, such as a robot, at its present pose.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Hull {
    /// In the robot's own frame.
    shape: Polygon,
    /// The circle around the robot's reference point.
    radius: f64,
    frame: Frame,
    /// In the world.
    outline: Polygon,
}

impl Hull {
    /// A robot's shape, in its own frame, at a place.
    pub fn new(shape: Polygon, frame: Frame) -> Self {
        let mut outline = Polygon::default();
        shape.place(&frame, &mut outline);
        Self { radius: shape.radius(), shape, frame, outline }
    }

    /// Moves it.
    pub fn place(&mut self, frame: Frame) {
        self.frame = frame;
        self.shape.place(&frame, &mut self.outline);
    }

    /// Where the robot is.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The outline in the world.
    pub fn outline(&self) -> &Polygon {
        &self.outline
    }

    /// The circle around the robot's reference point, metres.
    pub fn radius(&self) -> f64 {
        self.radius
    }
}

/// The bodies around a robot, the nearest first.
#[derive(Clone, Debug, Default)]
pub struct Nearby {
    edges: Vec<(Point, Point)>,
    bodies: Vec<NearBody>,
}

/// A body around a robot.
#[derive(Clone, Debug)]
pub struct NearBody {
    edges: Range<usize>,
    /// It is at least that far from the robot's reference point, metres.
    pub distance: f64,
    /// Of a circle around the body.
    pub center: Point,
    /// Of the same circle, metres.
    pub radius: f64,
}

impl Nearby {
    /// The bodies, each with those of its edges that can be met; they are counter-clockwise.
    pub fn bodies(&self) -> impl Iterator<Item = (&NearBody, &[(Point, Point)])> {
        self.bodies.iter().map(|body| (body, &self.edges[body.edges.clone()]))
    }
}

/// Kind of a body that moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mover {
    /// A robot.
    Robot,
    /// A person.
    Person,
    /// The leaf of a door.
    Door,
}

/// All that can be met, heard or seen. Bodies have numbers: first the static ones, then the movers, which are robots, people
/// and doors in that order.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Surroundings {
    bodies: Vec<(String, Polygon)>,
    extents: Vec<Extent>,
    body_grid: Grid,
    /// All movers.
    robots: Vec<Hull>,
    robot_grid: Grid,
    /// The radius of the widest mover.
    widest: f64,
    /// Number of people among the movers.
    #[serde(default, skip_serializing_if = "is_zero")]
    people: usize,
    /// Number of doors among the movers.
    #[serde(default, skip_serializing_if = "is_zero")]
    doors: usize,
    /// Map whose walls are the first static bodies; it never changes, and is no part of the state.
    #[serde(skip)]
    map: Option<Arc<WorldMap>>,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(number: &usize) -> bool {
    *number == 0
}

impl Surroundings {
    /// Static bodies by their names, and the map whose walls the first ones are, if any.
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

    /// Map whose walls are the first static bodies.
    pub fn map(&self) -> Option<&Arc<WorldMap>> {
        self.map.as_ref()
    }

    /// Puts a robot in. [`arrange`](Self::arrange) must follow.
    pub fn add(&mut self, hull: Hull) {
        self.add_mover(Mover::Robot, hull);
    }

    /// Puts a mover in, after those of its kind and before those of later kinds. [`arrange`](Self::arrange) must follow.
    pub fn add_mover(&mut self, mover: Mover, hull: Hull) {
        self.widest = max(self.widest, hull.radius);
        self.robots.push(hull);
        match mover {
            Mover::Robot => {}
            Mover::Person => self.people += 1,
            Mover::Door => self.doors += 1,
        }
    }

    /// The movers, to be moved. [`arrange`](Self::arrange) must follow.
    pub fn hulls_mut(&mut self) -> &mut [Hull] {
        &mut self.robots
    }

    /// Makes movers that moved to be found where they are.
    pub fn arrange(&mut self) {
        let places = self.robots.iter().map(|hull| Extent::around(hull.frame.origin, 0.0));
        self.robot_grid.fill(places);
    }

    /// Static bodies with their outlines.
    pub fn bodies(&self) -> &[(String, Polygon)] {
        &self.bodies
    }

    /// The robots.
    pub fn robots(&self) -> &[Hull] {
        &self.robots[..self.robot_count()]
    }

    /// The movers: robots, people and doors.
    pub fn hulls(&self) -> &[Hull] {
        &self.robots
    }

    /// Number of robots, which is that of the first person among the movers.
    pub fn robot_count(&self) -> usize {
        self.robots.len() - self.people - self.doors
    }

    /// The kind of the mover of that number among the movers.
    pub fn mover(&self, number: usize) -> Mover {
        match number.checked_sub(self.robot_count()) {
            None => Mover::Robot,
            Some(other) if other < self.people => Mover::Person,
            Some(_) => Mover::Door,
        }
    }

    /// The outline of the body of that number.
    pub fn outline(&self, number: usize) -> &Polygon {
        match number.checked_sub(self.bodies.len()) {
            Some(robot) => &self.robots[robot].outline,
            None => &self.bodies[number].1,
        }
    }

    /// A circle around the body of that number.
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

    /// Tells the numbers of the bodies of which a part may be within `reach` of a point, with a lower bound of their
    /// distance from it.
    pub fn near(&self, center: Point, reach: f64, mut found: impl FnMut(usize, f64)) {
        self.near_bodies(center, reach, &mut found);
        self.near_movers(center, reach, |mover, distance| found(self.bodies.len() + mover, distance));
    }

    /// The same for static bodies alone.
    pub fn near_bodies(&self, center: Point, reach: f64, mut found: impl FnMut(usize, f64)) {
        self.body_grid.near(&Extent::around(center, reach), |body| {
            let distance = self.extents[body].distance(center);
            if distance <= reach {
                found(body, distance);
            }
        });
    }

    /// The same for movers alone, by their numbers among the movers.
    pub fn near_movers(&self, center: Point, reach: f64, mut found: impl FnMut(usize, f64)) {
        self.robot_grid.near(&Extent::around(center, reach + self.widest), |robot| {
            let hull = &self.robots[robot];
            let distance = hull.frame.origin.minus(center).norm() - hull.radius;
            if distance <= reach {
                found(robot, distance);
            }
        });
    }

    /// Gathers what sensors of a robot can meet that are at most `aside` from its reference point and reach `range`
    /// metres: bodies with those of their edges that turn their outside to one of them.
    pub fn look_around(&self, robot: usize, range: f64, aside: f64, into: &mut Nearby) {
        self.look_beyond(robot, range, aside, 0, into);
    }

    /// The same without the walls of the map, for sensors that look for those in the map itself.
    pub fn look_beyond_map(&self, robot: usize, range: f64, aside: f64, into: &mut Nearby) {
        let walls = self.map.as_ref().map_or(0, |map| map.walls);
        self.look_beyond(robot, range, aside, walls, into);
    }

    /// Gathers what a sensor can meet of the bodies from that number on.
    fn look_beyond(&self, robot: usize, range: f64, aside: f64, first_body: usize, into: &mut Nearby) {
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

    /// The distance from a robot's body to the nearest other one, metres; infinite when there is none.
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
