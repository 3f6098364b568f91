//! Ambiguity of start poses in a map.

use slate_interfaces::Pose2;
use slate_module::math;
use slate_sim::robot::LaserDescription;

use super::building::Building;

/// Distance between two poses of the route at which another place is compared, m.
pub const SPACING: f64 = 2.0;
/// Distance and angle from which a pose is another place, m and rad.
const OTHER_PLACE: [f64; 2] = [1.0, 0.5];
/// Spacing of the lattice of compared places, m, and its directions.
/// The ranges at a place are in these directions.
const LATTICE: f64 = 0.25;
const DIRECTIONS: usize = 72;
/// Coarse match: range tolerance, m, and least share of matching beams.
/// The first pair holds at places of the lattice, which are some decimeters beside the best pose, the second at the
/// best pose.
const COARSE: [f64; 2] = [0.3, 0.75];
const FINE: [f64; 2] = [0.15, 0.9];
/// Similar places nearer to each other than this are one, m and rad.
const SAME_PLACE: [f64; 2] = [0.75, 0.3];
/// Step sizes of the search for the best pose, m and rad.
const STEPS: [[f64; 2]; 4] = [[0.1, 0.04], [0.05, 0.02], [0.025, 0.01], [0.01, 0.004]];

/// Exact ranges at places all over a building.
pub struct Ambiguity<'a> {
    building: &'a Building,
    laser: &'a LaserDescription,
    /// Directions within the laser's field of view, of [`DIRECTIONS`] around.
    directions: Vec<usize>,
    places: Vec<[f64; 2]>,
    /// Ranges at each place in all directions, m.
    ranges: Vec<f32>,
}

impl<'a> Ambiguity<'a> {
    /// Measures ranges in a building.
    pub fn new(building: &'a Building, laser: &'a LaserDescription) -> Self {
        let cells = ((LATTICE / building.geometry.resolution).round() as usize).max(1);
        let (columns, rows) = (building.geometry.width, building.geometry.height);
        let lattice = (0..rows)
            .step_by(cells)
            .flat_map(|row| (0..columns).step_by(cells).map(move |column| (column, row)));
        let places: Vec<[f64; 2]> = lattice
            .map(|(column, row)| building.geometry.center(column, row))
            .filter(|middle| building.is_drivable(middle.x, middle.y))
            .map(|middle| [middle.x, middle.y])
            .collect();
        let half = laser.field_of_view / 2.0;
        let is_seen = |direction: &usize| math::wrap_angle(angle(*direction)).abs() <= half;
        let ranges = places.iter().flat_map(|place| {
            let range = |direction| ray(building, laser, *place, angle(direction)) as f32;
            (0..DIRECTIONS).map(range)
        });
        Self {
            ranges: ranges.collect(),
            directions: (0..DIRECTIONS).filter(is_seen).collect(),
            places,
            building,
            laser,
        }
    }

    /// Returns true if the same route is free and looks the same elsewhere.
    /// At each of its poses at least 90 % of the exact ranges differ by less than 0.15 m. No trial's result is used.
    pub fn is_ambiguous(&self, route: &[Pose2]) -> bool {
        let Some((start, rest)) = route.split_first() else { return false };
        self.similar_places(start).iter().any(|other| self.is_followed(other, start, rest))
    }

    /// Returns other places of the lattice with similar ranges.
    /// The most similar comes first; of places that are one, only the best is returned.
    fn similar_places(&self, pose: &Pose2) -> Vec<Pose2> {
        let seen = self.scan(pose);
        let mut similar = Vec::new();
        for (place, [x, y]) in self.places.iter().enumerate() {
            for turn in 0..DIRECTIONS {
                let other = Pose2 { x: *x, y: *y, theta: angle(turn) };
                if let Some(different) = self.different_beams(place, turn, &seen)
                    && is_elsewhere(&other, pose, SAME_PLACE)
                {
                    similar.push((different, other));
                }
            }
        }
        similar.sort_by_key(|(different, _)| *different);
        let mut places: Vec<Pose2> = Vec::new();
        for (_, pose) in similar {
            if places.iter().all(|known| is_elsewhere(known, &pose, SAME_PLACE)) {
                places.push(pose);
            }
        }
        places
    }

    /// Returns the number of beams with another range at a rotated lattice place.
    /// `None` if too many have.
    fn different_beams(&self, place: usize, turn: usize, seen: &[f64]) -> Option<usize> {
        let ranges = &self.ranges[place * DIRECTIONS..(place + 1) * DIRECTIONS];
        let most = ((1.0 - COARSE[1]) * seen.len() as f64) as usize;
        let mut different = 0;
        for (direction, range) in self.directions.iter().zip(seen) {
            let other = f64::from(ranges[(direction + turn) % DIRECTIONS]);
            different += usize::from((other - range).abs() > COARSE[0]);
            if different > most {
                return None;
            }
        }
        Some(different)
    }

    /// Returns true if the route from another pose is free and looks the same.
    fn is_followed(&self, other: &Pose2, start: &Pose2, rest: &[Pose2]) -> bool {
        let Some(mut other) = self.refined(other, start) else { return false };
        let mut last = start;
        for pose in rest {
            let turn = other.theta - last.theta;
            let (sine, cosine) = (math::sin(turn), math::cos(turn));
            let (right, up) = (pose.x - last.x, pose.y - last.y);
            let moved = Pose2 {
                x: other.x + right * cosine - up * sine,
                y: other.y + right * sine + up * cosine,
                theta: math::wrap_angle(pose.theta + turn),
            };
            match self.refined(&moved, pose) {
                Some(refined) => other = refined,
                None => return false,
            }
            last = pose;
        }
        true
    }

    /// Returns the most similar pose near another one.
    /// `None` if its ranges are not similar, or if it is the same place.
    fn refined(&self, other: &Pose2, pose: &Pose2) -> Option<Pose2> {
        let seen = self.scan(pose);
        let mut best = *other;
        let mut least = self.difference(&best, &seen);
        for [step, turn] in STEPS {
            loop {
                let sides = [[step, 0.0, 0.0], [-step, 0.0, 0.0], [0.0, step, 0.0], [0.0, -step, 0.0]];
                let turns = [[0.0, 0.0, turn], [0.0, 0.0, -turn]];
                let before = least;
                for [x, y, theta] in sides.into_iter().chain(turns) {
                    let next = Pose2 { x: best.x + x, y: best.y + y, theta: best.theta + theta };
                    let difference = self.difference(&next, &seen);
                    if difference < least {
                        (best, least) = (next, difference);
                    }
                }
                if least == before {
                    break;
                }
            }
        }
        let same = self.scan(&best).iter().zip(&seen).filter(|(a, b)| (*a - *b).abs() < FINE[0]).count();
        let is_alike = same as f64 >= FINE[1] * seen.len() as f64;
        (is_alike && is_elsewhere(&best, pose, OTHER_PLACE) && self.building.is_drivable(best.x, best.y))
            .then_some(best)
    }

    /// Returns the difference of ranges from those seen, m.
    /// Each beam counts at most the coarse limit.
    fn difference(&self, pose: &Pose2, seen: &[f64]) -> f64 {
        self.scan(pose).iter().zip(seen).map(|(a, b)| math::min((a - b).abs(), COARSE[0])).sum()
    }

    /// Returns the exact ranges at a pose, m.
    fn scan(&self, pose: &Pose2) -> Vec<f64> {
        // As if the laser stood in the robot's middle, so that places can be turned.
        let from = [pose.x, pose.y];
        let ray = |direction: &usize| ray(self.building, self.laser, from, pose.theta + angle(*direction));
        self.directions.iter().map(ray).collect()
    }
}

/// Returns true if a pose is farther from another than a distance or turn.
/// Limits are in m and rad.
fn is_elsewhere(pose: &Pose2, other: &Pose2, [distance, turn]: [f64; 2]) -> bool {
    math::hypot(pose.x - other.x, pose.y - other.y) > distance
        || math::angle_between(pose.theta, other.theta).abs() > turn
}

fn angle(direction: usize) -> f64 {
    direction as f64 * (2.0 * std::f64::consts::PI / DIRECTIONS as f64)
}

/// Returns the exact range in a direction.
/// It is the range of the laser without an obstacle, m.
fn ray(building: &Building, laser: &LaserDescription, from: [f64; 2], angle: f64) -> f64 {
    math::min(
        building.caster.range(from, [math::cos(angle), math::sin(angle)], laser.range_max),
        laser.range_max,
    )
}
