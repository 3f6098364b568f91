//! Blob detection in an image.

use slate_interfaces::Image;

/// Detected blob.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Blob {
    /// Center, pixels from the left and from the top.
    pub x: f64,
    pub y: f64,
    /// Brightness of the brightest pixel.
    pub brightness: f64,
    pub pixels: u32,
}

/// Buffers of a search, reused so that it allocates only once.
#[derive(Debug, Default)]
pub(crate) struct Search {
    seen: Vec<bool>,
    open: Vec<(u32, u32)>,
}

/// Returns the brightness of a pixel, from 0 to 1.
fn brightness(image: &Image, x: u32, y: u32) -> f64 {
    let size = image.format.pixel_size();
    let start = x as usize * size;
    let pixel = image.row(y).get(start..start + size).unwrap_or_default();
    let sum: u32 = pixel.iter().map(|byte| u32::from(*byte)).sum();
    if size == 0 { 0.0 } else { f64::from(sum) / (255 * size) as f64 }
}

impl Search {
    /// Finds the 4-connected blob about the brightest pixel.
    /// Its pixels have at least `share` of that brightness.
    ///
    /// `None` for a black image; of equally bright pixels the topmost counts.
    pub fn brightest(&mut self, image: &Image, share: f64) -> Option<Blob> {
        let mut peak = (0.0, (0, 0));
        for y in 0..image.height {
            for x in 0..image.width {
                let bright = brightness(image, x, y);
                if bright > peak.0 {
                    peak = (bright, (x, y));
                }
            }
        }
        let (most, start) = peak;
        if most == 0.0 {
            return None;
        }
        self.seen.clear();
        self.seen.resize(image.width as usize * image.height as usize, false);
        self.open.clear();
        self.visit(image, start);
        let (mut sum_x, mut sum_y, mut pixels) = (0_u64, 0_u64, 0_u32);
        while let Some((x, y)) = self.open.pop() {
            if brightness(image, x, y) < share * most {
                continue;
            }
            (sum_x, sum_y, pixels) = (sum_x + u64::from(x), sum_y + u64::from(y), pixels + 1);
            let beside = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
            beside.into_iter().for_each(|next| self.visit(image, next));
        }
        let mean = |sum: u64| sum as f64 / f64::from(pixels);
        Some(Blob { x: mean(sum_x), y: mean(sum_y), brightness: most, pixels })
    }

    fn visit(&mut self, image: &Image, (x, y): (u32, u32)) {
        if x < image.width && y < image.height {
            let seen = &mut self.seen[y as usize * image.width as usize + x as usize];
            if !std::mem::replace(seen, true) {
                self.open.push((x, y));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;
    use slate_interfaces::ImageFormat;
    use slate_module::Interface;

    use super::*;
    use crate::pattern;

    /// Returns an image of those pixels.
    fn with_image<R>(
        width: u32,
        height: u32,
        format: ImageFormat,
        pixels: &[u8],
        work: impl FnOnce(&mut Image) -> R,
    ) -> R {
        let mut memory = vec![0_u128; Image::DESCRIPTOR.shape(pixels.len()).bytes(pixels.len()).div_ceil(16)];
        // SAFETY: the memory has room for those pixels, and is not shared.
        let image = unsafe { Image::from_raw_mut(memory.as_mut_ptr().cast(), pixels.len()) };
        (image.width, image.height, image.format) = (width, height, format);
        image.step = width * format.pixel_size() as u32;
        image.data.copy_from_slice(pixels);
        work(image)
    }

    #[test]
    fn finds_the_center_of_the_brightest_connected_blob() {
        #[rustfmt::skip]
        let pixels = [
            0, 0,   0,   0, 90,
            0, 180, 200, 0, 0,
            0, 180, 180, 0, 190,
        ];
        let found =
            with_image(5, 3, ImageFormat::MONO8, &pixels, |image| Search::default().brightest(image, 0.75));
        assert_eq!(found, Some(Blob { x: 1.5, y: 1.5, brightness: 200.0 / 255.0, pixels: 4 }));
    }

    #[test]
    fn black_and_broken_images_have_no_blob() {
        let search = |format, pixels: &[u8]| {
            with_image(2, 2, format, pixels, |image| Search::default().brightest(image, 0.5))
        };
        assert_eq!(search(ImageFormat::MONO8, &[0; 4]), None);
        assert_eq!(search(ImageFormat::MONO8, &[]), None);
        assert_eq!(search(ImageFormat(77), &[255; 4]), None);
        // The second row is missing.
        assert_eq!(search(ImageFormat::MONO8, &[255; 2]).map(|found| found.pixels), Some(2));
        let red = search(ImageFormat::RGB8, &[0, 0, 0, 255, 0, 0, 0, 0, 0, 0, 0, 0]).unwrap();
        assert_eq!((red.x, red.y, red.brightness, red.pixels), (1.0, 0.0, 1.0 / 3.0, 1));
    }

    proptest! {
        #[test]
        fn finds_the_disc_of_the_pattern(seconds in 0.0..100.0_f64, width in 30..120_u32, height in 30..120_u32) {
            let pixels = vec![0; (width * height) as usize];
            let found = with_image(width, height, ImageFormat::MONO8, &pixels, |image| {
                pattern::draw(image, width, height, seconds);
                Search::default().brightest(image, 0.75).unwrap()
            });
            let (x, y, _) = pattern::disc(width, height, seconds);
            prop_assert!((found.x - x).abs() < 0.5 && (found.y - y).abs() < 0.5, "{found:?} {x} {y}");
        }

        #[test]
        fn no_image_makes_it_panic(
            width in 0..8_u32, height in 0..8_u32, format in 0..4_u8, step in any::<u32>(),
            pixels in prop::collection::vec(any::<u8>(), 0..100), share in 0.0..=1.0_f64,
        ) {
            with_image(width, height, ImageFormat(format), &pixels, |image| {
                image.step = step;
                let found = Search::default().brightest(image, share);
                assert!(found.is_none_or(|found| found.pixels >= 1 && found.pixels <= width * height));
            });
        }
    }
}
