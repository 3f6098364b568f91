//! Reading lines of bounded length.

use std::io::{BufRead, Result};

/// A line of the other side.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Line {
    /// Without its end.
    Whole(Vec<u8>),
    /// Longer than allowed; it was passed over.
    TooLong,
    /// There is no more; a line without an end is none.
    End,
}

/// Reads a line of at most `limit` bytes; no more than that is ever kept.
pub(super) fn read(reader: &mut impl BufRead, limit: usize) -> Result<Line> {
    let mut line = Vec::new();
    let mut too_long = false;
    loop {
        let part = reader.fill_buf()?;
        if part.is_empty() {
            return Ok(Line::End);
        }
        let end = part.iter().position(|byte| *byte == b'\n');
        let length = end.unwrap_or(part.len());
        too_long |= line.len() + length > limit;
        if too_long {
            line = Vec::new();
        } else {
            line.extend_from_slice(&part[..length]);
        }
        reader.consume(end.map_or(length, |end| end + 1));
        if end.is_some() {
            return Ok(if too_long { Line::TooLong } else { Line::Whole(line) });
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use std::io::BufReader;

    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Whatever comes in whatever pieces: whole lines as they are, longer ones passed over.
        #[test]
        fn lines_come_whole_or_not_at_all(
            lines in vec(vec(any::<u8>().prop_filter("no end", |byte| *byte != b'\n'), 0..40), 0..20),
            rest in vec(Just(b'x'), 0..40),
            piece in 1usize..50,
        ) {
            let mut text: Vec<u8> = lines.iter().flat_map(|line| [line, &b"\n"[..]].concat()).collect();
            text.extend(rest);
            let mut reader = BufReader::with_capacity(piece, &text[..]);
            for line in lines {
                let expected = if line.len() > 20 { Line::TooLong } else { Line::Whole(line) };
                prop_assert_eq!(read(&mut reader, 20).unwrap(), expected);
            }
            prop_assert_eq!(read(&mut reader, 20).unwrap(), Line::End);
        }
    }
}
