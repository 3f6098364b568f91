//! Quadrilaterals of outlines, and their homographies.

use super::regions::RegionOutline;

/// Least part of a region's convex hull that its quadrilateral covers.
const LEAST_COVER: f64 = 0.9;
/// Part at each end of a side that its line fit omits.
/// Corners are round in images.
const ROUND: f64 = 0.12;

/// Returns the corners of an outline that is a quadrilateral, px.
/// They stand clockwise in the image, from any of them.
pub(super) fn quad_of(outline: &RegionOutline) -> Option<[[f64; 2]; 4]> {
    let hull = convex_hull(&outline.points);
    if hull.len() < 4 {
        return None;
    }
    let rough = rough_corners(&hull)?;
    let cover = area(&rough) / area(&hull);
    if cover < LEAST_COVER {
        return None;
    }
    let sides = [0, 1, 2, 3].map(|side| fitted(&outline.points, rough[side], rough[(side + 1) % 4]));
    let mut corners = rough;
    for (corner, place) in corners.iter_mut().enumerate() {
        let (before, after) = (sides[(corner + 3) % 4]?, sides[corner]?);
        let [x, y] = intersection(before, after)?;
        let [rough_x, rough_y] = *place;
        // A line through few points may lead far away.
        if (x - rough_x).abs() + (y - rough_y).abs() > 4.0 {
            return None;
        }
        *place = [x, y];
    }
    Some(corners)
}

/// Returns twice the signed area of a triangle.
/// It is positive for a clockwise one in an image, whose y points down.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Returns the area of a polygon that is clockwise in the image.
fn area(corners: &[[f64; 2]]) -> f64 {
    let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
    pairs.map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum::<f64>() / 2.0
}

/// Returns the convex hull of points, clockwise in the image.
/// Andrew, 1979, *Another efficient algorithm for convex hulls in two dimensions*.
fn convex_hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hull: Vec<[f64; 2]> = Vec::new();
    for half in 0..2 {
        let first = hull.len();
        let mut add = |point: &[f64; 2]| {
            while hull.len() >= first + 2 && cross(hull[hull.len() - 2], hull[hull.len() - 1], *point) <= 0.0
            {
                hull.pop();
            }
            hull.push(*point);
        };
        if half == 0 {
            sorted.iter().for_each(&mut add)
        } else {
            sorted.iter().rev().for_each(&mut add)
        }
        hull.pop();
    }
    hull
}

/// Returns four points of a hull as rough corners.
/// The two farthest from each other, and on each side of their diagonal the farthest one.
fn rough_corners(hull: &[[f64; 2]]) -> Option<[[f64; 2]; 4]> {
    let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
    let pairs = (0..hull.len()).flat_map(|a| (a + 1..hull.len()).map(move |b| (a, b)));
    let (first, third) = pairs
        .max_by(|(a, b), (c, d)| distance(hull[*a], hull[*b]).total_cmp(&distance(hull[*c], hull[*d])))?;
    let farthest = |range: &mut dyn Iterator<Item = usize>| {
        range.max_by(|a, b| {
            let height = |at: usize| cross(hull[first], hull[third], hull[at]).abs();
            height(*a).total_cmp(&height(*b))
        })
    };
    let second = farthest(&mut (first + 1..third))?;
    let fourth = farthest(&mut (third + 1..hull.len()).chain(0..first))?;
    Some([first, second, third, fourth].map(|at| hull[at]))
}

/// Line of points `p` with `normal · p = offset`; the normal has the length 1.
#[derive(Clone, Copy)]
struct Line {
    normal: [f64; 2],
    offset: f64,
}

/// Fits a line to the points near a side, by total least squares.
fn fitted(points: &[[f64; 2]], from: [f64; 2], to: [f64; 2]) -> Option<Line> {
    let along = [to[0] - from[0], to[1] - from[1]];
    let length = slate_module::math::hypot(along[0], along[1]);
    if length < 4.0 {
        return None;
    }
    let near = points.iter().filter(|point| {
        let offset = [point[0] - from[0], point[1] - from[1]];
        let share = (offset[0] * along[0] + offset[1] * along[1]) / (length * length);
        let distance = (offset[0] * along[1] - offset[1] * along[0]).abs() / length;
        share > ROUND && share < 1.0 - ROUND && distance < 1.5 + 0.02 * length
    });
    let (mut count, mut sum) = (0.0, [0.0; 2]);
    for point in near.clone() {
        count += 1.0;
        sum = [sum[0] + point[0], sum[1] + point[1]];
    }
    if count < 4.0 {
        return None;
    }
    let middle = [sum[0] / count, sum[1] / count];
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for point in near {
        let [x, y] = [point[0] - middle[0], point[1] - middle[1]];
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
    }
    // The direction of the largest spread.
    let angle = slate_module::math::atan2(2.0 * xy, xx - yy) / 2.0;
    let normal = [-slate_module::math::sin(angle), slate_module::math::cos(angle)];
    Some(Line { normal, offset: normal[0] * middle[0] + normal[1] * middle[1] })
}

fn intersection(a: Line, b: Line) -> Option<[f64; 2]> {
    let determinant = a.normal[0] * b.normal[1] - a.normal[1] * b.normal[0];
    if determinant.abs() < 0.1 {
        return None;
    }
    let x = (a.offset * b.normal[1] - b.offset * a.normal[1]) / determinant;
    let y = (a.normal[0] * b.offset - b.normal[0] * a.offset) / determinant;
    Some([x, y])
}

/// Projective map of the unit square to a quadrilateral.
pub(super) struct Homography {
    rows: [[f64; 3]; 3],
}

impl Homography {
    /// Returns the map of the unit square's corners; `None` if degenerate.
    /// The corners are (0, 0), (1, 0), (1, 1) and (0, 1).
    ///
    /// Heckbert, 1989, *Fundamentals of texture mapping and image warping*, section 2.2.3.
    pub fn of_unit_square([p0, p1, p2, p3]: [[f64; 2]; 4]) -> Option<Self> {
        let sum = [0, 1].map(|axis| p0[axis] - p1[axis] + p2[axis] - p3[axis]);
        let (u, v) = ([p1[0] - p2[0], p1[1] - p2[1]], [p3[0] - p2[0], p3[1] - p2[1]]);
        let determinant = u[0] * v[1] - v[0] * u[1];
        if determinant.abs() < 1e-9 {
            return None;
        }
        let g = (sum[0] * v[1] - v[0] * sum[1]) / determinant;
        let h = (u[0] * sum[1] - sum[0] * u[1]) / determinant;
        let row =
            |axis: usize| [p1[axis] - p0[axis] + g * p1[axis], p3[axis] - p0[axis] + h * p3[axis], p0[axis]];
        Some(Self { rows: [row(0), row(1), [g, h, 1.0]] })
    }

    /// Returns the image of a point of the unit square, px.
    pub fn map(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [a, b, w] = self.rows.map(|row| row[0] * x + row[1] * y + row[2]);
        [a / w, b / w]
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails panics")]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_homography_maps_the_unit_square_to_its_corners(
            jitter in prop::array::uniform8(-3.0..3.0_f64)
        ) {
            let corners = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]];
            let corners: [[f64; 2]; 4] =
                std::array::from_fn(|at| [corners[at][0] + jitter[2 * at], corners[at][1] + jitter[2 * at + 1]]);
            let homography = Homography::of_unit_square(corners).unwrap();
            for (from, to) in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].into_iter().zip(corners) {
                let [x, y] = homography.map(from);
                prop_assert!((x - to[0]).abs() + (y - to[1]).abs() < 1e-9, "{x} {y} {to:?}");
            }
        }
    }
}
