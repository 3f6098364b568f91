//! Compression of the records of a chunk.

use std::borrow::Cow;
use std::io::{Read, Write};

use super::MAXIMUM_RECORD;

/// Compression of written chunks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Uncompressed: an unfinished chunk can be read as far as it was written.
    #[default]
    None,
    /// Smaller, by LZ4.
    Lz4,
}

impl Compression {
    /// Returns the name in a chunk.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Lz4 => "lz4",
        }
    }

    pub(super) fn compress(self, records: &[u8]) -> std::io::Result<Cow<'_, [u8]>> {
        match self {
            Self::None => Ok(Cow::Borrowed(records)),
            Self::Lz4 => {
                let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
                encoder.write_all(records)?;
                Ok(Cow::Owned(encoder.finish()?))
            }
        }
    }
}

/// Appends the records of a chunk, at most `most` bytes.
pub(super) fn decompress(
    compression: &str,
    bytes: &[u8],
    most: u64,
    out: &mut Vec<u8>,
) -> Result<(), String> {
    if most > MAXIMUM_RECORD {
        return Err(format!("the records have {most} bytes, and at most {MAXIMUM_RECORD} are read"));
    }
    let before = out.len() as u64;
    let limit = most + 1;
    let failed = |error: String| format!("its {compression} records can't be read: {error}");
    let mut left = bytes;
    match compression {
        "" => (&mut left).take(limit).read_to_end(out).map_err(|error| failed(error.to_string()))?,
        "lz4" => lz4_flex::frame::FrameDecoder::new(&mut left)
            .take(limit)
            .read_to_end(out)
            .map_err(|error| failed(error.to_string()))?,
        "zstd" => ruzstd::decoding::StreamingDecoder::new(&mut left)
            .map_err(|error| failed(error.to_string()))?
            .take(limit)
            .read_to_end(out)
            .map_err(|error| failed(error.to_string()))?,
        other => return Err(format!("unknown compression `{other}`: expected lz4 or zstd")),
    };
    match out.len() as u64 - before {
        found if found > most => Err(format!("it has more than the declared {most} bytes of records")),
        _ if !left.is_empty() => Err(format!("{} bytes follow its {compression} records", left.len())),
        _ => Ok(()),
    }
}
