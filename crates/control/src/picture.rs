//! Images for browsers.

use slate_blackboard::interface::{Descriptor, Interface, Value, View};
use slate_interfaces::{Image, ImageFormat};

/// Image rows without padding.
pub struct Picture {
    width: u32,
    height: u32,
    is_color: bool,
    pixels: Vec<u8>,
}

/// Returns whether values of an interface are images.
pub fn is_picture(descriptor: &Descriptor) -> bool {
    descriptor.hash == Image::DESCRIPTOR.hash
}

impl Picture {
    /// Returns the image of a value.
    /// `None` if the value is not an image, or declares more than it holds.
    pub fn of(descriptor: &'static Descriptor, bytes: &[u8], items: usize) -> Option<Self> {
        if !is_picture(descriptor) || bytes.len() < descriptor.size.checked_add(items)? {
            return None;
        }
        // Without the pixels, of which a table would be large.
        let head = View::new(descriptor, bytes, 0)?.value();
        let number =
            |name| head.get(name).and_then(Value::as_integer).and_then(|number| u32::try_from(number).ok());
        let (width, height, step) = (number("width")?, number("height")?, number("step")? as usize);
        let format = match head.get("format")?.as_str()? {
            "MONO8" => ImageFormat::MONO8,
            "RGB8" => ImageFormat::RGB8,
            _ => return None,
        };
        let row = (width as usize).checked_mul(format.pixel_size())?;
        let data = &bytes[descriptor.size..descriptor.size + items];
        let mut pixels = Vec::with_capacity(data.len().min(row.checked_mul(height as usize)?));
        for y in 0..height as usize {
            let start = y.checked_mul(step)?;
            pixels.extend_from_slice(data.get(start..start.checked_add(row)?)?);
        }
        (width > 0 && height > 0).then_some(Self {
            width,
            height,
            is_color: format == ImageFormat::RGB8,
            pixels,
        })
    }

    /// Encodes the image as PNG, without compression, as clients are near.
    pub fn png(&self) -> Vec<u8> {
        let row = self.pixels.len() / self.height.max(1) as usize;
        let mut raw = Vec::with_capacity(self.pixels.len() + self.height as usize);
        for line in self.pixels.chunks_exact(row.max(1)) {
            // No filter.
            raw.push(0);
            raw.extend_from_slice(line);
        }
        let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
        let mut header = Vec::new();
        header.extend(self.width.to_be_bytes());
        header.extend(self.height.to_be_bytes());
        header.extend([8, if self.is_color { 2 } else { 0 }, 0, 0, 0]);
        chunk(&mut png, *b"IHDR", &header);
        chunk(&mut png, *b"IDAT", &stored(&raw));
        chunk(&mut png, *b"IEND", &[]);
        png
    }

    /// Encodes the image as JPEG of a quality from 1 to 100.
    #[cfg(feature = "jpeg")]
    pub fn jpeg(&self, quality: u8) -> Result<Vec<u8>, String> {
        use jpeg_encoder::{ColorType, Encoder};
        let too_large = |_| format!("{} x {} pixels are more than a JPEG can have", self.width, self.height);
        let width = u16::try_from(self.width).map_err(too_large)?;
        let height = u16::try_from(self.height).map_err(too_large)?;
        let mut jpeg = Vec::new();
        let color = if self.is_color { ColorType::Rgb } else { ColorType::Luma };
        let encoder = Encoder::new(&mut jpeg, quality.clamp(1, 100));
        encoder.encode(&self.pixels, width, height, color).map_err(|error| error.to_string())?;
        Ok(jpeg)
    }

    #[cfg(not(feature = "jpeg"))]
    pub fn jpeg(&self, _: u8) -> Result<Vec<u8>, String> {
        Err("this program is built without JPEG: build it with the feature `jpeg`, or ask for image/png"
            .into())
    }
}

fn chunk(png: &mut Vec<u8>, kind: [u8; 4], data: &[u8]) {
    png.extend((data.len() as u32).to_be_bytes());
    let start = png.len();
    png.extend(kind);
    png.extend_from_slice(data);
    let sum = crc32fast::hash(&png[start..]);
    png.extend(sum.to_be_bytes());
}

/// Returns a zlib stream with uncompressed blocks.
fn stored(data: &[u8]) -> Vec<u8> {
    const MAX_BLOCK_LENGTH: usize = 0xffff;
    let mut stream = vec![0x78, 0x01];
    let count = data.len().div_ceil(MAX_BLOCK_LENGTH).max(1);
    for (index, block) in data.chunks(MAX_BLOCK_LENGTH).enumerate() {
        let length = block.len() as u16;
        stream.push(u8::from(index + 1 == count));
        stream.extend(length.to_le_bytes());
        stream.extend((!length).to_le_bytes());
        stream.extend_from_slice(block);
    }
    let (mut a, mut b) = (1_u32, 0_u32);
    for byte in data {
        a = (a + u32::from(*byte)) % 65521;
        b = (b + a) % 65521;
    }
    stream.extend(((b << 16) | a).to_be_bytes());
    stream
}
