//! Rasterizer of flat surfaces in perspective with an inverse depth buffer.
//! Colors are computed only where surfaces are visible.
//!
//! Inverse depth and texture coordinates by depth are linear over the image, so that each pixel is exact, however the camera is
//! turned.

use std::sync::Arc;

use slate_module::math::{max, min};

use crate::render::texture::{Color, Texture};
use crate::viewpoint::{CameraPose, Vector, dot, plus};

/// Near clipping distance, m.
const NEAR_CLIP: f64 = 0.02;
/// Far clipping distance, m.
pub(crate) const FAR_CLIP: f64 = 60.0;
/// Distance from which objects fade into the background, m.
const CLEAR: f32 = 15.0;
/// Index of a pixel without a surface.
const NOTHING: u16 = u16::MAX;
/// Radiance of the background at the horizon, and straight up.
const HORIZON: Color = [0.42, 0.46, 0.50];
const ZENITH: Color = [0.30, 0.36, 0.45];

/// Linear function over the image: per column, per row, and at the corner.
type Slope = [f32; 3];

#[inline]
fn at(slope: &Slope, x: f32, y: f32) -> f32 {
    slope[0] * x + slope[1] * y + slope[2]
}

/// Texture mapping of a plane: origin, and texture axes per meter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub origin: Vector,
    pub u: Vector,
    pub v: Vector,
    /// Texture coordinates at the origin.
    pub start: [f64; 2],
}

/// Appearance of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Finish {
    pub texture: u16,
    /// Factor on the texture's color.
    pub tint: Color,
    /// Shading towards v = 0, as of a wall near the floor.
    pub has_foot: bool,
    /// Emission of light.
    pub glows: bool,
}

#[derive(Clone, Copy, Debug)]
struct Surface {
    inverse_depth: Slope,
    /// Texture coordinates divided by depth, and the offsets of their products with it.
    coordinates: [(Slope, f32); 2],
    finish: Finish,
}

/// Undistorted picture of a camera.
#[derive(Clone, Debug)]
pub(crate) struct Raster {
    width: usize,
    height: usize,
    focal_length: [f64; 2],
    center: [f64; 2],
    inverse_depths: Vec<f32>,
    seen: Vec<u16>,
    light: Vec<Color>,
    surfaces: Vec<Surface>,
    /// Corners in the camera's frame, before and after clipping.
    corners: [Vec<Vector>; 2],
    /// Leftmost and rightmost position in each row.
    spans: Vec<(f64, f64)>,
}

impl Raster {
    /// Creates a black picture.
    pub fn new([width, height]: [usize; 2], focal_length: [f64; 2], center: [f64; 2]) -> Self {
        let pixels = width * height;
        Self {
            width,
            height,
            focal_length,
            center,
            inverse_depths: vec![0.0; pixels],
            seen: vec![NOTHING; pixels],
            light: vec![[0.0; 3]; pixels],
            surfaces: Vec::new(),
            corners: Default::default(),
            spans: vec![(0.0, 0.0); height],
        }
    }

    /// Returns the numbers of columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Returns the principal point, pixels.
    pub fn center(&self) -> [f32; 2] {
        self.center.map(|center| center as f32)
    }

    /// Returns the radiance of each pixel, row by row from the top.
    pub fn light(&self) -> &[Color] {
        &self.light
    }

    /// Returns the inverse depth of each pixel along the optical axis, 1/m.
    /// It is 0 where nothing is.
    pub fn inverse_depths(&self) -> &[f32] {
        &self.inverse_depths
    }

    /// Clears the picture.
    pub fn begin(&mut self) {
        self.inverse_depths.fill((1.0 / FAR_CLIP) as f32);
        self.seen.fill(NOTHING);
        self.surfaces.clear();
    }

    /// Draws an unbounded plane where it is nearest.
    pub fn draw_plane(&mut self, pose: &CameraPose, plane: &Plane, finish: Finish) {
        let Some((number, surface)) = self.add(pose, plane, finish) else { return };
        let rows =
            self.inverse_depths.chunks_exact_mut(self.width).zip(self.seen.chunks_exact_mut(self.width));
        for (row, (depths, seen)) in rows.enumerate() {
            draw_run(&surface.inverse_depth, 0, row, number, depths, seen);
        }
    }

    /// Draws a convex polygon of a plane where it is nearest.
    pub fn draw(&mut self, pose: &CameraPose, corners: &[Vector], plane: &Plane, finish: Finish) {
        let Some(rows) = self.outline(pose, corners) else { return };
        let Some((number, surface)) = self.add(pose, plane, finish) else { return };
        for row in rows {
            let Some((left, right)) = self.columns(row) else { continue };
            let run = row * self.width + left..row * self.width + right;
            let (depths, seen) = (&mut self.inverse_depths[run.clone()], &mut self.seen[run]);
            draw_run(&surface.inverse_depth, left, row, number, depths, seen);
        }
    }

    /// Computes the radiance of each pixel from its visible surface.
    pub fn shade(&mut self, pose: &CameraPose, textures: &[Arc<Texture>]) {
        for row in 0..self.height {
            let (first, last) = (row * self.width, (row + 1) * self.width);
            let background = self.background(pose, row);
            let mut start = first;
            while start < last {
                let number = self.seen[start];
                let same = self.seen[start..last].iter().take_while(|other| **other == number).count();
                let run = start..start + same;
                let light = &mut self.light[run.clone()];
                match self.surfaces.get(usize::from(number)) {
                    None => light.fill(background),
                    Some(surface) => {
                        let texture = &textures[usize::from(surface.finish.texture)];
                        let depths = &self.inverse_depths[run];
                        for (offset, (light, depth)) in light.iter_mut().zip(depths).enumerate() {
                            let (x, y) = ((start - first + offset) as f32, row as f32);
                            *light = surface.radiance(x, y, *depth, texture, background).0;
                        }
                    }
                }
                start += same;
            }
        }
    }

    /// Blends a polygon with opacity over the picture where it is nearer.
    pub fn overlay(
        &mut self,
        pose: &CameraPose,
        corners: &[Vector],
        plane: &Plane,
        finish: Finish,
        textures: &[Arc<Texture>],
    ) {
        let Some(rows) = self.outline(pose, corners) else { return };
        let Some((_, surface)) = self.add(pose, plane, finish) else { return };
        let texture = &textures[usize::from(finish.texture)];
        for row in rows {
            let Some((left, right)) = self.columns(row) else { continue };
            let background = self.background(pose, row);
            for column in left..right {
                let pixel = row * self.width + column;
                let (x, y) = (column as f32, row as f32);
                let depth = at(&surface.inverse_depth, x, y);
                if depth <= self.inverse_depths[pixel] {
                    continue;
                }
                let (color, alpha) = surface.radiance(x, y, depth, texture, background);
                let light = &mut self.light[pixel];
                *light = mixed(*light, color, alpha);
                if alpha > 0.5 {
                    self.inverse_depths[pixel] = depth;
                }
            }
        }
    }

    /// Returns the radiance of a row where no surface is.
    fn background(&self, pose: &CameraPose, row: usize) -> Color {
        let down = (row as f64 - self.center[1]) / self.focal_length[1];
        let up = pose.axes[2][2] + pose.axes[1][2] * down;
        mixed(HORIZON, ZENITH, up.clamp(0.0, 1.0) as f32)
    }

    /// Adds a surface of a plane; `None` for a plane through the camera.
    fn add(&mut self, pose: &CameraPose, plane: &Plane, finish: Finish) -> Option<(u16, Surface)> {
        let number = u16::try_from(self.surfaces.len()).ok().filter(|number| *number != NOTHING)?;
        let (origin, u, v) = (pose.local(plane.origin), pose.turn(plane.u), pose.turn(plane.v));
        let normal = cross(u, v);
        let distance = dot(normal, origin);
        // A plane that is seen edge-on covers nothing.
        if distance.is_nan() || distance.abs() <= 1e-9 {
            return None;
        }
        let by = 1.0 / distance;
        let coordinate = |axis: Vector, start: f64| {
            let offset = dot(origin, axis) - start;
            // Textures repeat, and small numbers have more digits.
            (self.slope(axis), (offset - offset.floor()) as f32, offset)
        };
        let (slope_u, offset_u, _) = coordinate(u, plane.start[0]);
        let (slope_v, short_v, whole_v) = coordinate(v, plane.start[1]);
        let offset_v = if finish.has_foot { whole_v as f32 } else { short_v };
        let surface = Surface {
            inverse_depth: self.slope([normal[0] * by, normal[1] * by, normal[2] * by]),
            coordinates: [(slope_u, offset_u), (slope_v, offset_v)],
            finish,
        };
        self.surfaces.push(surface);
        Some((number, surface))
    }

    /// Returns the scalar product of a vector with the ray of each pixel.
    fn slope(&self, [x, y, z]: Vector) -> Slope {
        let ([fx, fy], [cx, cy]) = (self.focal_length, self.center);
        [(x / fx) as f32, (y / fy) as f32, (z - x * cx / fx - y * cy / fy) as f32]
    }

    /// Computes the span of a convex polygon in each row; returns the rows.
    fn outline(&mut self, pose: &CameraPose, corners: &[Vector]) -> Option<std::ops::Range<usize>> {
        let [all, cut] = &mut self.corners;
        all.clear();
        all.extend(corners.iter().map(|corner| pose.local(*corner)));
        cut_near(all, cut);
        let ([fx, fy], [cx, cy]) = (self.focal_length, self.center);
        for corner in cut.iter_mut() {
            *corner = [corner[0] / corner[2] * fx + cx, corner[1] / corner[2] * fy + cy, corner[2]];
        }
        let (mut top, mut bottom) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in cut.iter() {
            (top, bottom) = (min(top, corner[1]), max(bottom, corner[1]));
        }
        let row = |y: f64| max(min(y.ceil(), self.height as f64), 0.0) as usize;
        let rows = row(top)..row(bottom);
        if cut.len() < 3 || rows.is_empty() {
            return None;
        }
        self.spans[rows.clone()].fill((f64::INFINITY, f64::NEG_INFINITY));
        for (number, from) in cut.iter().enumerate() {
            let to = cut[if number + 1 == cut.len() { 0 } else { number + 1 }];
            let (high, low) = if from[1] < to[1] { (*from, to) } else { (to, *from) };
            let slope = (low[0] - high[0]) / (low[1] - high[1]);
            let of_edge = row(high[1])..row(low[1]);
            for (index, span) in of_edge.clone().zip(&mut self.spans[of_edge]) {
                let x = high[0] + (index as f64 - high[1]) * slope;
                *span = (min(span.0, x), max(span.1, x));
            }
        }
        Some(rows)
    }

    /// Returns the columns of a row inside the outline.
    fn columns(&self, row: usize) -> Option<(usize, usize)> {
        let (left, right) = self.spans[row];
        let column = |x: f64| max(min(x.ceil(), self.width as f64), 0.0) as usize;
        let (left, right) = (column(left), column(right));
        (left < right).then_some((left, right))
    }
}

impl Surface {
    /// Returns the radiance and opacity at a pixel.
    #[inline]
    fn radiance(&self, x: f32, y: f32, inverse_depth: f32, texture: &Texture, haze: Color) -> (Color, f32) {
        let depth = 1.0 / inverse_depth;
        let [(slope_u, offset_u), (slope_v, offset_v)] = &self.coordinates;
        let (by_u, by_v) = (at(slope_u, x, y) * depth, at(slope_v, x, y) * depth);
        let (u, v) = (by_u - offset_u, by_v - offset_v);
        // How far the coordinates go in a pixel to the right, and down.
        let step = |axis: usize| {
            let along_u = slope_u[axis] - by_u * self.inverse_depth[axis];
            let along_v = slope_v[axis] - by_v * self.inverse_depth[axis];
            (along_u.abs() + along_v.abs()) * depth
        };
        let (right, down) = (step(0), step(1));
        let (short, long) = if right < down { (right, down) } else { (down, right) };
        let cover = if short * 4.0 > long { (short * long).sqrt() } else { long * 0.5 };
        let (color, alpha) = texture.sample(u, v, cover);
        let finish = &self.finish;
        let mut factor = 1.0;
        if !finish.glows {
            let square = inverse_depth * inverse_depth;
            factor = 0.62 + 0.38 * square / (square + 0.02);
            if finish.has_foot {
                factor *= 0.72 + 0.28 * (v * 5.0).clamp(0.0, 1.0);
            }
        }
        let [red, green, blue] = finish.tint;
        let lit = [color[0] * red * factor, color[1] * green * factor, color[2] * blue * factor];
        let fading = ((depth - CLEAR) * (1.0 / (FAR_CLIP as f32 - CLEAR))).clamp(0.0, 1.0);
        (mixed(lit, haze, fading), alpha)
    }
}

#[inline]
fn draw_run(slope: &Slope, left: usize, row: usize, number: u16, depths: &mut [f32], seen: &mut [u16]) {
    let first = slope[1] * row as f32 + slope[2];
    for (offset, (depth, seen)) in depths.iter_mut().zip(seen).enumerate() {
        let own = slope[0] * (left + offset) as f32 + first;
        let is_nearer = own > *depth;
        *depth = if is_nearer { own } else { *depth };
        *seen = if is_nearer { number } else { *seen };
    }
}

#[inline]
fn mixed(a: Color, b: Color, share: f32) -> Color {
    // Written out, as a loop over channels is not always compiled into its steps.
    [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, a[2] + (b[2] - a[2]) * share]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Clips the part at or behind the camera.
fn cut_near(corners: &[Vector], cut: &mut Vec<Vector>) {
    cut.clear();
    for (number, from) in corners.iter().enumerate() {
        let to = corners[if number + 1 == corners.len() { 0 } else { number + 1 }];
        if from[2] >= NEAR_CLIP {
            cut.push(*from);
        }
        if (from[2] >= NEAR_CLIP) != (to[2] >= NEAR_CLIP) {
            let share = (NEAR_CLIP - from[2]) / (to[2] - from[2]);
            cut.push(plus(*from, plus(to, *from, -1.0), share));
        }
    }
}
