//! Binary PGM files (`P5`) with one byte per pixel.

use std::io::{self, BufRead, Read, Write};
use std::path::Path;

use crate::MapFileError;
use crate::image::{MapImage, check_size};

/// Reads an image, whose brightest value becomes 255.
pub(crate) fn read(file: &Path, mut source: impl BufRead) -> Result<MapImage, MapFileError> {
    let unreadable = |error: io::Error| MapFileError::unreadable(file, &error);
    let mut magic = [0; 2];
    if source.read_exact(&mut magic).is_err() || magic != *b"P5" {
        return Err(MapFileError::new(file, "no binary PGM: expected `P5` at the start"));
    }
    let mut number = |name: &str, most: usize| -> Result<usize, MapFileError> {
        let text = header_word(&mut source).map_err(unreadable)?;
        let value = text.parse().ok().filter(|value| (1..=most).contains(value));
        value.ok_or_else(|| {
            let reason = format!("invalid {name} `{text}` in the header: expected 1 to {most}");
            MapFileError::new(file, reason)
        })
    };
    let most = u32::MAX as usize;
    let (width, height) = (number("width", most)?, number("height", most)?);
    let brightest = number("brightest value", 255)?;
    check_size(file, [width, height], 1)?;
    // Grows with the bytes read, whatever the header claims.
    let mut bytes = Vec::new();
    source.take((width * height) as u64).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() < width * height {
        let reason = format!("ends before its last pixel: expected {width} x {height} bytes");
        return Err(MapFileError::new(file, reason));
    }
    if brightest < 255 {
        bytes.iter_mut().for_each(|byte| {
            *byte = (usize::from(*byte).min(brightest) * 255 / brightest) as u8;
        });
    }
    Ok(MapImage { width, height, channels: 1, bytes })
}

/// Reads the next word of the header, with the blank after it.
/// Comments go from `#` to the end of a line.
fn header_word(source: &mut impl Read) -> io::Result<String> {
    /// Digits of the largest number.
    const MOST_DIGITS: usize = 20;
    let (mut word, mut byte, mut is_comment) = (String::new(), [0], false);
    while word.len() < MOST_DIGITS && source.read(&mut byte)? == 1 {
        match byte[0] {
            b'\n' if is_comment => is_comment = false,
            _ if is_comment => {}
            b'#' => is_comment = true,
            blank if blank.is_ascii_whitespace() && !word.is_empty() => break,
            blank if blank.is_ascii_whitespace() => {}
            sign => word.push(char::from(sign)),
        }
    }
    Ok(word)
}

/// Writes pixels of one channel.
pub(crate) fn write(image: &MapImage, mut target: impl Write) -> io::Result<()> {
    write!(target, "P5\n{} {}\n255\n", image.width, image.height)?;
    target.write_all(&image.bytes)
}
