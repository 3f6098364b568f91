//! Dark regions of an image, as the outlines of their rows.

use super::BrightnessImage;

/// Side of the tiles whose extremes are the local threshold, px.
const TILE: usize = 8;
/// Least contrast of a neighborhood, levels of 255.
const LEAST_CONTRAST: u8 = 25;
/// Least side of a region's box, px: two for each cell.
const LEAST_SIDE: usize = 12;

/// RegionOutline of a region.
#[derive(Clone, Debug, Default)]
pub(super) struct RegionOutline {
    /// Ends of its rows and columns, as corners of pixels, px.
    pub points: Vec<[f64; 2]>,
}

/// Dark regions of an image.
#[derive(Clone, Debug, Default)]
pub(super) struct DarkRegions {
    /// Set for dark pixels that belong to no region yet.
    is_dark: Vec<bool>,
    /// Darkest and brightest pixel of each tile.
    tiles: Vec<(u8, u8)>,
    /// Pixels of the present region.
    members: Vec<usize>,
    /// Left and right end of each of its rows.
    rows: Vec<(usize, usize)>,
    /// Upper and lower end of each of its columns.
    columns: Vec<(usize, usize)>,
    outlines: Vec<RegionOutline>,
    count: usize,
}

impl DarkRegions {
    /// Finds the regions of an image, from the top left.
    pub fn find(&mut self, image: &BrightnessImage<'_>) {
        self.count = 0;
        self.threshold(image);
        for first in 0..self.is_dark.len() {
            if self.is_dark[first] {
                self.follow(first, image);
            }
        }
    }

    /// Returns the outlines found.
    pub fn outlines(&self) -> &[RegionOutline] {
        &self.outlines[..self.count]
    }

    /// Marks dark pixels.
    /// They are darker than the middle of their neighborhood's extremes.
    fn threshold(&mut self, image: &BrightnessImage<'_>) {
        let (columns, rows) = (image.width.div_ceil(TILE), image.height.div_ceil(TILE));
        self.tiles.clear();
        self.tiles.resize(columns * rows, (u8::MAX, 0));
        for (at, pixel) in image.pixels[..image.width * image.height].iter().enumerate() {
            let (x, y) = (at % image.width / TILE, at / image.width / TILE);
            let (darkest, brightest) = &mut self.tiles[y * columns + x];
            *darkest = (*darkest).min(*pixel);
            *brightest = (*brightest).max(*pixel);
        }
        self.is_dark.clear();
        self.is_dark.resize(image.width * image.height, false);
        for tile in 0..columns * rows {
            let (column, row) = (tile % columns, tile / columns);
            let (mut darkest, mut brightest) = (u8::MAX, 0);
            for y in row.saturating_sub(1)..(row + 2).min(rows) {
                for (low, high) in
                    &self.tiles[y * columns..][column.saturating_sub(1)..(column + 2).min(columns)]
                {
                    darkest = darkest.min(*low);
                    brightest = brightest.max(*high);
                }
            }
            if brightest - darkest < LEAST_CONTRAST {
                continue;
            }
            let threshold = darkest + (brightest - darkest) / 2;
            for y in row * TILE..((row + 1) * TILE).min(image.height) {
                for x in column * TILE..((column + 1) * TILE).min(image.width) {
                    let at = y * image.width + x;
                    self.is_dark[at] = image.pixels[at] < threshold;
                }
            }
        }
    }

    /// Takes the region of a pixel, and keeps the outline of a tag's size.
    /// Regions cut by the image's edge are dropped.
    fn follow(&mut self, first: usize, image: &BrightnessImage<'_>) {
        let (width, height) = (image.width, image.height);
        self.members.clear();
        self.members.push(first);
        self.is_dark[first] = false;
        let mut at = 0;
        let (mut left, mut right, mut bottom) = (width, 0, 0);
        while let Some(pixel) = self.members.get(at).copied() {
            at += 1;
            let (x, y) = (pixel % width, pixel / width);
            (left, right, bottom) = (left.min(x), right.max(x), bottom.max(y));
            let neighbors = [
                (x > 0).then(|| pixel - 1),
                (x + 1 < width).then_some(pixel + 1),
                (y > 0).then(|| pixel - width),
                (y + 1 < height).then_some(pixel + width),
            ];
            for neighbor in neighbors.into_iter().flatten() {
                if std::mem::take(&mut self.is_dark[neighbor]) {
                    self.members.push(neighbor);
                }
            }
        }
        let top = first / width;
        let is_cut = left == 0 || top == 0 || right + 1 == width || bottom + 1 == height;
        if is_cut || right - left + 1 < LEAST_SIDE || bottom - top + 1 < LEAST_SIDE {
            return;
        }
        self.rows.clear();
        self.rows.resize(bottom - top + 1, (width, 0));
        self.columns.clear();
        self.columns.resize(right - left + 1, (height, 0));
        for pixel in &self.members {
            let (x, y) = (pixel % width, pixel / width);
            extend(&mut self.rows[y - top], x);
            extend(&mut self.columns[x - left], y);
        }
        self.keep(left, top);
    }

    /// Keeps the outline of the present rows and columns.
    fn keep(&mut self, left: usize, top: usize) {
        if self.count == self.outlines.len() {
            self.outlines.push(RegionOutline::default());
        }
        let points = &mut self.outlines[self.count].points;
        self.count += 1;
        points.clear();
        for (row, (first, last)) in self.rows.iter().enumerate() {
            let (y, first, last) = ((top + row) as f64, *first as f64, (last + 1) as f64);
            points.extend([[first, y], [first, y + 1.0], [last, y], [last, y + 1.0]]);
        }
        for (column, (first, last)) in self.columns.iter().enumerate() {
            let (x, first, last) = ((left + column) as f64, *first as f64, (last + 1) as f64);
            points.extend([[x, first], [x + 1.0, first], [x, last], [x + 1.0, last]]);
        }
    }
}

/// Extends the ends of a row or column by a pixel.
fn extend((first, last): &mut (usize, usize), pixel: usize) {
    (*first, *last) = ((*first).min(pixel), (*last).max(pixel));
}
