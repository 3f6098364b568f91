//! Shortest paths forward and in reverse.

use std::f64::consts::{FRAC_PI_2, PI};

use slate_interfaces::Pose2;
use slate_module::math;

use crate::steering_path::{PathPenalties, SteeringPath, SteeringPosition, normalized};

/// Returns the shortest path of a robot that also reverses (Reeds-Shepp curve).
/// The smallest turning radius is in meters (Reeds and Shepp, 1990, *Optimal paths for a car that goes both forwards
/// and backwards*, section 8).
pub fn reeds_shepp(start: &Pose2, end: &Pose2, turning_radius: f64) -> SteeringPath {
    best(start, end, turning_radius, &PathPenalties { reverse: 1.0, non_straight: 1.0, change: 0.0 })
}

/// Returns the cheapest of the paper's words.
/// Each of them is the shortest of its kind.
pub(crate) fn best(
    start: &Pose2,
    end: &Pose2,
    turning_radius: f64,
    penalties: &PathPenalties,
) -> SteeringPath {
    let [x, y, turn] = normalized(start, end, turning_radius);
    let mut best =
        CheapestPath { path: SteeringPath::default(), cost: f64::INFINITY, turning_radius, penalties };
    for mirror in MIRRORS {
        let at = mirror.target(x, y, turn);
        for (kind, formula) in FORMULAS {
            best.offer(kind, formula(at), mirror);
        }
        // Driven the other way round, a word has its segments in the opposite order.
        let back = backwards(at);
        for (kind, formula) in REVERSIBLE_FORMULAS {
            best.offer_backwards(kind, formula(back), mirror);
        }
    }
    best.path
}

/// Symmetries of the plane (paper, section 8): time flip and reflection.
/// Time runs backwards, and left is right.
#[derive(Clone, Copy)]
struct WordMirror {
    is_reverse: bool,
    is_reflected: bool,
}

const MIRRORS: [WordMirror; 4] = [
    WordMirror { is_reverse: false, is_reflected: false },
    WordMirror { is_reverse: true, is_reflected: false },
    WordMirror { is_reverse: false, is_reflected: true },
    WordMirror { is_reverse: true, is_reflected: true },
];

impl WordMirror {
    fn target(self, x: f64, y: f64, turn: f64) -> [f64; 3] {
        let along = if self.is_reverse { -x } else { x };
        let across = if self.is_reflected { -y } else { y };
        let turn = if self.is_reverse == self.is_reflected { turn } else { -turn };
        [along, across, turn]
    }

    fn apply(self, (steering, length): (SteeringPosition, f64)) -> (SteeringPosition, f64) {
        let steering = match steering {
            SteeringPosition::Left if self.is_reflected => SteeringPosition::Right,
            SteeringPosition::Right if self.is_reflected => SteeringPosition::Left,
            same => same,
        };
        (steering, if self.is_reverse { -length } else { length })
    }
}

struct CheapestPath<'a> {
    path: SteeringPath,
    cost: f64,
    turning_radius: f64,
    penalties: &'a PathPenalties,
}

impl CheapestPath<'_> {
    fn offer(&mut self, kind: &[SteeringPosition], lengths: Option<[f64; 5]>, mirror: WordMirror) {
        let Some(lengths) = lengths else { return };
        let mut word = [(SteeringPosition::Straight, 0.0); 5];
        for (segment, (steering, length)) in word.iter_mut().zip(kind.iter().zip(lengths)) {
            *segment = mirror.apply((*steering, length));
        }
        self.take(&word[..kind.len()]);
    }

    fn offer_backwards(&mut self, kind: &[SteeringPosition], lengths: Option<[f64; 5]>, mirror: WordMirror) {
        let Some(lengths) = lengths else { return };
        let mut word = [(SteeringPosition::Straight, 0.0); 5];
        for (segment, (steering, length)) in word.iter_mut().zip(kind.iter().zip(lengths).rev()) {
            *segment = mirror.apply((*steering, length));
        }
        self.take(&word[..kind.len()]);
    }

    fn take(&mut self, word: &[(SteeringPosition, f64)]) {
        let path = SteeringPath::new(word, self.turning_radius);
        let cost = path.cost(self.penalties);
        if cost < self.cost {
            (self.path, self.cost) = (path, cost);
        }
    }
}

type Formula = fn([f64; 3]) -> Option<[f64; 5]>;

const L: SteeringPosition = SteeringPosition::Left;
const R: SteeringPosition = SteeringPosition::Right;
const S: SteeringPosition = SteeringPosition::Straight;

/// Words with their formulas.
const FORMULAS: [(&[SteeringPosition], Formula); 8] = [
    (&[L, S, L], left_straight_left),
    (&[L, S, R], left_straight_right),
    (&[L, R, L], left_right_left),
    (&[L, R, L, R], left_right_left_right_opposite),
    (&[L, R, L, R], left_right_left_right_same),
    (&[L, R, S, L], left_right_straight_left),
    (&[L, R, S, R], left_right_straight_right),
    (&[L, R, S, L, R], left_right_straight_left_right),
];

/// Formulas that are of another kind when driven in the opposite order.
const REVERSIBLE_FORMULAS: [(&[SteeringPosition], Formula); 3] = [
    (&[L, R, L], left_right_left),
    (&[L, R, S, L], left_right_straight_left),
    (&[L, R, S, R], left_right_straight_right),
];

/// Returns the start in the frame of the end, for a path driven backwards.
/// The path is driven in the opposite order.
fn backwards([x, y, turn]: [f64; 3]) -> [f64; 3] {
    let (sine, cosine) = (math::sin(turn), math::cos(turn));
    [x * cosine + y * sine, x * sine - y * cosine, turn]
}

/// Returns the length and direction of a vector.
fn polar(x: f64, y: f64) -> (f64, f64) {
    (math::hypot(x, y), math::atan2(y, x))
}

/// Lengths with their signs, as the word has them: rounding must not hide one of 0.
const ROUNDING: f64 = 1e-10;

fn signed(lengths: [f64; 5], signs: [f64; 5]) -> Option<[f64; 5]> {
    lengths.iter().zip(signs).all(|(length, sign)| length * sign >= -ROUNDING).then_some(lengths)
}

/// Equation 8.1: L+ S+ L+.
fn left_straight_left([x, y, turn]: [f64; 3]) -> Option<[f64; 5]> {
    let (u, t) = polar(x - math::sin(turn), y - 1.0 + math::cos(turn));
    let v = math::wrap_angle(turn - t);
    signed([t, u, v, 0.0, 0.0], [1.0, 1.0, 1.0, 0.0, 0.0])
}

/// Equation 8.2: L+ S+ R+.
fn left_straight_right([x, y, turn]: [f64; 3]) -> Option<[f64; 5]> {
    let (distance, direction) = polar(x + math::sin(turn), y - 1.0 - math::cos(turn));
    let square = distance * distance - 4.0;
    if square < 0.0 {
        return None;
    }
    let u = square.sqrt();
    let t = math::wrap_angle(direction + math::atan2(2.0, u));
    let v = math::wrap_angle(t - turn);
    signed([t, u, v, 0.0, 0.0], [1.0, 1.0, 1.0, 0.0, 0.0])
}

/// Equations 8.3 and 8.4: L+ R- L, with the last arc in either direction.
fn left_right_left([x, y, turn]: [f64; 3]) -> Option<[f64; 5]> {
    let (distance, direction) = polar(x - math::sin(turn), y - 1.0 + math::cos(turn));
    if distance > 4.0 {
        return None;
    }
    let u = -2.0 * math::asin(0.25 * distance);
    let t = math::wrap_angle(direction + 0.5 * u + PI);
    let v = math::wrap_angle(turn - t + u);
    signed([t, u, v, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0, 0.0])
}

/// Returns the arcs before and after the two in the middle (below 8.6).
/// One of these turns by `u`, the other by `v`.
fn outer_arcs(u: f64, v: f64, [xi, eta, turn]: [f64; 3]) -> (f64, f64) {
    let delta = math::wrap_angle(u - v);
    let a = math::sin(u) - math::sin(delta);
    let b = math::cos(u) - math::cos(delta) - 1.0;
    let first = math::atan2(eta * a - xi * b, xi * a + eta * b);
    let side = 2.0 * (math::cos(delta) - math::cos(v) - math::cos(u)) + 3.0;
    let t = math::wrap_angle(if side < 0.0 { first + PI } else { first });
    (t, math::wrap_angle(t - u + v - turn))
}

/// Equation 8.7: L+ R+ L- R-.
fn left_right_left_right_opposite([x, y, turn]: [f64; 3]) -> Option<[f64; 5]> {
    let (xi, eta) = (x + math::sin(turn), y - 1.0 - math::cos(turn));
    let rho = 0.25 * (2.0 + math::hypot(xi, eta));
    if rho > 1.0 {
        return None;
    }
    let u = math::acos(rho);
    let (t, v) = outer_arcs(u, -u, [xi, eta, turn]);
    signed([t, u, -u, v, 0.0], [1.0, 1.0, -1.0, -1.0, 0.0])
}

/// Equation 8.8: L+ R- L- R+.
fn left_right_left_right_same([x, y, turn]: [f64; 3]) -> Option<[f64; 5]> {
    let (xi, eta) = (x + math::sin(turn), y - 1.0 - math::cos(turn));
    let rho = (20.0 - xi * xi - eta * eta) / 16.0;
    if !(0.0..=1.0).contains(&rho) {
        return None;
    }
    let u = -math::acos(rho);
    let (t, v) = outer_arcs(u, u, [xi, eta, turn]);
    signed([t, u, u, v, 0.0], [1.0, -1.0, -1.0, 1.0, 0.0])
}

/// Equation 8.9: L+ R- S- L-, with a quarter turn.
fn left_right_straight_left([x, y, turn]: [f64; 3]) -> Option<[f64; 5]> {
    let (rho, direction) = polar(x - math::sin(turn), y - 1.0 + math::cos(turn));
    if rho < 2.0 {
        return None;
    }
    let r = (rho * rho - 4.0).sqrt();
    let u = 2.0 - r;
    let t = math::wrap_angle(direction + math::atan2(r, -2.0));
    let v = math::wrap_angle(turn - FRAC_PI_2 - t);
    signed([t, -FRAC_PI_2, u, v, 0.0], [1.0, -1.0, -1.0, -1.0, 0.0])
}

/// Equation 8.10: L+ R- S- R-, with a quarter turn.
fn left_right_straight_right([x, y, turn]: [f64; 3]) -> Option<[f64; 5]> {
    let (xi, eta) = (x + math::sin(turn), y - 1.0 - math::cos(turn));
    let (rho, t) = polar(-eta, xi);
    if rho < 2.0 {
        return None;
    }
    let u = 2.0 - rho;
    let v = math::wrap_angle(t + FRAC_PI_2 - turn);
    signed([t, -FRAC_PI_2, u, v, 0.0], [1.0, -1.0, -1.0, -1.0, 0.0])
}

/// Equation 8.11: L+ R- S- L- R+, with two quarter turns.
fn left_right_straight_left_right([x, y, turn]: [f64; 3]) -> Option<[f64; 5]> {
    let (xi, eta) = (x + math::sin(turn), y - 1.0 - math::cos(turn));
    let rho = math::hypot(xi, eta);
    if rho < 2.0 {
        return None;
    }
    let u = 4.0 - (rho * rho - 4.0).sqrt();
    if u > 0.0 {
        return None;
    }
    let t = math::wrap_angle(math::atan2((4.0 - u) * xi - 2.0 * eta, -2.0 * xi + (u - 4.0) * eta));
    let v = math::wrap_angle(t - turn);
    signed([t, -FRAC_PI_2, u, -FRAC_PI_2, v], [1.0, -1.0, -1.0, -1.0, 1.0])
}
