use slate_interfaces::{Image, ImageFormat};

/// Brightness of an image, row by row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Brightness {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<u8>,
}

impl Brightness {
    /// Computes the sharpness of an image.
    /// Empty for an unknown format.
    pub fn take(&mut self, image: &Image) {
        self.pixels.clear();
        (self.width, self.height) = (image.width as usize, image.height as usize);
        for y in 0..image.height {
            match image.format {
                ImageFormat::MONO8 => self.pixels.extend_from_slice(image.row(y)),
                ImageFormat::RGB8 => self.pixels.extend(image.row(y).chunks_exact(3).map(luma)),
                _ => {}
            }
        }
        if self.pixels.len() != self.width * self.height {
            (self.width, self.height) = (0, 0);
            self.pixels.clear();
        }
    }

    /// Computes the brightness of pixels in red, green and blue.
    /// The image has the size of the one before.
    pub fn take_pixels(&mut self, pixels: &[u8]) {
        self.pixels.clear();
        self.pixels.extend(pixels.chunks_exact(3).map(luma));
        self.pixels.resize(self.width * self.height, 0);
    }

    /// Returns the contrast of the floor, in the lowest quarter of the image.
    /// It is the mean difference of neighbors relative to the mean; 0 for a dark floor.
    pub fn floor_contrast(&self) -> f64 {
        let (mut differences, mut sum) = (0_u64, 0_u64);
        for row in self.pixels.chunks_exact(self.width.max(1)).skip(self.height - self.height / 4) {
            sum += row.iter().map(|value| u64::from(*value)).sum::<u64>();
            differences += row.windows(2).map(|pair| u64::from(pair[0].abs_diff(pair[1]))).sum::<u64>();
        }
        if sum == 0 { 0.0 } else { differences as f64 / sum as f64 }
    }

    /// Returns the variance of its Laplacian.
    /// 0 for an image of less than 3 columns or rows.
    pub fn laplacian_variance(&self) -> f64 {
        let (mut sum, mut squares, mut count) = (0_i64, 0_i64, 0_i64);
        for y in 1..self.height.saturating_sub(1) {
            for x in 1..self.width.saturating_sub(1) {
                let at = |x: usize, y: usize| i64::from(self.pixels[y * self.width + x]);
                let value = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1) - 4 * at(x, y);
                (sum, squares, count) = (sum + value, squares + value * value, count + 1);
            }
        }
        if count == 0 {
            return 0.0;
        }
        let mean = sum as f64 / count as f64;
        squares as f64 / count as f64 - mean * mean
    }
}

/// Brightness of a color (ITU-R BT.601).
fn luma(pixel: &[u8]) -> u8 {
    let [red, green, blue] = [pixel[0], pixel[1], pixel[2]].map(u32::from);
    ((299 * red + 587 * green + 114 * blue + 500) / 1000) as u8
}
