//! Shortest path of a disc among convex bodies.
//! It is the reference for the path length of a run.

use slate_module::math::{cos, sin};

use crate::geometry::{Point, Polygon, nearest_on};

/// Points per full turn of the rounded corners of inflated bodies.
const ROUNDING: usize = 24;

/// Returns the length of the shortest path of a disc, m; `None` without one.
///
/// The bodies grow by the radius, with rounded corners. The path follows the visibility graph of the corners, searched
/// with Dijkstra's algorithm.
pub fn shortest_path(bodies: &[Polygon], from: Point, to: Point, radius: f64) -> Option<f64> {
    let mut nodes = vec![from, to];
    for body in bodies {
        // Points on a circle around each corner that lie outside the body's other parts; a hair farther than the
        // radius, so that the way between neighbors stays free.
        let reach = radius / cos(std::f64::consts::PI / ROUNDING as f64) + 1e-6;
        for corner in &body.points {
            for k in 0..ROUNDING {
                let angle = k as f64 * 2.0 * std::f64::consts::PI / ROUNDING as f64;
                let node = corner.plus(Point::new(cos(angle), sin(angle)), reach);
                if bodies.iter().all(|other| distance(other, node) >= radius) {
                    nodes.push(node);
                }
            }
        }
    }
    let free = |a: Point, b: Point| bodies.iter().all(|body| segment_distance(body, a, b) >= radius - 1e-6);
    let mut best = vec![f64::INFINITY; nodes.len()];
    let mut done = vec![false; nodes.len()];
    best[0] = 0.0;
    loop {
        let next = (0..nodes.len())
            .filter(|i| !done[*i] && best[*i].is_finite())
            .min_by(|a, b| best[*a].total_cmp(&best[*b]))?;
        if next == 1 {
            return Some(best[1]);
        }
        done[next] = true;
        for i in 0..nodes.len() {
            let length = nodes[i].minus(nodes[next]).norm();
            if !done[i] && best[next] + length < best[i] && free(nodes[next], nodes[i]) {
                best[i] = best[next] + length;
            }
        }
    }
}

fn distance(body: &Polygon, point: Point) -> f64 {
    if body.contains(point) {
        return 0.0;
    }
    body.edges()
        .map(|(a, b)| nearest_on(a, b, point).minus(point).norm())
        .fold(f64::INFINITY, slate_module::math::min)
}

fn segment_distance(body: &Polygon, a: Point, b: Point) -> f64 {
    let crosses = |c: Point, d: Point| {
        let (along, other) = (b.minus(a), d.minus(c));
        along.cross(c.minus(a)) * along.cross(d.minus(a)) < 0.0
            && other.cross(a.minus(c)) * other.cross(b.minus(c)) < 0.0
    };
    if body.contains(a) || body.contains(b) || body.edges().any(|(c, d)| crosses(c, d)) {
        return 0.0;
    }
    let corners = body.points.iter().map(|corner| nearest_on(a, b, *corner).minus(*corner).norm());
    let ends = [a, b].into_iter().map(|end| distance(body, end));
    corners.chain(ends).fold(f64::INFINITY, slate_module::math::min)
}
