//! Search for the next valid records of a damaged file.

use std::io::{Read, Seek};

use super::definitions::chunk_head;
use super::record::{
    AttachmentRecord, Channel, Chunk, DataEnd, FRAME_SIZE, MessageIndex, MessageRecord, Metadata, Record,
    Schema,
};
use super::repeated::{self, REPEATED};
use super::source::RecordSource;
use super::{Error, MAXIMUM_RECORD};

/// Bytes that are looked at at once.
const WINDOW_SIZE: u64 = 1 << 16;

/// Minimum number of consecutive records for a candidate to count as a record.
const MIN_CHAIN_LENGTH: usize = 3;

/// Returns the first offset from `start` on at which consecutive records begin.
pub(super) fn next_record<R: Read + Seek>(
    source: &mut RecordSource<R>,
    start: u64,
) -> Result<Option<u64>, Error> {
    let mut window = Vec::new();
    let mut begin = start;
    while begin < source.length() {
        source.seek(begin)?;
        source.part(WINDOW_SIZE + FRAME_SIZE, &mut window)?;
        let places = (window.len() as u64).min(WINDOW_SIZE);
        for place in 0..places {
            let offset = begin + place;
            let left = source.length().saturating_sub(offset + FRAME_SIZE);
            if could_be(&window[place as usize..], left) && is_chain(source, offset)? {
                return Ok(Some(offset));
            }
        }
        begin += places.max(1);
    }
    Ok(None)
}

/// Returns true if a frame could be there.
fn could_be(bytes: &[u8], left: u64) -> bool {
    let Some(([opcode, length @ ..], _)) = bytes.split_first_chunk::<{ FRAME_SIZE as usize }>() else {
        return false;
    };
    let length = u64::from_le_bytes(*length);
    let is_known =
        (Schema::OPCODE..=Metadata::OPCODE).contains(opcode) || [DataEnd::OPCODE, REPEATED].contains(opcode);
    is_known && length <= left && length <= MAXIMUM_RECORD
}

/// Returns true if the frame of a record could be there.
/// The end of the file may truncate it.
pub(super) fn is_plausible<R: Read + Seek>(source: &mut RecordSource<R>, offset: u64) -> Result<bool, Error> {
    let mut bytes = Vec::new();
    source.seek(offset)?;
    source.part(FRAME_SIZE, &mut bytes)?;
    let Some(([opcode, length @ ..], _)) = bytes.split_first_chunk::<{ FRAME_SIZE as usize }>() else {
        return Ok(true);
    };
    let length = u64::from_le_bytes(*length);
    // Some writers fill in the length of a chunk when it is finished.
    let is_open = *opcode == Chunk::OPCODE && length == u64::MAX;
    let is_known = (1..=DataEnd::OPCODE).contains(opcode);
    let is_private = *opcode >= 0x80 && length <= source.length().saturating_sub(source.position());
    Ok(is_open || (is_known || is_private) && length <= MAXIMUM_RECORD)
}

/// Returns true if enough well-formed records follow from there on.
/// Fewer suffice if the data ends.
pub(super) fn is_chain<R: Read + Seek>(source: &mut RecordSource<R>, offset: u64) -> Result<bool, Error> {
    let mut body = Vec::new();
    source.seek(offset)?;
    for _ in 0..MIN_CHAIN_LENGTH {
        if source.position() == source.length() {
            return Ok(true);
        }
        let frame = match source.frame() {
            Ok(frame) => frame,
            Err(Error::Damaged { .. }) => return Ok(false),
            Err(error) => return Err(error),
        };
        let is_whole = match frame.opcode {
            Chunk::OPCODE => {
                source.part(frame.length.min(64), &mut body)?;
                chunk_head(&body).is_ok_and(|(head, compressed, rest)| {
                    let fields = (body.len() - rest.len()) as u64;
                    let is_known = ["", "lz4", "zstd"].contains(&head.compression.as_str());
                    is_known && fields.checked_add(compressed) == Some(frame.length)
                })
            }
            opcode => {
                source.body(frame, &mut body)?;
                match opcode {
                    Schema::OPCODE => Schema::parse(&body).is_ok_and(|schema| schema.id > 0),
                    Channel::OPCODE => Channel::parse(&body).is_ok(),
                    MessageRecord::OPCODE => MessageRecord::parse(&body).is_ok(),
                    MessageIndex::OPCODE => MessageIndex::parse(&body).is_ok(),
                    AttachmentRecord::OPCODE => AttachmentRecord::parse(&body).is_ok(),
                    Metadata::OPCODE => Metadata::parse(&body).is_ok(),
                    REPEATED => repeated::sound(&body).is_some_and(|sound| sound.is_ok()),
                    DataEnd::OPCODE => return Ok(DataEnd::parse(&body).is_ok()),
                    _ => false,
                }
            }
        };
        if !is_whole {
            return Ok(false);
        }
        source.seek(frame.end())?;
    }
    Ok(true)
}
