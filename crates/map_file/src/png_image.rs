//! PNG files.

use std::io::{BufRead, Seek, Write};
use std::path::Path;

use png::{BitDepth, ColorType, Decoder, Encoder, EncodingError, Transformations};

use crate::MapFileError;
use crate::image::{MapImage, check_size};

/// Reads an image of any kind, converted to 8 bits per channel.
pub(crate) fn read(file: &Path, source: impl BufRead + Seek) -> Result<MapImage, MapFileError> {
    let wrong = |error: png::DecodingError| MapFileError::new(file, format!("no PNG: {error}"));
    let mut decoder = Decoder::new(source);
    decoder.set_transformations(Transformations::normalize_to_color8());
    let header = decoder.read_header_info().map_err(wrong)?;
    let size = [header.width as usize, header.height as usize];
    check_size(file, size, 4)?;
    let mut reader = decoder.read_info().map_err(wrong)?;
    let channels = reader.output_color_type().0.samples();
    let mut bytes = vec![0; size[0] * size[1] * channels];
    reader.next_frame(&mut bytes).map_err(wrong)?;
    Ok(MapImage { width: size[0], height: size[1], channels, bytes })
}

/// Writes pixels of one channel, or of gray and alpha.
pub(crate) fn write(image: &MapImage, target: impl Write) -> Result<(), EncodingError> {
    let mut encoder = Encoder::new(target, image.width as u32, image.height as u32);
    encoder.set_color(if image.channels == 2 { ColorType::GrayscaleAlpha } else { ColorType::Grayscale });
    encoder.set_depth(BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&image.bytes)?;
    writer.finish()
}
