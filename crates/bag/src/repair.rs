use std::fs::File;
use std::io::{BufReader, Read, Seek, Write};
use std::path::Path;

use slate_sorted::{SortedMap, SortedSet};

use super::compression::{Compression, decompress};
use super::definitions::{Content, Definitions, chunk_head};
use super::ends::{header, intact_summary, is_covered};
use super::reader::Attachment;
use super::record::{
    AttachmentIndex, AttachmentRecord, Channel, Chunk, ChunkIndex, DataEnd, FRAME_SIZE, Footer, MessageIndex,
    MessageRecord, Metadata, MetadataIndex, Record, Records, Schema, Statistics, SummaryOffset,
    attachment_crc,
};
use super::repeated::{self, REPEATED};
use super::resume::{is_chain, is_plausible, next_record};
use super::source::{RecordFrame, RecordSource};
use super::{Error, MAXIMUM_RECORD, Writer, whole};

/// The most bytes that the fields of a chunk before its records can sensibly have.
const MAX_CHUNK_HEAD: u64 = 64;

/// Result of a repair.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Repaired {
    /// Number of messages of the new file.
    pub messages: u64,
    /// Number of chunks that were kept unchanged.
    pub chunks: u64,
    /// Messages of an unfinished last chunk, which has no checksum.
    pub unfinished: u64,
    /// Messages that no checksum covers, outside of chunks or in chunks without one.
    /// They count only if no checksum of the file covers them either.
    pub unchecked: u64,
    /// Attachments that were kept.
    pub attachments: u64,
    /// Records of metadata that were kept.
    pub metadata: u64,
    /// Parts left out.
    pub lost: Vec<Lost>,
}

impl Repaired {
    /// Returns true if nothing had to be repaired.
    fn is_clean(&self) -> bool {
        self.lost.is_empty() && self.unfinished + self.unchecked == 0
    }

    /// Returns the metadata of the new file.
    fn metadata_fields(&self) -> SortedMap<String, String> {
        let lost: u64 = self.lost.iter().map(|lost| lost.bytes).sum();
        let counts = [
            ("messages", self.messages),
            ("chunks", self.chunks),
            ("without_checksum", self.unfinished + self.unchecked),
            ("lost_bytes", lost),
        ];
        counts.into_iter().map(|(key, count)| (key.to_owned(), count.to_string())).collect()
    }
}

/// The metadata of a file that was repaired.
pub const REPAIR: &str = "repair";

/// A part of a damaged file that is not in the repaired one.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Lost {
    /// Offset of the part, bytes.
    pub offset: u64,
    /// Length of the part, bytes.
    pub bytes: u64,
    /// Reason.
    pub what: String,
}

/// Repairs a truncated or damaged file.
/// The result is `out`, or a new file in place of `path`.
///
/// All chunks whose checksum is right are kept byte for byte, the records of a last chunk that was not finished,
/// attachments whose checksum is right, and metadata; indexes, statistics and checksums are made anew. The old file
/// remains unchanged until the new one is complete on the disk.
///
/// # Errors
/// When a file can't be read or written, or was never an MCAP file.
pub fn repair(path: &Path, out: Option<&Path>) -> Result<Repaired, Error> {
    let file = File::open(path).map_err(|source| Error::Read { path: path.into(), source })?;
    let target = out.unwrap_or(path);
    let mut source = RecordSource::new(BufReader::with_capacity(1 << 16, file), path)?;
    whole::write(target, |out| salvage(&mut source, out, target))
}

/// Repairs as [`repair`], from any input, such as memory.
///
/// # Errors
/// When it can't be read or written, or was never an MCAP file.
pub fn repair_into(input: impl Read + Seek, out: impl Write) -> Result<Repaired, Error> {
    salvage(&mut RecordSource::new(input, Path::new("input"))?, out, Path::new("output"))
}

fn salvage<R: Read + Seek, W: Write>(
    source: &mut RecordSource<R>,
    out: W,
    target: &Path,
) -> Result<Repaired, Error> {
    let summary = intact_summary(source);
    let (header, start) = header(source)?;
    let mut repair = Repair {
        writer: Writer::new(out, target, &header, Compression::None)?,
        known: summary.map(|summary| summary.definitions).unwrap_or_default(),
        is_covered: is_covered(source)?,
        source,
        repaired: Repaired::default(),
        body: Vec::new(),
        records: Vec::new(),
    };
    repair.run(start)?;
    let Repair { mut writer, repaired, .. } = repair;
    if !repaired.is_clean() {
        // Readers of the new file must know which messages are unchecked.
        writer.metadata(&Metadata { name: REPAIR.into(), metadata: repaired.metadata_fields() })?;
    }
    writer.finish()?;
    Ok(repaired)
}

struct Repair<'a, R, W> {
    source: &'a mut RecordSource<R>,
    writer: Writer<W>,
    /// Definitions of the summary, for messages whose own definitions are lost.
    known: Definitions,
    repaired: Repaired,
    /// Set if the checksum of all data is right.
    is_covered: bool,
    body: Vec<u8>,
    records: Vec<u8>,
}

/// Continuation after a record.
enum RepairStep {
    /// Offset of the next record.
    On(u64),
    /// End of the data.
    End,
}

impl<R: Read + Seek, W: Write> Repair<'_, R, W> {
    fn run(&mut self, start: u64) -> Result<(), Error> {
        let mut offset = start;
        while offset < self.source.length() {
            match self.record(offset)? {
                Ok(RepairStep::On(next)) => offset = next,
                Ok(RepairStep::End) => break,
                Err(what) => {
                    let next = next_record(self.source, offset + 1)?.unwrap_or(self.source.length());
                    self.lose(offset, next, what);
                    offset = next;
                }
            }
        }
        Ok(())
    }

    /// Counts messages that no checksum of their own covers.
    fn mark_unverified(&mut self, messages: u64) {
        self.repaired.unchecked += if self.is_covered { 0 } else { messages };
    }

    fn lose(&mut self, offset: u64, end: u64, what: String) {
        if let Some(last) = self.repaired.lost.last_mut()
            && (last.offset + last.bytes, &last.what) == (offset, &what)
        {
            last.bytes = end - last.offset;
            return;
        }
        self.repaired.lost.push(Lost { offset, bytes: end - offset, what });
    }

    /// Keeps the record at an offset, or returns its fault.
    /// Only reading and writing itself fails.
    fn record(&mut self, offset: u64) -> Result<Result<RepairStep, String>, Error> {
        self.source.seek(offset)?;
        let framed = match self.source.frame() {
            Ok(frame) if frame.opcode != Chunk::OPCODE => {
                self.source.body(frame, &mut self.body)?;
                self.plain(frame)?
            }
            Ok(_) => Err("a chunk can't be read, or its checksum is another one".into()),
            Err(Error::Damaged { what, .. }) => Err(what),
            Err(error) => return Err(error),
        };
        let Err(what) = framed else { return Ok(framed) };
        // Its frame may be damaged.
        if let Some((chunk, end)) = self.sound_chunk(offset)? {
            self.keep_chunk(&chunk, offset, end)?;
            return Ok(Ok(RepairStep::On(end)));
        }
        if self.unfinished_chunk(offset)? {
            return Ok(Ok(RepairStep::End));
        }
        // A record whose frame is right is left out as a whole.
        self.source.seek(offset)?;
        let frame = match self.source.frame() {
            Ok(frame) => frame,
            Err(Error::Damaged { .. }) => return Ok(Err(what)),
            Err(error) => return Err(error),
        };
        let is_framed = frame.opcode == Chunk::OPCODE && self.is_framed(frame)?;
        if is_framed || is_chain(self.source, frame.end())? {
            self.lose(offset, frame.end(), what);
            return Ok(Ok(RepairStep::On(frame.end())));
        }
        Ok(Err(what))
    }

    /// Returns true if the lengths of a chunk agree with each other.
    fn is_framed(&mut self, frame: RecordFrame) -> Result<bool, Error> {
        self.source.part(frame.length.min(MAX_CHUNK_HEAD), &mut self.body)?;
        let head = chunk_head(&self.body);
        Ok(head.is_ok_and(|(_, compressed, rest)| {
            let fields = self.body.len() - rest.len();
            (fields as u64).checked_add(compressed) == Some(frame.length)
        }))
    }

    /// Keeps a record that is no chunk.
    fn plain(&mut self, frame: RecordFrame) -> Result<Result<RepairStep, String>, Error> {
        let body = std::mem::take(&mut self.body);
        let chunk_cache = self.keep_plain(frame, &body);
        self.body = body;
        chunk_cache
    }

    fn keep_plain(&mut self, frame: RecordFrame, body: &[u8]) -> Result<Result<RepairStep, String>, Error> {
        // A length that is wrong makes a message swallow others.
        let is_message = frame.opcode == MessageRecord::OPCODE;
        if is_message && !self.is_covered && !is_plausible(self.source, frame.end())? {
            return Ok(Err("no record follows where it should end".into()));
        }
        let checked = match frame.opcode {
            // No writer writes that; it is an index of a chunk with a wrong bit.
            MessageRecord::OPCODE if self.repaired.chunks > 0 && !self.is_covered => {
                Err("a message stands outside of the chunks".into())
            }
            Schema::OPCODE | Channel::OPCODE | MessageRecord::OPCODE => {
                return match self.keep_loose(frame.opcode, body)? {
                    Ok(messages) => {
                        self.mark_unverified(messages);
                        Ok(Ok(RepairStep::On(frame.end())))
                    }
                    Err(what) => Ok(Err(what)),
                };
            }
            AttachmentRecord::OPCODE => match AttachmentRecord::parse(body) {
                Ok(record) if record.crc == 0 || record.crc == attachment_crc(body) => {
                    self.repaired.attachments += 1;
                    self.writer.attachment(&Attachment {
                        log_time: record.log_time,
                        create_time: record.create_time,
                        name: record.name,
                        media_type: record.media_type,
                        data: record.data.to_vec(),
                    })?;
                    Ok(())
                }
                Ok(record) => Err(format!("the checksum of attachment `{}` does not match", record.name)),
                Err(what) => Err(what),
            },
            Metadata::OPCODE => match Metadata::parse(body) {
                Ok(metadata) => {
                    self.repaired.metadata += 1;
                    self.writer.metadata(&metadata)?;
                    Ok(())
                }
                Err(what) => Err(what),
            },
            DataEnd::OPCODE => {
                return Ok(DataEnd::parse(body).map(|_| RepairStep::End));
            }
            // All of these are made anew.
            MessageIndex::OPCODE => MessageIndex::parse(body).map(drop),
            ChunkIndex::OPCODE => ChunkIndex::parse(body).map(drop),
            AttachmentIndex::OPCODE => AttachmentIndex::parse(body).map(drop),
            MetadataIndex::OPCODE => MetadataIndex::parse(body).map(drop),
            Statistics::OPCODE => Statistics::parse(body).map(drop),
            SummaryOffset::OPCODE => SummaryOffset::parse(body).map(drop),
            Footer::OPCODE => Footer::parse(body).map(drop),
            // For messages of chunks that come, where that is lost which has defined their channels.
            REPEATED if repeated::sound(body).is_some() => {
                let mut known = self.known.clone();
                let sound = repeated::sound(body).unwrap_or(Ok(&[]));
                sound.and_then(|records| repeated::take(records, &mut known)).map(|()| self.known = known)
            }
            other => Err(format!("a record has the unknown opcode {other:#04x}")),
        };
        Ok(checked.map(|()| RepairStep::On(frame.end())))
    }

    /// Keeps a schema, a channel or a message; returns the number of messages.
    fn keep_loose(&mut self, opcode: u8, body: &[u8]) -> Result<Result<u64, String>, Error> {
        if opcode == MessageRecord::OPCODE {
            let MessageRecord { channel_id, sequence, log_time, publish_time, data } =
                match MessageRecord::parse(body) {
                    Ok(message) => message,
                    Err(what) => return Ok(Err(what)),
                };
            self.define(channel_id)?;
            if !self.writer.definitions().channels.contains_key(&channel_id) {
                return Ok(Err(format!(
                    "message {sequence} is of channel {channel_id}, which is not defined"
                )));
            }
            self.writer.message(channel_id, sequence, log_time, publish_time, data.0)?;
            self.repaired.messages += 1;
            return Ok(Ok(1));
        }
        let mut definitions = self.writer.definitions().clone();
        if let Err(what) = definitions.take(opcode, body) {
            return Ok(Err(what));
        }
        // The summary's definition has a checksum.
        let known = &self.known;
        let is_unknown = match opcode {
            Schema::OPCODE => definitions
                .schemas
                .iter()
                .any(|(id, schema)| known.schemas.get(id).is_some_and(|known| known != schema)),
            _ => definitions
                .channels
                .iter()
                .any(|(id, channel)| known.channels.get(id).is_some_and(|known| known != channel)),
        };
        if is_unknown {
            return Ok(Err("it defines something else than the summary".into()));
        }
        definitions.schemas.values().try_for_each(|schema| self.writer.schema(schema))?;
        definitions.channels.values().try_for_each(|channel| self.writer.channel(channel))?;
        Ok(Ok(0))
    }

    /// Writes the definition of a channel from the summary, if its own one is lost.
    fn define(&mut self, channel: u16) -> Result<(), Error> {
        if self.writer.definitions().channels.contains_key(&channel) {
            return Ok(());
        }
        let Some(channel) = self.known.channels.get(&channel) else { return Ok(()) };
        if let Some(schema) = self.known.schemas.get(&channel.schema_id)
            && !self.writer.definitions().schemas.contains_key(&schema.id)
        {
            self.writer.schema(schema)?;
        }
        if channel.schema_id == 0 || self.writer.definitions().schemas.contains_key(&channel.schema_id) {
            self.writer.channel(channel)?;
        }
        Ok(())
    }

    /// Returns a chunk whose records have the right checksum, and its end.
    /// Its frame and its other fields may be wrong. Its records are in `self.records` then, and as they are in the file
    /// in `self.body`.
    fn sound_chunk(&mut self, offset: u64) -> Result<Option<(Chunk<'static>, u64)>, Error> {
        self.source.seek(offset)?;
        self.source.part(FRAME_SIZE + MAX_CHUNK_HEAD, &mut self.body)?;
        let Some((frame, rest)) = self.body.split_first_chunk::<{ FRAME_SIZE as usize }>() else {
            return Ok(None);
        };
        let Ok((head, compressed, data)) = chunk_head(rest) else { return Ok(None) };
        let fields = (rest.len() - data.len()) as u64;
        let [opcode, length @ ..] = *frame;
        let framed = u64::from_le_bytes(length).checked_sub(fields);
        let start = offset + FRAME_SIZE + fields;
        let is_consistent = opcode == Chunk::OPCODE && framed == Some(compressed);
        let framed = framed.filter(|framed| opcode == Chunk::OPCODE || *framed != compressed);
        let said = Some(compressed).filter(|_| framed != Some(compressed));
        // At best all of it can be read; else the checksum says that what can be read is all.
        let mut cut: Option<(u64, Vec<u8>)> = None;
        for size in framed.into_iter().chain(said) {
            let end = start.saturating_add(size);
            if size > MAXIMUM_RECORD || end > self.source.length() {
                continue;
            }
            self.source.seek(start)?;
            self.source.part(size, &mut self.body)?;
            let known = ["", "lz4", "zstd"];
            let named = known.iter().filter(|name| **name == head.compression);
            let others = known.iter().filter(|_| !known.contains(&head.compression.as_str()));
            for compression in named.chain(others) {
                self.records.clear();
                // The lengths in its fields may be wrong.
                let read = decompress(compression, &self.body, MAXIMUM_RECORD, &mut self.records);
                let crc = crc32fast::hash(&self.records);
                let is_right = match head.uncompressed_crc {
                    0 => is_consistent && self.records.len() as u64 == head.uncompressed_size,
                    said => said == crc && (is_consistent || !self.records.is_empty()),
                };
                match read {
                    Ok(()) if is_right => {
                        let chunk = Chunk { compression: (*compression).into(), ..head };
                        return Ok(Some((chunk, end)));
                    }
                    Err(_) if is_right && cut.is_none() => cut = Some((end, self.records.clone())),
                    _ => {}
                }
            }
        }
        let Some((end, records)) = cut else { return Ok(None) };
        self.body.clone_from(&records);
        self.records = records;
        Ok(Some((Chunk { compression: String::new(), ..head }, end)))
    }

    /// Keeps the chunk that was just read.
    fn keep_chunk(&mut self, head: &Chunk, offset: u64, end: u64) -> Result<(), Error> {
        let records = std::mem::take(&mut self.records);
        let (mut defined, mut used) = (SortedSet::new(), SortedSet::new());
        for (_, opcode, body) in Records::new(&records).flatten() {
            if let (MessageRecord::OPCODE, Ok(message)) = (opcode, MessageRecord::parse(body)) {
                used.insert(message.channel_id);
            } else if let (Channel::OPCODE, Ok(channel)) = (opcode, Channel::parse(body)) {
                defined.insert(channel.id);
            }
        }
        used.difference(&defined).try_for_each(|channel| self.define(*channel))?;
        let mut definitions = self.writer.definitions().clone();
        match Content::read(&records, &mut definitions) {
            Ok(content) => {
                let chunk = Chunk {
                    message_start_time: content.times.0,
                    message_end_time: content.times.1,
                    uncompressed_size: records.len() as u64,
                    uncompressed_crc: crc32fast::hash(&records),
                    compression: head.compression.clone(),
                    records: &self.body,
                };
                self.writer.chunk(&chunk, &content, definitions)?;
                self.repaired.chunks += 1;
                self.repaired.messages += content.messages();
                if head.uncompressed_crc == 0 {
                    self.mark_unverified(content.messages());
                }
            }
            // Its definition is lost, or it was written wrong.
            Err(what) => {
                let messages = self.keep_records(&records)?;
                if head.uncompressed_crc == 0 {
                    self.mark_unverified(messages);
                }
                self.lose(offset, end, format!("{what}; {messages} messages of the chunk are kept"));
            }
        }
        self.records = records;
        Ok(())
    }

    /// Keeps the readable records one by one; returns the number of their messages.
    fn keep_records(&mut self, records: &[u8]) -> Result<u64, Error> {
        let mut messages = 0;
        for record in Records::new(records) {
            let Ok((_, opcode, body)) = record else { break };
            messages += self.keep_loose(opcode, body)?.unwrap_or(0);
        }
        Ok(messages)
    }

    /// Keeps the records of a truncated chunk at the end of the file, if there is one.
    fn unfinished_chunk(&mut self, offset: u64) -> Result<bool, Error> {
        self.source.seek(offset)?;
        self.source.part(FRAME_SIZE + MAX_CHUNK_HEAD, &mut self.body)?;
        let Some((frame, rest)) = self.body.split_first_chunk::<{ FRAME_SIZE as usize }>() else {
            return Ok(false);
        };
        let [opcode, length @ ..] = *frame;
        let length = u64::from_le_bytes(length);
        let Ok((head, compressed, data)) = chunk_head(rest) else { return Ok(false) };
        let fields = (rest.len() - data.len()) as u64;
        let end = offset.saturating_add(FRAME_SIZE).saturating_add(length);
        // Some writers fill in the lengths when the chunk is finished.
        let is_open = length == u64::MAX && compressed == u64::MAX;
        let is_cut = fields.checked_add(compressed) == Some(length) && end > self.source.length();
        if opcode != Chunk::OPCODE || !(is_open || is_cut) {
            return Ok(false);
        }
        self.source.seek(offset + FRAME_SIZE + fields)?;
        self.source.part(MAXIMUM_RECORD, &mut self.body)?;
        let mut records = Vec::new();
        // It ends too early, which is known; what can be read is there.
        let _ = decompress(&head.compression, &self.body, MAXIMUM_RECORD, &mut records);
        self.repaired.unfinished = self.keep_records(&records)?;
        let what =
            format!("the last chunk is not finished; {} messages of it are kept", self.repaired.unfinished);
        self.lose(offset, self.source.length(), what);
        Ok(true)
    }
}
