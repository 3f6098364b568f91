//! JPEG encoding of the interface `Image`, for images without gaps between rows.

use slate_blackboard::interface::{Descriptor, Value, View, find};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Layout of an image.
struct Layout {
    width: u16,
    height: u16,
    /// Bytes of a pixel: 1 for grey, 3 for color.
    pixel: usize,
    /// Bytes before the pixels.
    head: usize,
}

impl Layout {
    fn pixels(&self) -> usize {
        usize::from(self.width) * usize::from(self.height) * self.pixel
    }

    /// Reads the layout from the header.
    fn of(descriptor: &'static Descriptor, head: &[u8]) -> Option<Self> {
        if descriptor.name != "Image" || descriptor.tail().is_none_or(|item| item.size() != 1) {
            return None;
        }
        let view = View::new(descriptor, head, 0)?;
        let number = |name: &str| view.at(&find(descriptor, name).ok()?)?.as_integer();
        let pixel = match view.at(&find(descriptor, "format").ok()?)? {
            Value::Text(name) if name == "MONO8" => 1,
            Value::Text(name) if name == "RGB8" => 3,
            _ => return None,
        };
        let (width, height) = (u16::try_from(number("width")?).ok()?, u16::try_from(number("height")?).ok()?);
        let gapless = number("step")? == i128::from(width) * pixel as i128;
        (gapless && width > 0 && height > 0).then_some(Self { width, height, pixel, head: descriptor.size })
    }

    fn color(&self) -> ColorSpace {
        if self.pixel == 1 { ColorSpace::Luma } else { ColorSpace::RGB }
    }
}

/// Appends an image's header and its pixels as JPEG.
/// Returns false if the value is no such image, or if JPEG is not smaller.
pub fn encode(descriptor: &'static Descriptor, bytes: &[u8], quality: u8, content: &mut Vec<u8>) -> bool {
    let Some(layout) = Layout::of(descriptor, bytes) else { return false };
    let Some(pixels) = bytes.get(layout.head..layout.head + layout.pixels()) else { return false };
    // Bytes behind the pixels would be lost.
    if bytes.len() != layout.head + pixels.len() {
        return false;
    }
    let begin = content.len();
    content.extend_from_slice(&bytes[..layout.head]);
    let encoder = jpeg_encoder::Encoder::new(&mut *content, quality.clamp(1, 100));
    let color = if layout.pixel == 1 { jpeg_encoder::ColorType::Luma } else { jpeg_encoder::ColorType::Rgb };
    let written = encoder.encode(pixels, layout.width, layout.height, color).is_ok();
    let pays = written && content.len() - begin < bytes.len();
    if !pays {
        content.truncate(begin);
    }
    pays
}

/// Decodes the image, which takes `length` bytes in memory.
pub fn decode(descriptor: &'static Descriptor, content: &[u8], length: usize) -> Option<Vec<u8>> {
    let layout = Layout::of(descriptor, content)?;
    if layout.head + layout.pixels() != length {
        return None;
    }
    let options = DecoderOptions::default()
        .set_max_width(layout.width.into())
        .set_max_height(layout.height.into())
        .jpeg_set_out_colorspace(layout.color());
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(&content[layout.head..]), options);
    let mut image = content[..layout.head].to_vec();
    image.extend(decoder.decode().ok()?);
    Some(image)
}
