//! First pass over a file: the sequence of its records, and their checksums.
//! It checks every checksum that can be checked without looking into a chunk.

use std::io::{Read, Seek};

use super::record::{
    AttachmentIndex, AttachmentRecord, Channel, Chunk, ChunkIndex, DataEnd, Header, MAGIC, MessageIndex,
    MessageRecord, Metadata, MetadataIndex, Record, Schema, attachment_crc,
};
use super::repeated::{self, REPEATED};
use super::source::{RecordFrame, RecordSource};
use super::summary::Summary;
use super::tail::{is_cut_behind_data, next_or_cut};
use super::{Error, MAXIMUM_RECORD};

/// Outline of a file, without the content of its chunks.
#[derive(Debug, Default)]
pub(super) struct Outline {
    pub header: Header,
    /// Offset of the data, after the header.
    pub data: u64,
    /// Expected index of each chunk.
    pub chunks: Vec<ChunkIndex>,
    pub attachments: Vec<AttachmentIndex>,
    pub metadata: Vec<MetadataIndex>,
    /// Number of private records of the writer.
    pub private: u64,
    pub summary: Summary,
    /// Parts that no checksum covers, in words.
    pub unchecked: Vec<&'static str>,
    /// Set if messages or definitions are outside of chunks.
    pub is_loose: bool,
    /// Offset of the first truncated or missing record, if any.
    pub cut: Option<u64>,
}

impl Outline {
    /// Reads the outline of a file, which may be truncated if `may_be_cut`.
    pub fn read<R: Read + Seek>(source: &mut RecordSource<R>, may_be_cut: bool) -> Result<Self, Error> {
        let mut outline = Self::default();
        let mut body = Vec::new();
        magic(source)?;
        let frame = source.frame()?;
        if frame.opcode != Header::OPCODE {
            return Err(source.damaged(frame.offset, "the first record is not a header"));
        }
        source.body(frame, &mut body)?;
        outline.header = source.parse(frame, &body)?;
        outline.data = source.position();
        outline.read_data(source, &mut body, may_be_cut)?;
        let behind = source.position();
        if let Some(start) = outline.cut {
            outline.summary.start = start;
            return Ok(outline);
        }
        match Summary::read(source, &mut body) {
            Ok(summary) => outline.summary = summary,
            Err(Error::Damaged { .. }) if may_be_cut && is_cut_behind_data(source, behind)? => {
                outline.cut = Some(behind);
                outline.summary.start = behind;
            }
            Err(error) => return Err(error),
        }
        outline.check_summary(source)?;
        Ok(outline)
    }

    /// Reads until the data end.
    fn read_data<R: Read + Seek>(
        &mut self,
        source: &mut RecordSource<R>,
        body: &mut Vec<u8>,
        may_be_cut: bool,
    ) -> Result<(), Error> {
        let mut previous = Header::OPCODE;
        let (mut chunk_crcs, mut attachment_crcs) = (true, true);
        loop {
            let crc = source.crc.clone().finalize();
            let offset = source.position();
            let frame = match may_be_cut {
                true => next_or_cut(source, body)?,
                false => {
                    let frame = source.frame()?;
                    source.body(frame, body)?;
                    Some(frame)
                }
            };
            let Some(frame) = frame else {
                self.cut = Some(offset);
                self.mark_unverified(chunk_crcs, attachment_crcs);
                return Ok(());
            };
            let damaged = |what: String| source.damaged(frame.offset, what);
            match frame.opcode {
                Schema::OPCODE | Channel::OPCODE | MessageRecord::OPCODE => {
                    self.is_loose = true;
                }
                Chunk::OPCODE => {
                    let chunk: Chunk = source.parse(frame, body)?;
                    chunk_crcs &= chunk.uncompressed_crc != 0;
                    self.chunks.push(chunk_index(frame, &chunk).map_err(damaged)?);
                }
                MessageIndex::OPCODE if [Chunk::OPCODE, MessageIndex::OPCODE].contains(&previous) => {
                    self.note_index(frame, &source.parse(frame, body)?).map_err(damaged)?;
                }
                MessageIndex::OPCODE => {
                    return Err(damaged("a message index follows no chunk".into()));
                }
                AttachmentRecord::OPCODE => {
                    let attachment: AttachmentRecord = source.parse(frame, body)?;
                    attachment_crcs &= attachment.crc != 0;
                    if attachment.crc != 0 && attachment.crc != attachment_crc(body) {
                        let name = &attachment.name;
                        return Err(damaged(format!("the checksum of attachment `{name}` does not match")));
                    }
                    self.attachments.push(attachment_index(frame, &attachment));
                }
                Metadata::OPCODE => {
                    let metadata: Metadata = source.parse(frame, body)?;
                    self.metadata.push(metadata_index(frame, &metadata));
                }
                DataEnd::OPCODE => {
                    let end: DataEnd = source.parse(frame, body)?;
                    let recorded = end.data_section_crc;
                    return match recorded {
                        0 => {
                            self.mark_unverified(chunk_crcs, attachment_crcs);
                            Ok(())
                        }
                        _ if crc == recorded => Ok(()),
                        _ => Err(damaged(format!(
                            "the checksum of all before it is {crc:08x} and should be {recorded:08x}"
                        ))),
                    };
                }
                private if private >= 0x80 => {
                    self.private += 1;
                    if private == REPEATED {
                        repeated::sound(body).transpose().map_err(damaged)?;
                    }
                }
                other => {
                    return Err(damaged(format!("a record of opcode {other:#04x} is not allowed here")));
                }
            }
            previous = frame.opcode;
        }
    }

    /// Notes a message index of the last chunk.
    fn note_index(&mut self, frame: RecordFrame, index: &MessageIndex) -> Result<(), String> {
        let Some(chunk) = self.chunks.last_mut() else { return Ok(()) };
        chunk.message_index_length += frame.size();
        match chunk.message_index_offsets.insert(index.channel_id, frame.offset) {
            Some(_) => Err(format!("a chunk has two message indexes of channel {}", index.channel_id)),
            None => Ok(()),
        }
    }

    /// Notes the parts without a checksum when the data section has none.
    fn mark_unverified(&mut self, has_chunk_crcs: bool, has_attachment_crcs: bool) {
        self.unchecked.extend((!has_chunk_crcs).then_some("chunks"));
        self.unchecked.extend((!has_attachment_crcs).then_some("attachments"));
        self.unchecked.extend(self.is_loose.then_some("records outside of chunks"));
        self.unchecked.extend((!self.metadata.is_empty()).then_some("metadata"));
    }

    /// Checks the summary against the records found.
    fn check_summary<R: Read + Seek>(&mut self, source: &RecordSource<R>) -> Result<(), Error> {
        let summary = &self.summary;
        let what = if !agrees(&summary.chunks, &self.chunks) {
            "the indexes of chunks do not match the chunks"
        } else if !agrees(&summary.attachments, &self.attachments) {
            "the indexes of attachments do not match the attachments"
        } else if !agrees(&summary.metadata, &self.metadata) {
            "the indexes of metadata do not match the metadata"
        } else if summary.statistics.as_ref().is_some_and(|statistics| {
            let counted = [self.attachments.len(), self.metadata.len(), self.chunks.len()];
            let recorded = [statistics.attachment_count, statistics.metadata_count, statistics.chunk_count];
            counted.map(|count| count as u64) != recorded.map(u64::from)
        }) {
            "the statistics do not match the count of chunks, attachments or metadata"
        } else {
            if summary.crc == 0 && !summary.is_empty() {
                self.unchecked.push("summary");
            }
            return Ok(());
        };
        Err(source.damaged(summary.start, what))
    }
}

/// Returns true if the indexes are absent or the expected ones, in any order.
fn agrees<T: Clone + PartialEq + FileOffset>(recorded: &[T], found: &[T]) -> bool {
    let mut recorded = recorded.to_vec();
    recorded.sort_by_key(T::offset);
    recorded.is_empty() || recorded == found
}

trait FileOffset {
    fn offset(&self) -> u64;
}

impl FileOffset for ChunkIndex {
    fn offset(&self) -> u64 {
        self.chunk_start_offset
    }
}

impl FileOffset for AttachmentIndex {
    fn offset(&self) -> u64 {
        self.offset
    }
}

impl FileOffset for MetadataIndex {
    fn offset(&self) -> u64 {
        self.offset
    }
}

/// Reads the first bytes.
pub(super) fn magic<R: Read + Seek>(source: &mut RecordSource<R>) -> Result<(), Error> {
    let mut bytes = Vec::new();
    source.part(MAGIC.len() as u64, &mut bytes)?;
    if bytes == MAGIC {
        return Ok(());
    }
    let what = match bytes.is_empty() {
        true => "it is empty".into(),
        false => format!("it begins with {:02x?} and should with {MAGIC:02x?}", &bytes[..]),
    };
    Err(Error::NoBag { path: source.path().into(), what })
}

/// Returns the index of a chunk, without its message indexes, which follow it.
pub(super) fn chunk_index(frame: RecordFrame, chunk: &Chunk) -> Result<ChunkIndex, String> {
    let (size, length) = (chunk.records.len() as u64, chunk.uncompressed_size);
    if length > MAXIMUM_RECORD {
        return Err(format!("a chunk has {length} bytes of records, and at most {MAXIMUM_RECORD} are read"));
    }
    if chunk.compression.is_empty() && size != length {
        return Err(format!("a chunk has {size} bytes of records and should have {length}"));
    }
    Ok(ChunkIndex {
        message_start_time: chunk.message_start_time,
        message_end_time: chunk.message_end_time,
        chunk_start_offset: frame.offset,
        chunk_length: frame.size(),
        compression: chunk.compression.clone(),
        compressed_size: size,
        uncompressed_size: length,
        ..ChunkIndex::default()
    })
}

pub(super) fn attachment_index(frame: RecordFrame, attachment: &AttachmentRecord) -> AttachmentIndex {
    AttachmentIndex {
        offset: frame.offset,
        length: frame.size(),
        log_time: attachment.log_time,
        create_time: attachment.create_time,
        data_size: attachment.data.len() as u64,
        name: attachment.name.clone(),
        media_type: attachment.media_type.clone(),
    }
}

pub(super) fn metadata_index(frame: RecordFrame, metadata: &Metadata) -> MetadataIndex {
    MetadataIndex { offset: frame.offset, length: frame.size(), name: metadata.name.clone() }
}
