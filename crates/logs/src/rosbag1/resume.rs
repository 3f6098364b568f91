//! Resumption of a damaged file at its next chunk.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use super::record::BagRecord;

/// Field in the header of each chunk.
const CHUNK_FIELD: &[u8] = b"\x04\0\0\0op=\x05";

/// Maximum size of a chunk's header, bytes.
const MAX_CHUNK_HEADER: usize = 256;

/// Size of the search window, bytes.
const WINDOW_SIZE: usize = 1 << 20;

/// Returns the place of the first whole chunk that begins at `from` or behind it.
pub(super) fn next_chunk(file: &mut File, from: u64) -> io::Result<Option<u64>> {
    let length = file.metadata()?.len();
    let mut window = Vec::new();
    let mut begin = from;
    while begin < length {
        file.seek(SeekFrom::Start(begin))?;
        window.clear();
        // Windows overlap, so that no header is cut.
        file.by_ref().take((WINDOW_SIZE + 2 * MAX_CHUNK_HEADER) as u64).read_to_end(&mut window)?;
        let is_whole = |offset: &usize| {
            let data = chunk_at(&window[*offset..]);
            data.is_some_and(|(header, data)| begin + *offset as u64 + header + data <= length)
        };
        if let Some(offset) = candidates(&window).find(is_whole) {
            return Ok(Some(begin + offset as u64));
        }
        begin += WINDOW_SIZE as u64;
    }
    Ok(None)
}

/// Places where the header of a chunk may begin.
fn candidates(window: &[u8]) -> impl Iterator<Item = usize> + '_ {
    let fields = window.windows(CHUNK_FIELD.len()).enumerate().filter(|(_, own)| *own == CHUNK_FIELD);
    fields.flat_map(|(field, _)| field.saturating_sub(MAX_CHUNK_HEADER)..field.saturating_sub(3))
}

/// Returns the lengths of a chunk's header and data, bytes, if one begins there.
fn chunk_at(bytes: &[u8]) -> Option<(u64, u64)> {
    let (length, rest) = bytes.split_first_chunk()?;
    let header = u32::from_le_bytes(*length) as usize;
    let fields = rest.get(..header).filter(|_| (CHUNK_FIELD.len()..MAX_CHUNK_HEADER).contains(&header))?;
    let record = BagRecord { header: BagRecord::fields(fields).ok()?, data: Vec::new() };
    let is_chunk = record.number(b"op", 1) == Ok(5) && record.number(b"size", 4).is_ok();
    let data = u32::from_le_bytes(*rest[header..].first_chunk()?);
    (is_chunk && record.text(b"compression").is_ok()).then_some((4 + header as u64, 4 + u64::from(data)))
}
