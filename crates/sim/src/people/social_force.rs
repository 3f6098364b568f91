//! Social force model: accelerations of a walking person.
//!
//! The model is Helbing and Molnár's (1995, *Social force model for pedestrian dynamics*, Physical Review E 51). How people
//! avoid each other, and the numbers, are those that Moussaïd, Helbing, Garnier, Johansson, Combe and Theraulaz measured
//! (2009, *Experimental study of the behavioral mechanisms underlying self-organization in human crowds*, Proceedings of
//! the Royal Society B 276).

use slate_module::math::{atan2, exp};

use crate::geometry::Point;

/// Relaxation time to the desired velocity, s (Moussaïd et al., 2009).
const RELAXATION_TIME: f64 = 0.54;
/// Greatest speed relative to the desired one.
/// Helbing and Molnár, 1995, equation 12.
const GREATEST_SPEED: f64 = 1.3;
/// Strength of the interaction of people, m/s² (A, Moussaïd et al., 2009).
const STRENGTH: f64 = 4.5;
/// Weight of the relative velocity in an interaction's direction, s/m (lambda).
const VELOCITY_WEIGHT: f64 = 2.0;
/// Range of an interaction relative to the length of its vector, m (gamma).
const RANGE: f64 = 0.35;
/// Angular widths of the turn and of the deceleration, 1/m (n and n').
const ANGULAR_WIDTHS: [f64; 2] = [2.0, 3.0];
/// Angular bias that makes two people pass on the same side, rad/m; own choice.
/// It acts when they meet head-on.
const SIDE_PREFERENCE: f64 = 0.005;
/// Strength and range of the repulsion by walls, m/s² and m.
/// Moussaïd et al., 2009.
const WALL: [f64; 2] = [3.0, 0.1];

/// Returns the acceleration towards the desired velocity, m/s².
/// Helbing and Molnár, 1995, equation 2.
pub(super) fn drive(velocity: Point, desired: Point) -> Point {
    Point::default().plus(desired.minus(velocity), 1.0 / RELAXATION_TIME)
}

/// Returns the acceleration by another person or a robot, m/s².
/// It slows down and turns aside (Moussaïd et al., 2009).
///
/// `towards` is the direction to the other, of length 1, `distance` that of the middles of two people, m, and `closing` the
/// own velocity relative to that of the other, m/s.
pub(super) fn interaction(towards: Point, distance: f64, closing: Point) -> Point {
    let vector = towards.plus(closing, VELOCITY_WEIGHT);
    let length = vector.norm();
    if length < 1e-6 {
        return Point::default();
    }
    let along = Point::default().plus(vector, 1.0 / length);
    let left = Point::new(-along.y, along.x);
    let range = RANGE * length;
    let angle = atan2(along.cross(towards), along.dot(towards)) + SIDE_PREFERENCE * range;
    let fades = |width: f64| {
        let part = width * range * angle;
        STRENGTH * exp(-distance / range - part * part)
    };
    let [turn, deceleration] = ANGULAR_WIDTHS.map(fades);
    let aside = if angle >= 0.0 { -turn } else { turn };
    Point::default().plus(along, -deceleration).plus(left, aside)
}

/// Returns the acceleration by a wall, m/s².
/// `away` is the direction from its nearest point, `distance` that of a person's side, m.
pub(super) fn repulsion(away: Point, distance: f64) -> Point {
    let [strength, range] = WALL;
    Point::default().plus(away, strength * exp(-distance / range))
}

/// Limits a velocity to the greatest speed of a person.
/// Helbing and Molnár, 1995, equation 11.
pub(super) fn limited(velocity: Point, desired_speed: f64) -> Point {
    let (speed, most) = (velocity.norm(), GREATEST_SPEED * desired_speed);
    if speed > most { Point::default().plus(velocity, most / speed) } else { velocity }
}
