//! Detector of AprilTags of the family 16h5.
//!
//! Own code: the reference library is C, and crates in Rust bring a hundred others, with threads and an order of results
//! that changes.

mod quad;
mod regions;

use slate_interfaces::TAG16H5;

use quad::{Homography, quad_of};
use regions::DarkRegions;

/// Cells of a side with the frame.
const CELLS: usize = 6;
/// Least contrast between black and white cells, levels of 255.
const LEAST_CONTRAST: f64 = 30.0;
/// Part of the contrast by which each cell differs from the threshold.
const LEAST_MARGIN: f64 = 0.15;

/// Detected AprilTag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AprilTag {
    /// Number within the family, 0 to 29.
    pub number: u32,
    /// Corners of the black frame from its top left, clockwise as printed, px.
    pub corners: [[f64; 2]; 4],
    /// Confidence, 0 to 1.
    /// The least distance of a cell from the threshold, as a part of the largest possible.
    pub confidence: f64,
}

/// Detector of AprilTags in images of brightness.
///
/// Dark regions whose outline is a quadrilateral are rectified by their homography, and their cells compared with the
/// codes (Olson, 2011, *AprilTag*, sections III and IV; regions by a local threshold as in Wang and Olson, 2016,
/// *AprilTag 2*, section III A). Only codes without a wrong bit count, since one in 500 arrangements of cells is a code.
#[derive(Clone, Debug, Default)]
pub struct AprilTagDetector {
    regions: DarkRegions,
    found: Vec<AprilTag>,
}

impl AprilTagDetector {
    /// Returns the tags of an image, from the top left.
    /// `pixels` has its rows one after the other.
    pub fn detect(&mut self, width: usize, height: usize, pixels: &[u8]) -> &[AprilTag] {
        self.found.clear();
        if width == 0 || pixels.len() < width * height {
            return &self.found;
        }
        let image = BrightnessImage { width, height, pixels };
        self.regions.find(&image);
        for outline in self.regions.outlines() {
            if let Some(tag) = quad_of(outline).and_then(|corners| decode(&image, corners)) {
                self.found.push(tag);
            }
        }
        &self.found
    }
}

/// Brightness of an image, row by row.
pub(super) struct BrightnessImage<'a> {
    pub width: usize,
    pub height: usize,
    pub pixels: &'a [u8],
}

impl BrightnessImage<'_> {
    /// Returns the brightness at a point by bilinear interpolation; `None` outside.
    fn at(&self, [x, y]: [f64; 2]) -> Option<f64> {
        // Pixel 0 has its middle at 0.5.
        let (x, y) = (x - 0.5, y - 0.5);
        if !(x >= 0.0 && y >= 0.0 && x < (self.width - 1) as f64 && y < (self.height - 1) as f64) {
            return None;
        }
        let (column, row) = (x as usize, y as usize);
        let (right, down) = (x - column as f64, y - row as f64);
        let pixel = |column: usize, row: usize| f64::from(self.pixels[row * self.width + column]);
        let upper = pixel(column, row) * (1.0 - right) + pixel(column + 1, row) * right;
        let lower = pixel(column, row + 1) * (1.0 - right) + pixel(column + 1, row + 1) * right;
        Some(upper * (1.0 - down) + lower * down)
    }
}

/// Decodes a quadrilateral, whose corners stand clockwise in the image.
fn decode(image: &BrightnessImage<'_>, corners: [[f64; 2]; 4]) -> Option<AprilTag> {
    let homography = Homography::of_unit_square(corners)?;
    let cells = sample(image, &homography)?;
    let is_frame = |row: usize, column: usize| row == 0 || row == 5 || column == 0 || column == 5;
    let all = || (0..CELLS).flat_map(|row| (0..CELLS).map(move |column| (row, column)));
    let frame = all().filter(|(row, column)| is_frame(*row, *column));
    let black = frame.map(|(row, column)| cells[row][column]).sum::<f64>() / 20.0;
    let white = surroundings(image, &homography)?;
    if white - black < LEAST_CONTRAST {
        return None;
    }
    let threshold = (white + black) / 2.0;
    let mut code = 0_u16;
    let mut confidence = 1.0_f64;
    for (row, column) in all() {
        let margin = (cells[row][column] - threshold) / (white - threshold);
        if is_frame(row, column) && margin > -LEAST_MARGIN || margin.abs() < LEAST_MARGIN {
            return None;
        }
        if margin.abs() < confidence {
            confidence = margin.abs();
        }
        if !is_frame(row, column) {
            code = code << 1 | u16::from(margin > 0.0);
        }
    }
    let (number, turns) = number_of(code)?;
    let mut corners = corners;
    corners.rotate_left(turns);
    Some(AprilTag { number, corners, confidence })
}

/// Returns the brightness of each cell with the frame's.
/// `None` beyond the edge of the image.
fn sample(image: &BrightnessImage<'_>, homography: &Homography) -> Option<[[f64; CELLS]; CELLS]> {
    let mut cells = [[0.0; CELLS]; CELLS];
    for (row, line) in cells.iter_mut().enumerate() {
        for (column, cell) in line.iter_mut().enumerate() {
            // The middle of a cell, where neither blur nor a wrong corner brings much of its neighbors.
            for (x, y) in [(0.35, 0.35), (0.65, 0.35), (0.5, 0.5), (0.35, 0.65), (0.65, 0.65)] {
                let point = [(column as f64 + x) / CELLS as f64, (row as f64 + y) / CELLS as f64];
                *cell += image.at(homography.map(point))? / 5.0;
            }
        }
    }
    Some(cells)
}

/// Returns the brightness of the white margin around the frame.
/// Parts beyond the edge of the image do not count.
fn surroundings(image: &BrightnessImage<'_>, homography: &Homography) -> Option<f64> {
    let (near, far) = (-0.5 / CELLS as f64, 1.0 + 0.5 / CELLS as f64);
    let along = (0..CELLS).map(|cell| (cell as f64 + 0.5) / CELLS as f64);
    let points = along.flat_map(|at| [[at, near], [at, far], [near, at], [far, at]]);
    let (sum, count) = points
        .filter_map(|point| image.at(homography.map(point)))
        .fold((0.0, 0), |(sum, count), brightness| (sum + brightness, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// Returns the number of a code and its rotation, quarter turns.
/// The turns lead from the image's top left corner to the tag's.
fn number_of(code: u16) -> Option<(u32, usize)> {
    let mut turned = code;
    for turns in 0..4 {
        if let Some(number) = TAG16H5.iter().position(|known| *known == turned) {
            return Some((number as u32, turns));
        }
        turned = turned_left(turned);
    }
    None
}

/// Turns the 4 x 4 cells of a code counter-clockwise by a quarter.
fn turned_left(code: u16) -> u16 {
    let cell = |row: usize, column: usize| code >> (15 - (4 * row + column)) & 1;
    (0..16).fold(0, |turned, at| turned << 1 | cell(at % 4, 3 - at / 4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_turns_are_none_and_no_turn_of_a_code_is_another() {
        for (number, code) in (0..).zip(TAG16H5) {
            let mut turned = code;
            for turns in 0..4 {
                let expected = if turns == 0 { 0 } else { 4 - turns };
                assert_eq!(number_of(turned), Some((number, expected)));
                turned = turned_left(turned);
            }
            assert_eq!(turned, code);
        }
    }
}
