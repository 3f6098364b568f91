//! End of a file whose writer was killed: truncated, but valid up to there.

use std::io::{Read, Seek};

use super::definitions::chunk_head;
use super::record::{Chunk, DataEnd, FRAME_SIZE, Footer, Header, MAGIC, MessageIndex, Record};
use super::repeated::REPEATED;
use super::resume::next_record;
use super::source::{RecordFrame, RecordSource};
use super::{Error, MAXIMUM_RECORD};

/// Upper bound of the size of a chunk's fields before its records, bytes.
const MAX_CHUNK_HEAD: u64 = 64;

/// Returns the frame of the next record, and its body.
/// `None` where the file is truncated.
pub(super) fn next_or_cut<R: Read + Seek>(
    source: &mut RecordSource<R>,
    body: &mut Vec<u8>,
) -> Result<Option<RecordFrame>, Error> {
    let offset = source.position();
    match source.frame() {
        Ok(frame) => source.body(frame, body).map(|()| Some(frame)),
        Err(error @ Error::Damaged { .. }) => match is_cut(source, offset)? {
            true => Ok(None),
            false => Err(error),
        },
        Err(error) => Err(error),
    }
}

/// Returns true if all data are there, and the file is truncated behind them.
/// The part behind them begins at `start`.
pub(super) fn is_cut_behind_data<R: Read + Seek>(
    source: &mut RecordSource<R>,
    start: u64,
) -> Result<bool, Error> {
    let mut body = Vec::new();
    if has_end(source)? {
        return Ok(false);
    }
    source.seek(start)?;
    loop {
        let Some(frame) = next_or_cut(source, &mut body)? else { return Ok(true) };
        if frame.opcode == Footer::OPCODE {
            source.part(MAGIC.len() as u64 + 1, &mut body)?;
            return Ok(body.len() < MAGIC.len() && MAGIC.starts_with(&body));
        }
    }
}

/// Returns true if the file has the end of a whole one.
fn has_end<R: Read + Seek>(source: &mut RecordSource<R>) -> Result<bool, Error> {
    let size = MAGIC.len() as u64;
    let mut bytes = Vec::new();
    source.seek(source.length().saturating_sub(size))?;
    source.part(size, &mut bytes)?;
    Ok(bytes == MAGIC && source.length() > size)
}

/// Returns true if the end of the file could truncate a record there.
/// A wrong length looks similar: then lengths in the record differ, or records follow, or the file has an end.
fn is_cut<R: Read + Seek>(source: &mut RecordSource<R>, offset: u64) -> Result<bool, Error> {
    let mut bytes = Vec::new();
    let has_end = has_end(source)?;
    source.seek(offset)?;
    source.part(FRAME_SIZE + MAX_CHUNK_HEAD, &mut bytes)?;
    let Some((opcode, rest)) = bytes.split_first() else { return Ok(!has_end) };
    let is_known = (Header::OPCODE..=DataEnd::OPCODE).contains(opcode) || *opcode == REPEATED;
    if has_end || !is_known {
        return Ok(false);
    }
    let Some((length, rest)) = rest.split_first_chunk() else { return Ok(true) };
    let length = u64::from_le_bytes(*length);
    let left = source.length().saturating_sub(offset + FRAME_SIZE);
    if length <= left || length > MAXIMUM_RECORD {
        return Ok(false);
    }
    let fits = match *opcode {
        // The records in it would look like records that follow.
        Chunk::OPCODE => {
            return Ok(match chunk_head(rest) {
                Ok((head, compressed, data)) => {
                    let fields = (rest.len() - data.len()) as u64;
                    let is_whole = compressed == head.uncompressed_size || !head.compression.is_empty();
                    is_whole && fields.checked_add(compressed) == Some(length)
                }
                Err(_) => left < MAX_CHUNK_HEAD,
            });
        }
        MessageIndex::OPCODE => {
            let entries = rest.get(2..).and_then(|rest| rest.first_chunk());
            entries.is_none_or(|entries| u64::from(u32::from_le_bytes(*entries)) + 6 == length)
        }
        DataEnd::OPCODE => length == 4,
        Footer::OPCODE => length == 20,
        _ => true,
    };
    Ok(fits && next_record(source, offset + 1)?.is_none())
}
