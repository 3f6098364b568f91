//! Sensor that sees other robots.

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{atan2, cos, max, sin};

use crate::geometry::{Frame, Point};
use crate::rate::due;
use crate::robot::RobotSensorDescription;
use crate::surroundings::Surroundings;

/// Detection of another robot, in the robot's frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sighting {
    /// Number of the detected robot.
    pub robot: usize,
    /// Distance between the reference points, m.
    pub range: f64,
    /// Bearing, counter-clockwise from the front, rad.
    pub bearing: f64,
}

/// Number of lines of sight to another robot.
const RAYS: u32 = 16;

/// Sensor that detects robots with a sufficient visible share.
///
/// It casts 16 rays, evenly spread over the other's width in its view. A ray counts if it is in the field of view and
/// not occluded by another body; the robot that carries the sensor occludes nothing.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RobotSensor {
    description: RobotSensorDescription,
    random: Random,
    /// Time of the last turn, ns.
    turn: Option<u64>,
    /// Time of the last measurement, ns.
    last: Option<u64>,
    sightings: Vec<Sighting>,
    /// Scratch memory for the numbers of nearby bodies.
    #[serde(skip)]
    near: Vec<usize>,
}

impl RobotSensor {
    /// Creates the sensor of a robot; `random` is the stream of its noise.
    pub fn new(description: &RobotSensorDescription, random: Random) -> Self {
        Self {
            description: description.clone(),
            random,
            turn: None,
            last: None,
            sightings: Vec::new(),
            near: Vec::new(),
        }
    }

    /// Returns the newest detections, nearest first.
    pub fn sightings(&self) -> &[Sighting] {
        &self.sightings
    }

    /// Returns the newest detections, as input of faults.
    pub(crate) fn newest(&self) -> &Vec<Sighting> {
        &self.sightings
    }

    /// Returns the time of the last measurement, ns.
    pub fn measured_at(&self) -> Option<u64> {
        self.last
    }

    /// Measures from robot number `own` if a measurement is due.
    pub fn measure(&mut self, own: usize, surroundings: &Surroundings, now: u64) {
        if self.description.rate.is_some_and(|rate| !due(rate, 0.0, self.turn, now)) {
            return;
        }
        self.turn = Some(now);
        let sweep_dropout = self.description.sweep_dropout;
        if sweep_dropout > 0.0 && self.random.unit() < sweep_dropout {
            return;
        }
        self.last = Some(now);
        self.sightings.clear();
        let frame = *surroundings.robots()[own].frame();
        let [x, y, degrees] = self.description.mount;
        let (direction, mount) = (degrees.to_radians(), Point::new(x, y));
        let eye = Eye {
            origin: frame.apply(mount),
            axis: frame.rotate(Point::new(cos(direction), sin(direction))),
            half_field: self.description.field_of_view / 2.0,
        };
        let first_robot = surroundings.bodies().len();
        self.near.clear();
        surroundings.near(eye.origin, self.description.range_max, |number, _| {
            if number != first_robot + own {
                self.near.push(number);
            }
        });
        // Where things are found depends on where others are, and noise must not.
        self.near.sort_unstable();
        for &number in &self.near {
            let robot = number.checked_sub(first_robot).filter(|mover| *mover < surroundings.robot_count());
            let Some(robot) = robot else { continue };
            let place = surroundings.robots()[robot].frame().origin;
            let distance = place.minus(eye.origin).norm();
            let share = || eye.share_in_view(number, surroundings, &self.near);
            if distance > self.description.range_max || share() < self.description.visible_share {
                continue;
            }
            if let Some(seen) = measure(&self.description, &mut self.random, frame.local(place).minus(mount))
            {
                let way = seen.plus(mount, 1.0);
                self.sightings.push(Sighting { robot, range: way.norm(), bearing: atan2(way.y, way.x) });
            }
        }
        self.sightings.sort_unstable_by(|a, b| a.range.total_cmp(&b.range).then(a.robot.cmp(&b.robot)));
    }
}

/// Measures range and bearing of another robot; `None` if it is missed.
fn measure(description: &RobotSensorDescription, random: &mut Random, way: Point) -> Option<Point> {
    let RobotSensorDescription { noise_constant, noise_proportional, noise_bearing, dropout, .. } =
        *description;
    if [noise_constant, noise_proportional, noise_bearing, dropout].iter().all(|value| *value == 0.0) {
        return Some(way);
    }
    let (lost, far, aside) = (random.unit() < dropout, random.normal(), random.normal() * noise_bearing);
    let distance = way.norm();
    let measured = max(distance + far * (noise_constant + noise_proportional * distance), 0.0);
    let turn = Frame { origin: Point::default(), cos: cos(aside), sin: sin(aside) };
    let direction = if distance > 0.0 { 1.0 / distance } else { 0.0 };
    (!lost).then(|| turn.rotate(Point::default().plus(way, measured * direction)))
}

/// Viewpoint of a sensor.
struct Eye {
    origin: Point,
    /// Unit direction of the sensor's axis.
    axis: Point,
    half_field: f64,
}

impl Eye {
    /// Returns the visible share of a body's width, without occlusion by `near` bodies.
    fn share_in_view(&self, number: usize, surroundings: &Surroundings, near: &[usize]) -> f64 {
        let (center, radius) = surroundings.circle(number);
        let way = center.minus(self.origin);
        // The corners that are seen farthest to the left and to the right.
        let mut sides = [center; 2];
        for corner in &surroundings.outline(number).points {
            let aside = |point: Point| {
                let to = point.minus(self.origin);
                way.cross(to) / max(way.dot(to), f64::MIN_POSITIVE)
            };
            if aside(*corner) > aside(sides[0]) {
                sides[0] = *corner;
            }
            if aside(*corner) < aside(sides[1]) {
                sides[1] = *corner;
            }
        }
        // The ways end on the line between these corners, which is inside the other.
        let width = sides[1].minus(sides[0]);
        let end = |ray: u32| sides[0].plus(width, (f64::from(ray) + 0.5) / f64::from(RAYS));
        let mut open =
            (0..RAYS).filter(|ray| self.is_in_view(end(*ray))).fold(0_u32, |rays, ray| rays | 1 << ray);
        for &other in near.iter().filter(|other| **other != number) {
            let (place, size) = surroundings.circle(other);
            let nearest = crate::geometry::nearest_on(self.origin, center, place);
            if nearest.minus(place).norm() > size + radius {
                continue;
            }
            for ray in 0..RAYS {
                let hidden = |(a, b)| crosses(self.origin, end(ray), a, b);
                if open & 1 << ray != 0 && surroundings.outline(other).edges().any(hidden) {
                    open &= !(1 << ray);
                }
            }
        }
        f64::from(open.count_ones()) / f64::from(RAYS)
    }

    fn is_in_view(&self, point: Point) -> bool {
        let way = point.minus(self.origin);
        atan2(self.axis.cross(way), self.axis.dot(way)).abs() <= self.half_field
    }
}

/// Returns whether the segments from `a` to `b` and from `c` to `d` cross.
fn crosses(a: Point, b: Point, c: Point, d: Point) -> bool {
    let (way, other) = (b.minus(a), d.minus(c));
    way.cross(c.minus(a)) * way.cross(d.minus(a)) <= 0.0
        && other.cross(a.minus(c)) * other.cross(b.minus(c)) <= 0.0
}
