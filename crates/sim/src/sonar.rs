//! Sonars: each measures the nearest obstacle in its cone, an area and not a ray.

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{clamp, cos, max, min, sin, tan};

use crate::geometry::{Frame, Point};
use crate::rate::due;
use crate::robot::SonarDescription;
use crate::surroundings::{NearBody, Nearby};

/// Measurement of a sonar.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Echo {
    /// Range, m; the maximum range without an echo.
    pub range: f64,
    /// Detection of an echo.
    pub heard: bool,
}

/// Field of view of one sonar.
struct Cone {
    origin: Point,
    /// Unit vectors of its axis and its borders.
    axis: Point,
    left: Point,
    right: Point,
}

/// Margin of the test for missed bodies, m.
/// A body that is heard is not left out by rounding.
const ROUNDING_MARGIN: f64 = 1e-9;

impl Cone {
    /// Returns whether a body is behind the sonar or beyond a border of the cone.
    fn misses(&self, body: &NearBody) -> bool {
        let (to, radius) = (body.center.minus(self.origin), body.radius + ROUNDING_MARGIN);
        self.axis.dot(to) < -radius || self.left.cross(to) > radius || self.right.cross(to) < -radius
    }
}

/// Ring of sonars with precomputed directions.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SonarRing {
    description: SonarDescription,
    /// Position and direction of each sonar in the robot's frame.
    mounts: Vec<(Point, Point)>,
    /// Cosine and sine of half the opening angle.
    half: (f64, f64),
    /// Tangent of the maximum incidence.
    incidence: f64,
    random: Random,
    /// Time of the last sweep, ns.
    last: Option<u64>,
}

impl SonarRing {
    /// Creates the ring of a robot; `random` is the stream of its noise.
    pub fn new(description: &SonarDescription, random: Random) -> Self {
        let half = description.field_of_view / 2.0;
        let mounts = description
            .placements
            .iter()
            .map(|[x, y, degrees]| {
                let angle = degrees.to_radians();
                (Point::new(*x, *y), Point::new(cos(angle), sin(angle)))
            })
            .collect();
        Self {
            half: (cos(half), sin(half)),
            incidence: tan(description.maximum_incidence),
            description: description.clone(),
            mounts,
            random,
            last: None,
        }
    }

    /// Returns opening, ranges and placements.
    pub fn description(&self) -> &SonarDescription {
        &self.description
    }

    /// Returns the largest distance of a sonar from the reference point, m.
    pub fn aside(&self) -> f64 {
        self.mounts.iter().map(|(place, _)| place.norm()).fold(0.0, max) + ROUNDING_MARGIN
    }

    /// Returns the bit mask of the sonars that fire at time `now`, ns.
    /// The ring stores that time as the time of its last sweep.
    pub fn sound(&mut self, now: u64) -> u16 {
        let last = self.last.replace(now);
        let Some(rate) = self.description.rate else { return u16::MAX };
        let count = self.mounts.len();
        let sounds = |sonar: &usize| due(rate, *sonar as f64 / count as f64, last, now);
        (0..count).filter(sounds).fold(0, |mask, sonar| mask | 1 << sonar)
    }

    /// Measures with the sonars of a bit mask from a pose.
    /// Other sonars keep their echoes.
    pub fn sweep(&mut self, mask: u16, robot: &Frame, nearby: &Nearby, echoes: &mut Vec<Echo>) {
        let reach = self.description.range_max;
        echoes.resize(self.mounts.len(), Echo { range: reach, heard: false });
        let (cos_half, sin_half) = self.half;
        for (i, echo) in echoes.iter_mut().enumerate() {
            if mask & 1 << i == 0 {
                continue;
            }
            let (place, direction) = self.mounts[i];
            let (origin, axis) = (robot.apply(place), robot.rotate(direction));
            // Both borders of the cone are half-planes through the origin.
            let cone = Cone {
                origin,
                axis,
                left: Point::new(
                    axis.x * cos_half - axis.y * sin_half,
                    axis.x * sin_half + axis.y * cos_half,
                ),
                right: Point::new(
                    axis.x * cos_half + axis.y * sin_half,
                    -axis.x * sin_half + axis.y * cos_half,
                ),
            };
            let mut nearest = f64::INFINITY;
            let aside = place.norm() + ROUNDING_MARGIN;
            for (body, edges) in nearby.bodies() {
                if body.distance - aside > nearest {
                    break;
                }
                if cone.misses(body) {
                    continue;
                }
                for (a, b) in edges {
                    if let Some(distance) = self.edge_distance(&cone, *a, *b) {
                        nearest = min(nearest, distance);
                    }
                }
            }
            let measured = self.measure(nearest);
            *echo = measured
                .filter(|range| *range < reach)
                .map_or(Echo { range: reach, heard: false }, |range| Echo { range, heard: true });
        }
    }

    /// Returns the distance to the nearest visible point of an edge in the cone.
    /// The edge must face the sonar within the maximum incidence.
    fn edge_distance(&self, cone: &Cone, a: Point, b: Point) -> Option<f64> {
        let Cone { origin, axis, left, right } = *cone;
        let (a, b) = (a.minus(origin), b.minus(origin));
        // Most edges are not in the cone at all, and that is cheap to see.
        let beyond = |border: Point, sign: f64| sign * border.cross(a) > 0.0 && sign * border.cross(b) > 0.0;
        if (axis.dot(a) < 0.0 && axis.dot(b) < 0.0) || beyond(left, 1.0) || beyond(right, -1.0) {
            return None;
        }
        let along = b.minus(a);
        // Bodies are counter-clockwise, so a face that is seen from outside has the sonar on its right.
        let outside = along.cross(a);
        if outside <= 0.0 {
            return None;
        }
        let length = along.norm();
        let height = outside / length;
        if height > self.description.range_max {
            return None;
        }
        // Points of the line by their distance from the foot of the perpendicular.
        let first = a.dot(along) / length;
        let mut low = first;
        let mut high = first + length;
        low = max(low, -height * self.incidence);
        high = min(high, height * self.incidence);
        let unit = Point::new(along.x / length, along.y / length);
        let foot = a.plus(unit, -first);
        for (border, sign) in [(right, 1.0), (left, -1.0)] {
            // sign * cross(border, foot + t * unit) >= 0
            let constant = sign * border.cross(foot);
            let slope = sign * border.cross(unit);
            if slope > 0.0 {
                low = max(low, -constant / slope);
            } else if slope < 0.0 {
                high = min(high, -constant / slope);
            } else if constant < 0.0 {
                return None;
            }
        }
        if low > high {
            return None;
        }
        let nearest = foot.plus(unit, clamp(0.0, low, high));
        // The two half-planes also meet behind the sonar when the cone is narrow.
        let distance = nearest.norm();
        (nearest.dot(axis) > 0.0 && distance <= self.description.range_max).then_some(distance)
    }

    fn measure(&mut self, distance: f64) -> Option<f64> {
        let SonarDescription {
            range_min,
            range_max,
            noise_constant,
            noise_proportional,
            dropout,
            crosstalk,
            ..
        } = self.description;
        let noisy = noise_constant > 0.0 || noise_proportional > 0.0 || dropout > 0.0 || crosstalk > 0.0;
        if !noisy {
            return distance.is_finite().then(|| max(distance, range_min));
        }
        // Drawn in any case, so that one sonar's echo does not shift another's noise.
        let (lost, error) = (self.random.unit() < dropout, self.random.normal());
        let (crossed, when) = (self.random.unit() < crosstalk, self.random.unit());
        if crossed {
            return Some(range_min + when * (min(distance, range_max) - range_min));
        }
        if lost || !distance.is_finite() {
            return None;
        }
        Some(max(distance + error * (noise_constant + noise_proportional * distance), range_min))
    }
}
