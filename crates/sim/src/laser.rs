//! Laser scanner: the nearest obstacle along each beam.

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{cos, min, sin};

use crate::geometry::Point;
use crate::rate::due;
use crate::robot::LaserDescription;
use crate::surroundings::{NearBody, Nearby, Surroundings};

/// Laser scanner with precomputed beams.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LaserScanner {
    description: LaserDescription,
    /// Position in the robot's frame.
    place: Point,
    /// Unit direction of each beam in the robot's frame.
    beams: Vec<Point>,
    random: Random,
    /// Time of the last scan, ns.
    last: Option<u64>,
    ranges: Vec<f32>,
    /// Exact distances, m.
    #[serde(skip)]
    distances: Vec<f64>,
}

impl LaserScanner {
    /// Creates the scanner of a robot; `random` is the stream of its noise.
    pub fn new(description: &LaserDescription, random: Random) -> Self {
        let [x, y, degrees] = description.mount;
        let beam = |number: u32| {
            let angle = degrees.to_radians() + description.angle_of(number);
            Point::new(cos(angle), sin(angle))
        };
        Self {
            place: Point::new(x, y),
            beams: (0..description.beams).map(beam).collect(),
            description: description.clone(),
            random,
            last: None,
            ranges: Vec::with_capacity(description.beams as usize),
            distances: Vec::with_capacity(description.beams as usize),
        }
    }

    /// Returns field of view, ranges and noise.
    pub fn description(&self) -> &LaserDescription {
        &self.description
    }

    /// Returns the time of the last scan, ns.
    pub fn last(&self) -> Option<u64> {
        self.last
    }

    /// Returns the newest ranges in beam order, m; infinite without a return.
    pub fn ranges(&self) -> &Vec<f32> {
        &self.ranges
    }

    /// Measures from robot number `own` if a scan is due.
    /// `nearby` is scratch memory that many robots share.
    pub fn measure(&mut self, own: usize, surroundings: &Surroundings, now: u64, nearby: &mut Nearby) {
        let LaserDescription { rate, range_max, .. } = self.description;
        if rate.is_some_and(|rate| !due(rate, 0.0, self.last, now)) {
            return;
        }
        self.last = Some(now);
        let aside = self.place.norm();
        surroundings.find_near_outside_map(own, range_max, aside, nearby);
        let frame = surroundings.robots()[own].frame();
        let origin = frame.apply(self.place);
        self.distances.clear();
        let distances = self.beams.iter().map(|beam| {
            let beam = frame.rotate(*beam);
            let nearest = nearest_along(origin, beam, nearby, aside);
            let wall = surroundings.map().map_or(f64::INFINITY, |map| {
                map.caster.range([origin.x, origin.y], [beam.x, beam.y], range_max)
            });
            min(nearest, wall)
        });
        self.distances.extend(distances);
        self.description.measure(&self.distances, &mut self.random, &mut self.ranges);
    }
}

/// Margin of the test for missed bodies, m.
/// A body that a beam hits is not left out by rounding.
const ROUNDING_MARGIN: f64 = 1e-9;

/// Returns the range to the nearest edge along a beam; infinite for none, m.
/// The beam begins `aside` meters off the reference point.
fn nearest_along(origin: Point, beam: Point, nearby: &Nearby, aside: f64) -> f64 {
    let mut nearest = f64::INFINITY;
    for (body, edges) in nearby.bodies() {
        // The nearest bodies come first.
        if body.distance - aside - ROUNDING_MARGIN > nearest {
            break;
        }
        if passes(origin, beam, body) {
            continue;
        }
        for (a, b) in edges {
            let (to, along) = (a.minus(origin), b.minus(*a));
            let across = beam.cross(along);
            // Parallel to the beam there is nothing to be hit.
            if across == 0.0 {
                continue;
            }
            let (distance, share) = (to.cross(along) / across, to.cross(beam) / across);
            if distance > 0.0 && distance < nearest && (0.0..=1.0).contains(&share) {
                nearest = distance;
            }
        }
    }
    nearest
}

/// Returns whether a beam misses the bounding circle of a body.
fn passes(origin: Point, beam: Point, body: &NearBody) -> bool {
    let (to, radius) = (body.center.minus(origin), body.radius + ROUNDING_MARGIN);
    beam.cross(to).abs() > radius || beam.dot(to) < -radius
}
