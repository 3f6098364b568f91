//! Motion blur along the rows of an image, taken out.

use slate_interfaces::{Image, ImageFormat};
use slate_module::math;

/// Length of the transform by which the filter is made, pixels.
const LENGTH: usize = 128;
/// Farthest pixel that counts.
const KERNEL_RADIUS: usize = 32;
/// Power of the noise relative to that of the image: K of the filter.
const NOISE: f64 = 0.02;
/// Blur below which an image is not changed, pixels.
const LEAST: f64 = 1.0;
/// Longest blur that the filter can take out, pixels.
pub(crate) const LONGEST: f64 = 16.0;

/// Wiener filter against uniform motion along the rows, while the shutter was open.
///
/// Its transfer function is H / (H² + K) for a blur H (Gonzalez and Woods, *Digital Image Processing*, 3rd ed., 5.8, with the
/// blur by motion of 5.6.3). It is applied as a convolution of a few pixels, to the encoded values and not to the light.
#[derive(Clone, Debug, Default)]
pub(crate) struct MotionDeblur {
    /// Length of the blur that the kernel is for.
    blur: f64,
    /// Weights of a pixel and of those to its right; those to its left are the same.
    kernel: Vec<f32>,
    /// Row with its ends repeated, one channel.
    row: Vec<f32>,
    pixels: Vec<u8>,
}

impl MotionDeblur {
    /// Returns the pixels of an RGB image without a blur of that length, px.
    /// `None` if there is nothing to do.
    pub fn restore(&mut self, image: &Image, blur: f64) -> Option<&[u8]> {
        // False for NaN, too.
        let is_blurred = blur >= LEAST;
        if !is_blurred || image.format != ImageFormat::RGB8 || image.width == 0 {
            return None;
        }
        let blur = math::min(blur, LONGEST);
        if self.blur != blur {
            self.blur = blur;
            self.make(blur);
        }
        let width = image.width as usize;
        self.pixels.clear();
        self.pixels.resize(3 * width * image.height as usize, 0);
        for (y, out) in (0..image.height).zip(self.pixels.chunks_exact_mut(3 * width)) {
            let row = image.row(y);
            if row.len() < 3 * width {
                return None;
            }
            for channel in 0..3 {
                filter(&self.kernel, &mut self.row, (row, channel), out);
            }
        }
        Some(&self.pixels)
    }

    /// Makes the kernel against a blur of that length.
    fn make(&mut self, blur: f64) {
        let angle = |k: usize, n: usize| std::f64::consts::TAU * (k * n % LENGTH) as f64 / LENGTH as f64;
        // Share of a pixel at that distance: the box of the blur covers the outermost ones in part.
        let covered = |n: usize| math::clamp(0.5 * blur + 0.5 - n as f64, 0.0, 1.0) / blur;
        let half = (0.5 * blur + 0.5).ceil() as usize;
        let filter: Vec<f64> = (0..LENGTH)
            .map(|k| {
                let sides: f64 = (1..=half).map(|n| 2.0 * covered(n) * math::cos(angle(k, n))).sum();
                let transfer = math::min(1.0, 1.0 / blur) + sides;
                transfer / (transfer * transfer + NOISE)
            })
            .collect();
        let weight = |n: usize| (0..LENGTH).map(|k| filter[k] * math::cos(angle(k, n))).sum::<f64>();
        let weights: Vec<f64> = (0..=KERNEL_RADIUS).map(weight).collect();
        // Even regions keep their brightness.
        let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
        self.kernel.clear();
        self.kernel.extend(weights.iter().map(|weight| (weight / sum) as f32));
    }
}

/// Convolves a channel of a row.
fn filter(kernel: &[f32], padded: &mut Vec<f32>, (row, channel): (&[u8], usize), out: &mut [u8]) {
    let width = out.len() / 3;
    let value = |x: usize| f32::from(row[3 * x + channel]);
    padded.clear();
    padded.extend(std::iter::repeat_n(value(0), KERNEL_RADIUS));
    padded.extend((0..width).map(value));
    padded.extend(std::iter::repeat_n(value(width - 1), KERNEL_RADIUS));
    for x in 0..width {
        let middle = x + KERNEL_RADIUS;
        let mut sum = kernel[0] * padded[middle];
        for (n, weight) in kernel.iter().enumerate().skip(1) {
            sum += weight * (padded[middle - n] + padded[middle + n]);
        }
        // The cast takes the nearest number for what is out of range.
        out[3 * x + channel] = (sum + 0.5) as u8;
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use slate_module::testing::Fixture;

    use super::*;
    use crate::{ImageProcessor, ImageSharpness};

    /// Width of a test image.
    const WIDTH: usize = 96;

    /// A row of stripes 12 pixels wide, averaged over that many pixels.
    fn blurred(blur: usize) -> Vec<f64> {
        let stripe = |x: usize| if (x / 12).is_multiple_of(2) { 60.0 } else { 180.0 };
        let at = |x: usize| {
            (0..blur).map(|n| stripe((x + n + 240 - blur / 2).min(10_000))).sum::<f64>() / blur as f64
        };
        (0..WIDTH).map(at).collect()
    }

    fn difference(a: &[f64], b: impl Iterator<Item = f64>) -> f64 {
        a[16..80].iter().zip(b.skip(16)).map(|(a, b)| (a - b).abs()).sum::<f64>() / 64.0
    }

    #[test]
    fn a_known_blur_by_motion_is_taken_out() {
        let (sharp, soft) = (blurred(1), blurred(7));
        let mut deblur = MotionDeblur::default();
        deblur.make(7.0);
        let row: Vec<u8> = soft.iter().flat_map(|value| [(*value + 0.5) as u8; 3]).collect();
        let mut out = vec![0; row.len()];
        filter(&deblur.kernel, &mut Vec::new(), (&row, 0), &mut out);
        let restored = out.chunks(3).map(|pixel| f64::from(pixel[0]));
        let (before, after) = (difference(&sharp, soft.iter().copied()), difference(&sharp, restored));
        assert!(after < 0.75 * before, "{before} -> {after}");
    }

    #[test]
    fn an_even_image_stays_as_it_is() {
        let mut deblur = MotionDeblur::default();
        deblur.make(5.5);
        let row = vec![120_u8; 3 * WIDTH];
        let mut out = vec![0; row.len()];
        (0..3).for_each(|channel| filter(&deblur.kernel, &mut Vec::new(), (&row, channel), &mut out));
        assert_eq!(out, row);
    }

    #[test]
    fn sharpness_is_that_of_the_image_as_it_came() {
        let run = |deblur_length: f64| {
            let mut processor = Fixture::<ImageProcessor>::new();
            processor.params().deblur_length = deblur_length;
            processor.write::<Image>("image", 3 * WIDTH * 4, |image| {
                (image.width, image.height, image.step) = (WIDTH as u32, 4, 3 * WIDTH as u32);
                image.format = ImageFormat::RGB8;
                for (pixel, value) in image.data.chunks_mut(3).zip(blurred(5).iter().cycle()) {
                    pixel.fill(*value as u8);
                }
            });
            processor.tick();
            processor.output::<ImageSharpness>("sharpness").unwrap().laplacian_variance
        };
        assert_eq!(run(0.0), run(5.0));
    }
}
