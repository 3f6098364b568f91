//! Points, poses and convex polygons in the plane.

use serde::{Deserialize, Serialize};
use slate_module::math::{clamp, cos, max, min, sin};

/// Point or vector, m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Coordinate to the front or east.
    pub x: f64,
    /// Coordinate to the left or north.
    pub y: f64,
}

impl Point {
    /// Creates a point.
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Returns the inner product.
    pub fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    /// Returns the cross product: positive if `other` is to the left.
    pub fn cross(self, other: Self) -> f64 {
        self.x * other.y - self.y * other.x
    }

    /// Returns the Euclidean norm.
    pub fn norm(self) -> f64 {
        self.dot(self).sqrt()
    }

    /// Returns this vector plus `other` times `factor`.
    pub fn plus(self, other: Self, factor: f64) -> Self {
        Self::new(self.x + other.x * factor, self.y + other.y * factor)
    }

    /// Returns the vector from `other` to this point.
    pub fn minus(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }
}

/// Position and heading, m and rad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Coordinate to the east.
    pub x: f64,
    /// Coordinate to the north.
    pub y: f64,
    /// Heading, counter-clockwise from x.
    pub theta: f64,
}

impl Pose {
    /// Returns the position.
    pub fn point(&self) -> Point {
        Point::new(self.x, self.y)
    }

    /// Returns the pose as a frame.
    /// Cosine and sine are computed once for many points.
    pub fn frame(&self) -> Frame {
        Frame { origin: self.point(), cos: cos(self.theta), sin: sin(self.theta) }
    }
}

/// Coordinate frame: a pose with precomputed cosine and sine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Origin of the frame in the world.
    pub origin: Point,
    /// Cosine of the heading.
    pub cos: f64,
    /// Sine of the heading.
    pub sin: f64,
}

impl Frame {
    /// Transforms a point of the frame to the world.
    pub fn apply(&self, p: Point) -> Point {
        self.rotate(p).plus(self.origin, 1.0)
    }

    /// Rotates a direction of the frame to the world.
    pub fn rotate(&self, p: Point) -> Point {
        Point::new(p.x * self.cos - p.y * self.sin, p.x * self.sin + p.y * self.cos)
    }

    /// Transforms a point of the world to the frame.
    pub fn local(&self, p: Point) -> Point {
        self.turn_back(p.minus(self.origin))
    }

    /// Rotates a direction of the world to the frame.
    pub fn turn_back(&self, p: Point) -> Point {
        Point::new(p.x * self.cos + p.y * self.sin, p.y * self.cos - p.x * self.sin)
    }
}

/// Convex polygon, counter-clockwise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Polygon {
    /// Corners.
    pub points: Vec<Point>,
}

impl Polygon {
    /// Creates a rectangle along the axes.
    pub fn rectangle(center: Point, width: f64, height: f64) -> Self {
        let corner = |sx: f64, sy: f64| Point::new(center.x + sx * width / 2.0, center.y + sy * height / 2.0);
        Self { points: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)] }
    }

    /// Creates a disc around the origin: a polygon of 16 edges that touch it.
    pub fn disc(radius: f64) -> Self {
        let radius = radius / cos(std::f64::consts::PI / 16.0);
        let corner = |k: u32| {
            let angle = f64::from(k) * (std::f64::consts::PI / 8.0);
            Point::new(radius * cos(angle), radius * sin(angle))
        };
        Self { points: (0..16).map(corner).collect() }
    }

    /// Returns the nearest point of the outline.
    pub fn nearest(&self, point: Point) -> Point {
        let mut best = (f64::INFINITY, point);
        for (a, b) in self.edges() {
            let foot = nearest_on(a, b, point);
            let distance = foot.minus(point).norm();
            if distance < best.0 {
                best = (distance, foot);
            }
        }
        best.1
    }

    /// Returns whether the polygon has at least three corners and turns left at each.
    pub fn is_convex(&self) -> bool {
        let n = self.points.len();
        n >= 3
            && (0..n).all(|i| {
                let (a, b, c) = (self.points[i], self.points[(i + 1) % n], self.points[(i + 2) % n]);
                b.minus(a).cross(c.minus(b)) > 0.0
            })
    }

    /// Returns the edges, from corner to corner.
    pub fn edges(&self) -> impl Iterator<Item = (Point, Point)> + '_ {
        let n = self.points.len();
        (0..n).map(move |i| (self.points[i], self.points[if i + 1 == n { 0 } else { i + 1 }]))
    }

    /// Transforms the polygon by a pose, into existing memory.
    pub fn place(&self, frame: &Frame, into: &mut Polygon) {
        into.points.clear();
        into.points.extend(self.points.iter().map(|point| frame.apply(*point)));
    }

    /// Returns whether a point is inside or on the edge.
    pub fn contains(&self, point: Point) -> bool {
        self.edges().all(|(a, b)| b.minus(a).cross(point.minus(a)) >= 0.0)
    }

    /// Returns the shortest connection of two polygons; distance 0 if they overlap.
    pub fn gap(&self, other: &Self) -> Gap {
        let mut best = Gap { distance: f64::INFINITY, from: Point::default(), to: Point::default() };
        for (own, theirs, swapped) in [(self, other, false), (other, self, true)] {
            for &corner in &own.points {
                for (a, b) in theirs.edges() {
                    let foot = nearest_on(a, b, corner);
                    let distance = foot.minus(corner).norm();
                    if distance < best.distance {
                        let (from, to) = if swapped { (foot, corner) } else { (corner, foot) };
                        best = Gap { distance, from, to };
                    }
                }
                if theirs.contains(corner) {
                    best.distance = 0.0;
                    return best;
                }
            }
        }
        best
    }

    /// Returns the axis-aligned bounding box.
    pub fn extent(&self) -> Extent {
        let infinite = Point::new(f64::INFINITY, f64::INFINITY);
        let empty = Extent { minimum: infinite, maximum: Point::default().minus(infinite) };
        self.points.iter().fold(empty, |extent, point| Extent {
            minimum: Point::new(min(extent.minimum.x, point.x), min(extent.minimum.y, point.y)),
            maximum: Point::new(max(extent.maximum.x, point.x), max(extent.maximum.y, point.y)),
        })
    }

    /// Returns the radius of the bounding circle around the frame's origin.
    pub fn radius(&self) -> f64 {
        self.points.iter().map(|point| point.norm()).fold(0.0, max)
    }
}

/// Axis-aligned rectangle, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extent {
    /// South-west corner.
    pub minimum: Point,
    /// North-east corner.
    pub maximum: Point,
}

impl Extent {
    /// Creates a square around a point, `reach` meters to each side.
    pub fn around(center: Point, reach: f64) -> Self {
        let reach = Point::new(reach, reach);
        Self { minimum: center.minus(reach), maximum: center.plus(reach, 1.0) }
    }

    /// Returns the bounding box of both.
    pub fn with(&self, other: &Self) -> Self {
        let least = |a: Point, b: Point| Point::new(min(a.x, b.x), min(a.y, b.y));
        let greatest = |a: Point, b: Point| Point::new(max(a.x, b.x), max(a.y, b.y));
        Self { minimum: least(self.minimum, other.minimum), maximum: greatest(self.maximum, other.maximum) }
    }

    /// Returns the distance of a point, meters; 0 inside.
    pub fn distance(&self, point: Point) -> f64 {
        let beyond = |low: f64, value: f64, high: f64| max(max(low - value, value - high), 0.0);
        let x = beyond(self.minimum.x, point.x, self.maximum.x);
        let y = beyond(self.minimum.y, point.y, self.maximum.y);
        Point::new(x, y).norm()
    }
}

/// Shortest connection from one polygon to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Length, m; 0 if they overlap.
    pub distance: f64,
    /// Start, on the first.
    pub from: Point,
    /// End, on the second.
    pub to: Point,
}

/// Returns the point of a segment nearest to `point`.
pub fn nearest_on(a: Point, b: Point, point: Point) -> Point {
    let along = b.minus(a);
    let length = along.dot(along);
    if length == 0.0 {
        return a;
    }
    a.plus(along, clamp(point.minus(a).dot(along) / length, 0.0, 1.0))
}
