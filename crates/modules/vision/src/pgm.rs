//! Binary PGM files (`P5`) with one byte per pixel.
//!
//! Own code: the crate `image` brings many formats, and allocates a picture instead of a read into the draft.

use crate::source::LONGEST;

/// Picture in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pgm<'a> {
    pub width: u32,
    pub height: u32,
    pub pixels: &'a [u8],
}

/// Parses a file's bytes.
///
/// # Errors
/// A description of the format error.
pub(crate) fn read(bytes: &[u8]) -> Result<Pgm<'_>, &'static str> {
    let mut rest = bytes.strip_prefix(b"P5").ok_or("is no PGM of the binary form, which begins with `P5`")?;
    let mut number = || {
        rest = skip(rest)?;
        let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        let (number, after) = rest.split_at(digits);
        rest = after;
        std::str::from_utf8(number).ok()?.parse::<u32>().ok()
    };
    let (Some(width), Some(height), Some(brightest)) = (number(), number(), number()) else {
        return Err("has no width, height and brightest value after `P5`");
    };
    if !(1..=LONGEST).contains(&width) || !(1..=LONGEST).contains(&height) {
        return Err("has no size from 1x1 to 8192x8192");
    }
    if brightest != 255 {
        return Err("has another brightest value than 255");
    }
    // One blank stands before the pixels.
    let pixels = rest.get(1..).unwrap_or_default();
    let length = width as usize * height as usize;
    let pixels = pixels.get(..length).ok_or("ends before its last pixel")?;
    Ok(Pgm { width, height, pixels })
}

/// Skips blanks and comments; `None` without any.
fn skip(bytes: &[u8]) -> Option<&[u8]> {
    let mut rest = bytes;
    loop {
        match rest.first()? {
            b'#' => {
                let end = rest.iter().position(|byte| *byte == b'\n')?;
                rest = &rest[end..];
            }
            byte if byte.is_ascii_whitespace() => rest = &rest[1..],
            _ => return (rest.len() < bytes.len()).then_some(rest),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn wrong_files_are_refused_with_the_reason() {
        for (file, problem) in [
            ("", "is no PGM of the binary form, which begins with `P5`"),
            ("P2 1 1 255 0", "is no PGM of the binary form, which begins with `P5`"),
            ("P5", "has no width, height and brightest value after `P5`"),
            ("P51 1 255 a", "has no width, height and brightest value after `P5`"),
            ("P5 # never ends", "has no width, height and brightest value after `P5`"),
            ("P5 1 99999999999 255 a", "has no width, height and brightest value after `P5`"),
            ("P5 0 1 255 a", "has no size from 1x1 to 8192x8192"),
            ("P5 1 9000 255 a", "has no size from 1x1 to 8192x8192"),
            ("P5 1 1 65535 ab", "has another brightest value than 255"),
            ("P5 2 2 255 abc", "ends before its last pixel"),
            ("P5 2 2 255", "ends before its last pixel"),
        ] {
            assert_eq!(read(file.as_bytes()), Err(problem), "{file}");
        }
    }

    proptest! {
        #[test]
        fn reads_what_was_written(
            width in 1..20_u32,
            height in 1..20_u32,
            blank in "[ \t\r\n]{1,3}(#[a-z ]{0,5}\n)?",
            all in prop::collection::vec(any::<u8>(), 400),
        ) {
            let pixels = &all[..(width * height) as usize];
            let mut file = format!("P5{blank}{width}{blank}{height}{blank}255\n").into_bytes();
            file.extend_from_slice(pixels);
            prop_assert_eq!(read(&file), Ok(Pgm { width, height, pixels }));
        }

        #[test]
        fn no_file_makes_it_panic(file in prop::collection::vec(any::<u8>(), 0..100)) {
            let _ = read(&file);
            let _ = read(&[b"P5 ".as_slice(), &file].concat());
        }
    }
}
