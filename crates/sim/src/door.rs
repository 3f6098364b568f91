//! Doors that slide open and closed.

use rapier2d_f64::prelude::RigidBodyHandle;
use serde::{Deserialize, Serialize};
use slate_module::math::{atan2, clamp};

use crate::error::DescriptionError;
use crate::geometry::{Point, Polygon, Pose, nearest_on};
use crate::surroundings::{Mover, Surroundings};

/// Time for which a door stays open after all have left, ns.
const HOLD_TIME: u64 = 2_000_000_000;
/// Clearance of the closed leaf without which a door does not close, m.
const SAFE_DISTANCE: f64 = 0.1;

/// Opening rule of a door.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DoorOpening {
    /// Open while a person or a robot is near.
    #[default]
    Near,
    /// Always open.
    Always,
    /// Never open.
    Never,
    /// Open for some time in each period.
    Period,
}

/// Sliding door: `[world.doors.NAME]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DoorDescription {
    /// End of the closed leaf behind which it vanishes when it opens, m.
    pub from: [f64; 2],
    /// Other end of the closed leaf, m.
    pub to: [f64; 2],
    /// Thickness of the leaf, m.
    #[serde(default = "usual_thickness")]
    pub thickness: f64,
    /// Opening rule.
    #[serde(default)]
    pub open: DoorOpening,
    /// Distance of a person or a robot at which it opens, m.
    #[serde(default = "usual_distance")]
    pub distance: f64,
    /// Time between two openings, s.
    #[serde(default = "usual_period")]
    pub period: f64,
    /// Time in each period for which it is open, s.
    #[serde(default = "usual_open_time")]
    pub open_time: f64,
    /// Speed of the leaf, m/s.
    #[serde(default = "usual_leaf_speed")]
    pub speed: f64,
}

fn usual_thickness() -> f64 {
    0.05
}

fn usual_distance() -> f64 {
    1.5
}

fn usual_period() -> f64 {
    20.0
}

fn usual_open_time() -> f64 {
    10.0
}

fn usual_leaf_speed() -> f64 {
    0.7
}

impl DoorDescription {
    /// Checks the numbers; `setting` is the door's.
    ///
    /// # Errors
    /// The setting that is out of its range.
    pub fn check(&self, setting: &str) -> Result<(), DescriptionError> {
        let is_positive = |value: f64| value.is_finite() && value > 0.0;
        let is_finite = |end: [f64; 2]| end.iter().all(|value| value.is_finite());
        let length = self.way().norm();
        let checks = [
            ("from", is_finite(self.from), "expected a point such as [1.0, 2.0]"),
            ("to", is_finite(self.to), "expected a point such as [1.0, 2.0]"),
            ("to", (0.2..=20.0).contains(&length), "expected a point from 0.2 to 20 m from `from`"),
            ("thickness", (0.01..=1.0).contains(&self.thickness), "expected from 0.01 to 1 m"),
            ("distance", is_positive(self.distance), "expected a positive number of meters"),
            ("period", is_positive(self.period), "expected a positive number of seconds"),
            (
                "open_time",
                is_positive(self.open_time) && self.open_time < self.period,
                "expected a positive number of seconds, less than `period`",
            ),
            ("speed", is_positive(self.speed), "expected a positive number of meters per second"),
        ];
        let wrong = checks.into_iter().find(|(_, right, _)| !right);
        wrong.map_or(Ok(()), |(key, _, message)| {
            Err(DescriptionError::new(&format!("{setting}.{key}"), message))
        })
    }

    /// Returns the outline of the leaf in its own frame.
    pub fn outline(&self) -> Polygon {
        Polygon::rectangle(Point::default(), self.way().norm(), self.thickness)
    }

    /// Returns the pose of the leaf for an open part of the doorway, 0 to 1.
    pub fn leaf(&self, opening: f64) -> Pose {
        let way = self.way();
        let [x, y] = self.from;
        let middle = Point::new(x, y).plus(way, 0.5 - opening);
        Pose { x: middle.x, y: middle.y, theta: atan2(way.y, way.x) }
    }

    /// Returns the open part of the doorway at the start, 0 to 1.
    pub fn opening_at_start(&self) -> f64 {
        if matches!(self.open, DoorOpening::Always | DoorOpening::Period) { 1.0 } else { 0.0 }
    }

    /// Returns the vector from one end to the other.
    fn way(&self) -> Point {
        let ([x, y], [to_x, to_y]) = (self.from, self.to);
        Point::new(to_x - x, to_y - y)
    }
}

/// Door of a world.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Door {
    pub name: String,
    pub handle: RigidBodyHandle,
    pub description: DoorDescription,
    /// Part of the doorway that is open.
    pub opening: f64,
    /// Velocity of the leaf, m/s.
    pub velocity: Point,
    /// Time until which it stays open after a robot or a person was near, ns.
    held_until: u64,
}

impl Door {
    pub fn new(name: &str, handle: RigidBodyHandle, description: DoorDescription) -> Self {
        let opening = description.opening_at_start();
        Self { name: name.into(), handle, description, opening, velocity: Point::default(), held_until: 0 }
    }

    /// Returns the pose of the leaf.
    pub fn pose(&self) -> Pose {
        self.description.leaf(self.opening)
    }

    /// Moves the leaf for `step` seconds.
    pub fn slide(&mut self, surroundings: &Surroundings, now: u64, step: f64) {
        let way = self.description.way();
        let length = way.norm();
        let most = self.description.speed * step / length;
        let wanted = if self.opens(surroundings, now) { 1.0 } else { 0.0 };
        let change = clamp(wanted - self.opening, -most, most);
        self.opening += change;
        self.velocity = Point::default().plus(way, -change / step);
    }

    /// Returns whether the door should be open.
    fn opens(&mut self, surroundings: &Surroundings, now: u64) -> bool {
        let DoorDescription { open, distance, period, open_time, .. } = self.description;
        let nearest = || nearest(&self.description, surroundings);
        let is_wanted = match open {
            DoorOpening::Always => return true,
            DoorOpening::Never => return false,
            DoorOpening::Period => {
                let seconds = now as f64 * 1e-9;
                seconds - (seconds / period).floor() * period < open_time
            }
            DoorOpening::Near => {
                if nearest() < distance {
                    self.held_until = now + HOLD_TIME;
                }
                now < self.held_until
            }
        };
        // The leaf never closes on a body.
        is_wanted || (self.opening > 0.0 && nearest() < SAFE_DISTANCE + self.description.thickness / 2.0)
    }
}

/// Returns the distance from a doorway to the nearest robot or person, m.
/// Infinite beyond the distances that any door uses.
fn nearest(door: &DoorDescription, surroundings: &Surroundings) -> f64 {
    let ([x, y], way) = (door.from, door.way());
    let (from, to) = (Point::new(x, y), Point::new(x, y).plus(way, 1.0));
    let reach = way.norm() / 2.0 + door.distance + SAFE_DISTANCE + door.thickness;
    let mut nearest = f64::INFINITY;
    surroundings.near_movers(from.plus(way, 0.5), reach, |mover, _| {
        if surroundings.mover(mover) == Mover::Door {
            return;
        }
        let outline = surroundings.hulls()[mover].outline();
        let corners = outline.points.iter().map(|corner| nearest_on(from, to, *corner).minus(*corner).norm());
        let ends = [from, to].into_iter().map(|end| match outline.contains(end) {
            true => 0.0,
            false => outline.nearest(end).minus(end).norm(),
        });
        let crosses = outline.edges().any(|(a, b)| crosses(from, to, a, b));
        let distance =
            if crosses { 0.0 } else { corners.chain(ends).fold(f64::INFINITY, slate_module::math::min) };
        nearest = slate_module::math::min(nearest, distance);
    });
    nearest
}

/// Returns whether two segments cross.
fn crosses(a: Point, b: Point, c: Point, d: Point) -> bool {
    let (way, other) = (b.minus(a), d.minus(c));
    way.cross(c.minus(a)) * way.cross(d.minus(a)) < 0.0
        && other.cross(a.minus(c)) * other.cross(b.minus(c)) < 0.0
}
