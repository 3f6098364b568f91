//! Repeated reading of messages by their places.

use std::io::{Read, Seek};

use slate_sorted::SortedMap;

use super::{Message, Reader};
use crate::Error;
use crate::record::{Chunk, FRAME_SIZE, Record};

/// Location of a message in its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageLocation {
    /// The chunk, or the record outside of chunks.
    at: u64,
    start: u32,
    end: u32,
}

/// Cache of chunks, each with the time of its last use.
#[derive(Default)]
pub(super) struct ChunkCache {
    chunks: SortedMap<u64, (u64, Vec<u8>)>,
    bytes: usize,
    wanted: u64,
}

/// Size of an uncompressed chunk's header, bytes.
/// It has two times, a length, a checksum, an empty text, and a length.
const UNCOMPRESSED_HEAD_SIZE: u64 = 8 + 8 + 8 + 4 + 4 + 8;

/// Maximum size of the kept chunks besides the last one, bytes.
const MAX_CACHE_SIZE: usize = 32 << 20;

impl ChunkCache {
    fn put(&mut self, at: u64, records: Vec<u8>) {
        self.bytes += records.len();
        self.chunks.insert(at, (self.wanted, records));
        while self.bytes > MAX_CACHE_SIZE && self.chunks.len() > 1 {
            let oldest = self.chunks.iter().min_by_key(|(_, (wanted, _))| *wanted).map(|(at, _)| *at);
            let Some((_, records)) = oldest.and_then(|oldest| self.chunks.remove(&oldest)) else { break };
            self.bytes -= records.len();
        }
    }

    /// Returns true if the chunk is in the cache, and marks it as used.
    fn has(&mut self, at: u64) -> bool {
        self.wanted += 1;
        let found = self.chunks.get_mut(&at);
        found.map(|(wanted, _)| *wanted = self.wanted).is_some()
    }
}

impl<R: Read + Seek> Reader<R> {
    /// Returns the next message, its location, and the checksum of its record.
    pub fn next_located(&mut self) -> Result<Option<(MessageLocation, u32, Message<'_>)>, Error> {
        let Some((start, end)) = self.find()? else { return Ok(None) };
        // A chunk is not longer than that.
        let location = MessageLocation { at: self.at, start: start as u32, end: end as u32 };
        let record = &self.records[start..end];
        Ok(Some((location, crc32fast::hash(record), self.message(record)?)))
    }

    /// Returns a message again, once all of the file was read.
    pub fn message_at(&mut self, location: MessageLocation) -> Result<Message<'_>, Error> {
        if !self.chunk_cache.has(location.at) {
            self.records.clear();
            self.source.seek(location.at)?;
            let frame = self.source.frame()?;
            self.source.body(frame, &mut self.body)?;
            if frame.opcode == Chunk::OPCODE {
                self.unpack(frame)?;
            } else {
                self.records.extend(frame.bytes());
                self.records.extend(&self.body);
            }
            self.chunk_cache.put(location.at, std::mem::take(&mut self.records));
        }
        let records = self.chunk_cache.chunks.get(&location.at).map(|(_, records)| records);
        let record = records.and_then(|records| records.get(location.start as usize..location.end as usize));
        self.message(record.ok_or_else(|| self.changed(location))?)
    }

    /// Reads a message as [`message_at`](Reader::message_at), without those around it.
    /// Only its record is read, unless its chunk is compressed, and checked by its checksum.
    pub fn message_alone(&mut self, location: MessageLocation, checksum: u32) -> Result<Message<'_>, Error> {
        let chunks = &self.outline.chunks;
        let chunk = chunks.binary_search_by_key(&location.at, |chunk| chunk.chunk_start_offset);
        let first = match chunk.map(|index| &chunks[index]) {
            Ok(chunk) if !chunk.compression.is_empty() => return self.message_at(location),
            Ok(chunk) => chunk.chunk_start_offset + FRAME_SIZE + UNCOMPRESSED_HEAD_SIZE,
            Err(_) => location.at,
        };
        self.source.seek(first + u64::from(location.start))?;
        self.source.part((location.end - location.start).into(), &mut self.body)?;
        if crc32fast::hash(&self.body) != checksum {
            return Err(self.changed(location));
        }
        self.message(&self.body)
    }

    fn changed(&self, location: MessageLocation) -> Error {
        self.source.damaged(location.at, "the file has become another one while it was read")
    }
}
