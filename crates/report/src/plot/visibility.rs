//! Visible area of range sensors.

use crate::{Cone, Robot, Scene};

/// Returns the corners of a sensor's visible area.
/// It is the cone up to the nearest fixed obstacles.
pub(super) fn visible(scene: &Scene, robot: &Robot, cone: &Cone) -> Vec<[f64; 2]> {
    /// Number of rays, about one for each degree, and limited for all directions.
    const RAYS_PER_RADIAN: f64 = 60.0;
    const MAX_RAYS: f64 = 400.0;
    let rays = libm::ceil(cone.opening.abs() * RAYS_PER_RADIAN);
    let rays = if rays < MAX_RAYS { rays } else { MAX_RAYS };
    let origin = robot.to_world([cone.x, cone.y]);
    let first = robot.theta + cone.direction - cone.opening / 2.0;
    let ends = (0..=rays as u32).map(|ray| {
        let angle = first + cone.opening * f64::from(ray) / rays;
        let direction = [libm::cos(angle), libm::sin(angle)];
        let range = free_distance(scene, origin, direction, cone.range);
        [origin[0] + range * direction[0], origin[1] + range * direction[1]]
    });
    [origin].into_iter().chain(ends).collect()
}

/// Returns the distance from `origin` to the first obstacle, at most `range`.
/// The direction has length 1.
fn free_distance(scene: &Scene, origin: [f64; 2], direction: [f64; 2], range: f64) -> f64 {
    let sides = scene.polygons.iter().flat_map(|polygon| {
        let next = polygon.points.iter().cycle().skip(1);
        polygon.points.iter().zip(next).filter_map(|(a, b)| distance_to_side(origin, direction, *a, *b))
    });
    let circles = scene.circles.iter().filter_map(|circle| {
        let center = minus(circle.center, origin);
        let (along, across) = (dot(center, direction), cross(direction, center));
        let half = circle.radius * circle.radius - across * across;
        (half >= 0.0).then(|| along - half.sqrt())
    });
    sides
        .chain(circles)
        .filter(|way| *way >= 0.0)
        .fold(range, |least, way| if way < least { way } else { least })
}

fn distance_to_side(origin: [f64; 2], direction: [f64; 2], a: [f64; 2], b: [f64; 2]) -> Option<f64> {
    let (side, to_a) = (minus(b, a), minus(a, origin));
    let determinant = cross(direction, side);
    let share = cross(to_a, direction) / determinant;
    (determinant != 0.0 && (0.0..=1.0).contains(&share)).then(|| cross(to_a, side) / determinant)
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
