//! How the records of a chunk are made smaller.

use std::io::{Read, Write};

use super::MAXIMUM_RECORD;

/// How chunks are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// As they are, so that of a chunk that was not finished all is read that is there.
    #[default]
    None,
    /// Smaller, by LZ4.
    Lz4,
}

impl Compression {
    /// What a chunk says of it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Lz4 => "lz4",
        }
    }

    pub(super) fn compress(self, records: &[u8], out: &mut Vec<u8>) -> std::io::Result<()> {
        match self {
            Self::None => out.extend(records),
            Self::Lz4 => {
                let mut encoder = lz4_flex::frame::FrameEncoder::new(out);
                encoder.write_all(records)?;
                encoder.finish()?;
            }
        }
        Ok(())
    }
}

/// Appends the records of a chunk as long as they can be read, at most one byte more than so many; says what is wrong
/// with the rest.
pub(super) fn decompress(
    compression: &str,
    bytes: &[u8],
    length: u64,
    out: &mut Vec<u8>,
) -> Result<(), String> {
    if length > MAXIMUM_RECORD {
        return Err(format!("its records have {length} bytes, and at most {MAXIMUM_RECORD} are read"));
    }
    let before = out.len() as u64;
    let most = length + 1;
    let read = match compression {
        "" => bytes.take(most).read_to_end(out).map_err(|error| error.to_string()),
        "lz4" => lz4_flex::frame::FrameDecoder::new(bytes)
            .take(most)
            .read_to_end(out)
            .map_err(|error| error.to_string()),
        "zstd" => ruzstd::decoding::StreamingDecoder::new(bytes)
            .map_err(|error| error.to_string())
            .and_then(|decoder| decoder.take(most).read_to_end(out).map_err(|error| error.to_string())),
        other => return Err(format!("its compression `{other}` is none of lz4 and zstd")),
    };
    read.map_err(|what| format!("its {compression} records can't be read: {what}"))?;
    match out.len() as u64 - before {
        found if found == length => Ok(()),
        found if found > length => {
            Err(format!("it has more than the {length} bytes of records that it says"))
        }
        found => Err(format!("it has {found} bytes of records and should have {length}")),
    }
}
