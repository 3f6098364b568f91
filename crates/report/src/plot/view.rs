//! Shown part of the world, and its obstacles.

use super::{
    Extent,
    canvas::{Canvas, FAINT, Mark, PIXEL, Pixel, TITLE_HEIGHT, stroke, text_width},
    drawable, widened,
};
use crate::{Error, Scene};
use plotters::{prelude::*, style::text_anchor::HPos};

/// The longer side of the world.
const WORLD_SIDE: i32 = 1000 * PIXEL;
const OBSTACLE: RGBColor = RGBColor(205, 205, 205);

/// Shown area of the world, at one scale for both axes.
/// Its edges in meters, and its size on the canvas.
pub(super) struct View {
    pub x: (f64, f64),
    pub y: (f64, f64),
    pub size: (i32, i32),
    /// Space on its left.
    left: i32,
}

impl View {
    /// Creates a view that contains the whole scene and these points.
    pub fn of(scene: &Scene, points: impl Iterator<Item = [f64; 2]>, left: i32) -> View {
        let (mut x, mut y) = (Extent::default(), Extent::default());
        for [point_x, point_y] in outline(scene).chain(points) {
            x.include(point_x);
            y.include(point_y);
        }
        let (x, y) = (x.padded(0.03, 0.1), y.padded(0.03, 0.1));
        let (width, height) = (x.1 - x.0, y.1 - y.0);
        let longer = if width > height { width } else { height };
        // A corridor still gets a plot that is high enough to read.
        let (x, y) = (widened(x, longer * 0.4), widened(y, longer * 0.4));
        let pixels = |(low, high): (f64, f64)| ((high - low) / longer * f64::from(WORLD_SIDE)).round() as i32;
        View { x, y, size: (pixels(x), pixels(y)), left }
    }

    /// Returns the position of a point on the canvas; `None` if it is too far out.
    pub fn pixel(&self, x: f64, y: f64) -> Option<Pixel> {
        const MAX_COORDINATE: f64 = 1e8;
        let share = |value: f64, (low, high): (f64, f64)| (value - low) / (high - low);
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        let (right, up) = ((share(x, self.x) * width).round(), (share(y, self.y) * height).round());
        (right.abs() < MAX_COORDINATE && up.abs() < MAX_COORDINATE)
            .then(|| (self.left + right as i32, TITLE_HEIGHT + self.size.1 - up as i32))
    }

    /// Returns a length in meters as a length on the canvas.
    pub fn pixels(&self, meters: f64) -> i32 {
        (meters / (self.x.1 - self.x.0) * f64::from(self.size.0)).round() as i32
    }
}

/// Points that together span all of the scene.
fn outline(scene: &Scene) -> impl Iterator<Item = [f64; 2]> {
    let corners = [scene.bounds.minimum, scene.bounds.maximum];
    let polygons = scene.polygons.iter().flat_map(|polygon| polygon.points.iter().copied());
    let circles = scene.circles.iter().flat_map(edges);
    let goals = scene.goals.iter().map(|goal| [goal.x, goal.y]);
    corners.into_iter().chain(polygons).chain(circles).chain(goals)
}

/// Returns opposite corners of the square around a circle.
fn edges(circle: &crate::Circle) -> [[f64; 2]; 2] {
    let ([x, y], radius) = (circle.center, circle.radius);
    [[x - radius, y - radius], [x + radius, y + radius]]
}

/// Goals of robots.
pub(super) fn goals(canvas: &Canvas, view: &View, scene: &Scene) -> Result<(), Error> {
    for goal in &scene.goals {
        if let Some(at) = view.pixel(goal.x, goal.y) {
            canvas.mark(Mark::Goal, at)?;
            canvas.label(&goal.label, (at.0 + 6 * PIXEL, at.1 + 30 * PIXEL))?;
        }
    }
    Ok(())
}

/// Walls, boxes and other fixed obstacles.
pub(super) fn obstacles(canvas: &Canvas, view: &View, scene: &Scene) -> Result<(), Error> {
    for polygon in &scene.polygons {
        let corners: Option<Vec<Pixel>> = polygon.points.iter().map(|[x, y]| view.pixel(*x, *y)).collect();
        let Some(mut corners) = corners.filter(|corners| corners.len() > 1) else { continue };
        canvas.polygon(&corners, OBSTACLE)?;
        let across = |part: fn(&Pixel) -> i32| {
            let (low, high) = (corners.iter().map(part).min(), corners.iter().map(part).max());
            (low.unwrap_or(0), high.unwrap_or(0))
        };
        name(canvas, &polygon.name, across(|pixel| pixel.0), across(|pixel| pixel.1))?;
        corners.push(corners[0]);
        canvas.line(&corners, FAINT, 2)?;
    }
    for circle in &scene.circles {
        if let Some((x, y)) = view.pixel(circle.center[0], circle.center[1])
            && edges(circle).into_iter().flatten().all(drawable)
            && circle.radius > 0.0
        {
            let radius = view.pixels(circle.radius);
            canvas.circle((x, y), radius, OBSTACLE.filled())?;
            canvas.circle((x, y), radius, stroke(FAINT, 2))?;
            name(canvas, &circle.name, (x - radius, x + radius), (y - radius, y + radius))?;
        }
    }
    Ok(())
}

/// Draws the name of an obstacle, if it fits.
fn name(
    canvas: &Canvas,
    name: &str,
    (left, right): (i32, i32),
    (top, bottom): (i32, i32),
) -> Result<(), Error> {
    const SIZE: i32 = 20;
    if text_width(name, SIZE) > right - left || SIZE * PIXEL > bottom - top {
        return Ok(());
    }
    canvas.text(name, ((left + right) / 2, (top + bottom) / 2), SIZE, FAINT, HPos::Center)
}
