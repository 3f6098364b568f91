//! Test pattern, for modules without a camera.

use std::f64::consts::TAU;

use slate_interfaces::{Image, ImageFormat};
use slate_module::math;

/// Period of the disc's motion, seconds.
const DISC_PERIOD: f64 = 4.0;

/// Returns the center and radius of the disc, pixels.
pub(crate) fn disc(width: u32, height: u32, seconds: f64) -> (f64, f64, f64) {
    let (width, height) = (f64::from(width), f64::from(height));
    let side = if width < height { width } else { height };
    let angle = TAU * (seconds / DISC_PERIOD);
    let x = (width - 1.0) / 2.0 + 0.3 * side * math::cos(angle);
    let y = (height - 1.0) / 2.0 + 0.3 * side * math::sin(angle);
    (x, y, 0.1 * side)
}

/// Draws the pattern at a time: a bright disc on a gradient.
pub(crate) fn draw(image: &mut Image, width: u32, height: u32, seconds: f64) {
    let (x, y, radius) = disc(width, height, seconds);
    image.width = width;
    image.height = height;
    image.step = width;
    image.format = ImageFormat::MONO8;
    for (row, pixels) in image.data.chunks_exact_mut(width as usize).enumerate() {
        let dy = row as f64 - y;
        for (column, pixel) in pixels.iter_mut().enumerate() {
            let dx = column as f64 - x;
            let inside = dx * dx + dy * dy <= radius * radius;
            *pixel = if inside { 255 } else { (100 * column / width as usize) as u8 };
        }
    }
}
