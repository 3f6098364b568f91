use std::io::Write;
use std::path::{Path, PathBuf};

use slate_sorted::SortedMap;

use super::compression::Compression;
use super::definitions::{Content, Definitions};
use super::outline::{attachment_index, chunk_index, metadata_index};
use super::reader::Attachment;
use super::record::{
    AttachmentIndex, AttachmentRecord, Channel, Chunk, ChunkIndex, DataEnd, Footer, Header, MAGIC,
    MessageIndex, MessageRecord, Metadata, MetadataIndex, Record, Rest, Schema, Statistics, SummaryOffset,
    attachment_crc,
};
use super::repeated::{REPEATED, Repeated};
use super::source::RecordFrame;
use super::{Error, MAXIMUM_RECORD};

/// Default size of the records of a chunk, bytes.
const CHUNK_SIZE: usize = 1 << 20;

/// Writes a file with all checksums, indexes and statistics that the format knows.
pub struct Writer<W> {
    out: W,
    path: PathBuf,
    position: u64,
    crc: crc32fast::Hasher,
    compression: Compression,
    /// Size of the records after which a chunk is closed, bytes.
    chunk_size: usize,
    definitions: Definitions,
    /// The records of the chunk that is open.
    records: Vec<u8>,
    content: Content,
    chunks: Vec<ChunkIndex>,
    attachments: Vec<AttachmentIndex>,
    metadata: Vec<MetadataIndex>,
    counts: SortedMap<u16, u64>,
    times: Option<(u64, u64)>,
    buffer: Vec<u8>,
}

impl<W: Write> Writer<W> {
    /// Begins a file; errors name it as `path`.
    ///
    /// # Errors
    /// When it can't be written, as for all calls.
    pub fn new(
        out: W,
        path: impl AsRef<Path>,
        header: &Header,
        compression: Compression,
    ) -> Result<Self, Error> {
        let mut writer = Self {
            out,
            path: path.as_ref().into(),
            position: 0,
            crc: crc32fast::Hasher::new(),
            compression,
            chunk_size: CHUNK_SIZE,
            definitions: Definitions::default(),
            records: Vec::new(),
            content: Content::default(),
            chunks: Vec::new(),
            attachments: Vec::new(),
            metadata: Vec::new(),
            counts: SortedMap::new(),
            times: None,
            buffer: Vec::new(),
        };
        writer.put(&MAGIC)?;
        writer.record(header)?;
        Ok(writer)
    }

    /// Closes chunks at another size of their records, in bytes.
    #[must_use]
    pub fn with_chunk_size(self, chunk_size: usize) -> Self {
        Self { chunk_size, ..self }
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.crc.update(bytes);
        self.position += bytes.len() as u64;
        let path = &self.path;
        self.out.write_all(bytes).map_err(|source| Error::Write { path: path.clone(), source })
    }

    /// Writes a record, and returns where.
    fn record<'a>(&mut self, record: &impl Record<'a>) -> Result<RecordFrame, Error> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        record.append(&mut buffer);
        let frame = RecordFrame {
            offset: self.position,
            opcode: buffer[0],
            length: buffer.len() as u64 - super::record::FRAME_SIZE,
        };
        let put = self.put(&buffer);
        self.buffer = buffer;
        put.map(|()| frame)
    }

    /// An error that names the file.
    pub fn unfit(&self, what: String) -> Error {
        Error::Unfit { path: self.path.clone(), what }
    }

    /// Returns the topic of a channel; empty if it is not defined.
    pub fn topic(&self, channel: u16) -> &str {
        self.definitions.channels.get(&channel).map_or("", |channel| channel.topic.as_str())
    }

    /// Definitions written so far.
    pub(super) fn definitions(&self) -> &Definitions {
        &self.definitions
    }

    /// Defines a schema, unless it is defined already.
    ///
    /// # Errors
    /// When another one has its number.
    pub fn schema(&mut self, schema: &Schema) -> Result<(), Error> {
        let known = self.definitions.schemas.len();
        self.definitions.add_schema(schema.clone()).map_err(|what| self.unfit(what))?;
        if self.definitions.schemas.len() > known {
            schema.append(&mut self.records);
        }
        Ok(())
    }

    /// Defines a channel, unless it is defined already; its schema is defined before.
    ///
    /// # Errors
    /// When another one has its number, or its schema is not known.
    pub fn channel(&mut self, channel: &Channel) -> Result<(), Error> {
        let known = self.definitions.channels.len();
        self.definitions.add_channel(channel.clone()).map_err(|what| self.unfit(what))?;
        if self.definitions.channels.len() > known {
            channel.append(&mut self.records);
        }
        Ok(())
    }

    /// Writes a message of the channel with that number.
    ///
    /// # Errors
    /// When there is no such channel, or the message is too long.
    pub fn message(
        &mut self,
        channel: u16,
        sequence: u32,
        log_time: u64,
        publish_time: u64,
        data: &[u8],
    ) -> Result<(), Error> {
        if !self.definitions.channels.contains_key(&channel) {
            return Err(self.unfit(format!("channel {channel} is not defined")));
        }
        if data.len() as u64 > MAXIMUM_RECORD / 2 {
            let what = format!("a message has {} bytes, and may have {}", data.len(), MAXIMUM_RECORD / 2);
            return Err(self.unfit(what));
        }
        if self.records.len().saturating_add(data.len()) > self.chunk_size {
            self.close_chunk()?;
        }
        let message =
            MessageRecord { channel_id: channel, sequence, log_time, publish_time, data: Rest(data) };
        self.content.add(self.records.len() as u64, &message);
        message.append(&mut self.records);
        Ok(())
    }

    /// Closes the open chunk, so that everything written is in the file.
    ///
    /// # Errors
    /// When it can't be written.
    pub fn close_chunk(&mut self) -> Result<(), Error> {
        if self.records.is_empty() {
            return Ok(());
        }
        let records = std::mem::take(&mut self.records);
        let content = std::mem::take(&mut self.content);
        let compressed = self
            .compression
            .compress(&records)
            .map_err(|source| Error::Write { path: self.path.clone(), source })?;
        let chunk = Chunk {
            message_start_time: content.times.0,
            message_end_time: content.times.1,
            uncompressed_size: records.len() as u64,
            uncompressed_crc: crc32fast::hash(&records),
            compression: self.compression.name().into(),
            records: &compressed,
        };
        self.write_chunk(&chunk, &content)?;
        self.records = records;
        self.records.clear();
        Ok(())
    }

    /// Closes the open chunk, and repeats definitions behind it.
    /// Damage of one chunk then leaves the others readable.
    ///
    /// # Errors
    /// When it can't be written.
    pub fn close_chunk_with(&mut self, repeated: &mut Repeated) -> Result<(), Error> {
        self.close_chunk()?;
        let Some(body) = repeated.take() else { return Ok(()) };
        self.put(&[REPEATED])?;
        self.put(&(body.len() as u64).to_le_bytes())?;
        self.put(&body)
    }

    /// Closes the open chunk and flushes the output.
    ///
    /// # Errors
    /// When it can't be written.
    pub fn flush(&mut self) -> Result<(), Error> {
        self.close_chunk()?;
        self.out.flush().map_err(|source| Error::Write { path: self.path.clone(), source })
    }

    /// Writes a chunk unchanged from another file.
    /// Its content, and what is defined after it, are given.
    pub(super) fn chunk(
        &mut self,
        chunk: &Chunk,
        content: &Content,
        definitions: Definitions,
    ) -> Result<(), Error> {
        self.close_chunk()?;
        self.definitions = definitions;
        self.write_chunk(chunk, content)
    }

    fn write_chunk(&mut self, chunk: &Chunk, content: &Content) -> Result<(), Error> {
        let frame = self.record(chunk)?;
        let mut index = chunk_index(frame, chunk).map_err(|what| self.unfit(what))?;
        for (channel_id, entries) in &content.index {
            let frame = self.record(&MessageIndex { channel_id: *channel_id, records: entries.clone() })?;
            index.message_index_offsets.insert(*channel_id, frame.offset);
            index.message_index_length += frame.size();
            *self.counts.entry(*channel_id).or_default() += entries.len() as u64;
        }
        if !content.index.is_empty() {
            let (from, to) = content.times;
            self.times = Some(self.times.map_or((from, to), |times| (times.0.min(from), times.1.max(to))));
        }
        self.chunks.push(index);
        Ok(())
    }

    /// Writes an attachment.
    ///
    /// # Errors
    /// When it is too long, or can't be written.
    pub fn attachment(&mut self, attachment: &Attachment) -> Result<(), Error> {
        if attachment.data.len() as u64 > MAXIMUM_RECORD / 2 {
            return Err(self.unfit(format!("attachment `{}` is too long", attachment.name)));
        }
        self.close_chunk()?;
        let mut record = AttachmentRecord {
            log_time: attachment.log_time,
            create_time: attachment.create_time,
            name: attachment.name.clone(),
            media_type: attachment.media_type.clone(),
            data: &attachment.data,
            crc: 0,
        };
        let mut fields = Vec::new();
        record.write_fields(&mut fields);
        record.crc = attachment_crc(&fields);
        let frame = self.record(&record)?;
        self.attachments.push(attachment_index(frame, &record));
        Ok(())
    }

    /// Writes texts.
    ///
    /// # Errors
    /// When they can't be written.
    pub fn metadata(&mut self, metadata: &Metadata) -> Result<(), Error> {
        self.close_chunk()?;
        let frame = self.record(metadata)?;
        self.metadata.push(metadata_index(frame, metadata));
        Ok(())
    }

    /// Writes the summary and the end, and returns the output.
    ///
    /// # Errors
    /// When it can't be written.
    pub fn finish(mut self) -> Result<W, Error> {
        self.close_chunk()?;
        let data_section_crc = self.crc.clone().finalize();
        self.record(&DataEnd { data_section_crc })?;
        self.crc.reset();
        let summary_start = self.position;
        let definitions = std::mem::take(&mut self.definitions);
        let (from, to) = self.times.unwrap_or_default();
        let count = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
        let statistics = Statistics {
            message_count: self.counts.values().sum(),
            schema_count: u16::try_from(definitions.schemas.len()).unwrap_or(u16::MAX),
            channel_count: count(definitions.channels.len()),
            attachment_count: count(self.attachments.len()),
            metadata_count: count(self.metadata.len()),
            chunk_count: count(self.chunks.len()),
            message_start_time: from,
            message_end_time: to,
            channel_message_counts: std::mem::take(&mut self.counts),
        };
        let (chunks, attachments, metadata) = (
            std::mem::take(&mut self.chunks),
            std::mem::take(&mut self.attachments),
            std::mem::take(&mut self.metadata),
        );
        let groups = [
            self.group(definitions.schemas.values().map(AsRef::as_ref))?,
            self.group(definitions.channels.values().map(AsRef::as_ref))?,
            self.group([statistics].iter())?,
            self.group(chunks.iter())?,
            self.group(attachments.iter())?,
            self.group(metadata.iter())?,
        ];
        let summary_offset_start = self.position;
        for group in groups.into_iter().flatten() {
            self.record(&group)?;
        }
        let mut footer = Footer { summary_start, summary_offset_start, summary_crc: 0 };
        let mut bytes = Vec::new();
        footer.append(&mut bytes);
        self.crc.update(&bytes[..bytes.len() - 4]);
        footer.summary_crc = self.crc.clone().finalize();
        self.record(&footer)?;
        self.put(&MAGIC)?;
        self.flush()?;
        Ok(self.out)
    }

    /// Writes records of one kind, and returns their place, if there are any.
    fn group<'a, 'b, T: Record<'a> + 'b>(
        &mut self,
        records: impl Iterator<Item = &'b T>,
    ) -> Result<Option<SummaryOffset>, Error> {
        let start = self.position;
        for record in records {
            self.record(record)?;
        }
        let length = self.position - start;
        let offset = SummaryOffset { group_opcode: T::OPCODE, group_start: start, group_length: length };
        Ok((length > 0).then_some(offset))
    }
}
