mod location;

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;
use std::sync::Arc;

use super::compression::decompress;
use super::definitions::{Content, Definitions};
use super::outline::Outline;
use super::record::{
    AttachmentRecord, Channel, Chunk, DataEnd, Field, Header, MessageIndex, MessageRecord, Metadata, Record,
    RecordInput, Schema,
};
use super::source::{RecordFrame, RecordSource};
use super::{Error, seconds};
use location::ChunkCache;
pub use location::MessageLocation;
use slate_sorted::SortedMap;

/// Reader of the messages of a file, in file order, with all checks.
///
/// To open a file reads all of it once: how its records follow each other, the checksums of data, attachments and
/// summary. A chunk's checksum, all its records and its indexes are checked before a message of it is returned, and the
/// statistics at the end. So a damaged file is an [`Error`], before the first message that may be a wrong one. Memory is
/// that of the largest chunk, at most [`MAXIMUM_RECORD`](super::MAXIMUM_RECORD), and where messages are read again by their
/// places, of some more chunks.
///
/// ```no_run
/// use slate_bag::Reader;
///
/// let mut reader = Reader::open("run.mcap")?;
/// while let Some(message) = reader.next_message()? {
///     println!("{} {} {} bytes", message.log_time, message.channel.topic, message.data.len());
/// }
/// # Ok::<(), slate_bag::Error>(())
/// ```
pub struct Reader<R> {
    source: RecordSource<R>,
    outline: Outline,
    definitions: Definitions,
    /// Offset of the next record of the file.
    next: u64,
    /// Records of a chunk, or one outside of chunks, and the offset of the next one.
    records: Vec<u8>,
    offset: usize,
    /// Offset of these records in the file.
    at: u64,
    body: Vec<u8>,
    counts: SortedMap<u16, u64>,
    times: Option<(u64, u64)>,
    is_done: bool,
    chunk_cache: ChunkCache,
}

/// Message in a file.
#[derive(Clone, Debug)]
pub struct Message<'a> {
    /// Channel of the message.
    pub channel: &'a Arc<Channel>,
    /// Layout of the bytes, unless the channel does not say it.
    pub schema: Option<&'a Arc<Schema>>,
    /// Number among the messages of the channel, as counted by the writer.
    pub sequence: u32,
    /// Time of recording, nanoseconds.
    pub log_time: u64,
    /// Time of publication, nanoseconds.
    pub publish_time: u64,
    /// Bytes in the channel's encoding.
    pub data: &'a [u8],
}

/// A topic of a file.
#[derive(Clone, Debug)]
pub struct ChannelTopic {
    /// The topic.
    pub topic: String,
    /// The name of its schema; empty if it has none.
    pub schema: String,
    /// Number of messages returned so far.
    pub count: u64,
}

/// A file in a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Attachment {
    /// Time of recording, nanoseconds.
    pub log_time: u64,
    /// Time of creation, nanoseconds.
    pub create_time: u64,
    /// Name.
    pub name: String,
    /// Media type, such as `application/toml`.
    pub media_type: String,
    /// Content.
    pub data: Vec<u8>,
}

impl Reader<BufReader<File>> {
    /// Opens a file.
    ///
    /// # Errors
    /// When it can't be read, or is not a whole MCAP file.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::new(buffered(path.as_ref())?, path)
    }

    /// Opens a file that may be truncated, as that of a writer that was killed.
    /// It is read as far as its records are whole, and [`cut_off`](Reader::cut_off) returns the end of that part.
    /// Damage is an error as in any file.
    ///
    /// # Errors
    /// When it can't be read, or is neither a whole MCAP file nor the beginning of one.
    pub fn open_unfinished(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::unfinished(buffered(path.as_ref())?, path)
    }
}

fn buffered(path: &Path) -> Result<BufReader<File>, Error> {
    let file = File::open(path).map_err(|source| Error::Read { path: path.into(), source })?;
    Ok(BufReader::with_capacity(1 << 16, file))
}

impl<R: Read + Seek> Reader<R> {
    /// Creates a reader of a file or of memory; errors name it as `path`.
    ///
    /// # Errors
    /// When it can't be read, or is not a whole MCAP file.
    pub fn new(input: R, path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read(input, path.as_ref(), false)
    }

    /// Creates a reader as [`new`](Reader::new), of a file that may be truncated.
    ///
    /// # Errors
    /// When it can't be read, or is neither a whole MCAP file nor the beginning of one.
    pub fn unfinished(input: R, path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read(input, path.as_ref(), true)
    }

    fn read(input: R, path: &Path, may_be_cut: bool) -> Result<Self, Error> {
        let mut source = RecordSource::new(input, path)?;
        let outline = Outline::read(&mut source, may_be_cut)?;
        Ok(Self {
            source,
            next: outline.data,
            outline,
            definitions: Definitions::default(),
            records: Vec::new(),
            offset: 0,
            at: 0,
            body: Vec::new(),
            counts: SortedMap::new(),
            times: None,
            is_done: false,
            chunk_cache: ChunkCache::default(),
        })
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        self.source.path()
    }

    /// Returns the offset of the first incomplete record; `None` for a whole file.
    pub fn cut_off(&self) -> Option<u64> {
        self.outline.cut
    }

    /// Goes back to the first message.
    pub fn rewind(&mut self) {
        self.next = self.outline.data;
        self.definitions = Definitions::default();
        self.records.clear();
        self.counts.clear();
        (self.offset, self.times, self.is_done) = (0, None, false);
    }

    /// Returns the program that wrote the file, and its conventions.
    pub fn header(&self) -> &Header {
        &self.outline.header
    }

    pub(super) fn outline(&self) -> &Outline {
        &self.outline
    }

    /// Returns true if any chunk is compressed.
    pub fn is_compressed(&self) -> bool {
        self.outline.chunks.iter().any(|chunk| !chunk.compression.is_empty())
    }

    pub(super) fn length(&self) -> u64 {
        self.source.length()
    }

    /// Returns the channels defined so far; at the end, all of them.
    pub fn channels(&self) -> impl Iterator<Item = &Arc<Channel>> {
        self.definitions.channels.values()
    }

    /// Returns the schema of a channel, unless it has none.
    pub fn schema(&self, channel: &Channel) -> Option<&Arc<Schema>> {
        self.definitions.schemas.get(&channel.schema_id)
    }

    /// Returns the topics in the summary of the file, with the names of their schemas.
    /// Without a summary, those defined so far.
    pub fn topics(&self) -> Vec<ChannelTopic> {
        let said = &self.outline.summary.definitions;
        let known = if said.channels.is_empty() { &self.definitions } else { said };
        let schema =
            |channel: &Channel| known.schemas.get(&channel.schema_id).map(|schema| schema.name.clone());
        let topic = |channel: &Arc<Channel>| ChannelTopic {
            topic: channel.topic.clone(),
            schema: schema(channel).unwrap_or_default(),
            count: self.count(channel),
        };
        known.channels.values().map(topic).collect()
    }

    /// Returns the number of messages of a channel returned so far.
    pub(super) fn count(&self, channel: &Channel) -> u64 {
        self.counts.get(&channel.id).copied().unwrap_or(0)
    }

    /// Returns the earliest and the latest log time of the chunks read.
    pub(super) fn times(&self) -> Option<(u64, u64)> {
        self.times
    }

    /// Returns the log time of the first message, if the file says it in advance.
    pub fn start(&self) -> Option<u64> {
        let said = self.outline.summary.statistics.as_ref().filter(|statistics| statistics.message_count > 0);
        said.map(|statistics| statistics.message_start_time)
    }

    /// Returns the next message; `None` at the end.
    ///
    /// # Errors
    /// When the file is damaged, or can't be read.
    pub fn next_message(&mut self) -> Result<Option<Message<'_>>, Error> {
        let Some((start, end)) = self.find()? else { return Ok(None) };
        self.message(&self.records[start..end]).map(Some)
    }

    fn message<'a>(&'a self, record: &'a [u8]) -> Result<Message<'a>, Error> {
        // All of it was checked when it was read.
        let wrong = |what: String| self.source.damaged(self.next, what);
        let message = MessageRecord::parse(record).map_err(wrong)?;
        let Some(channel) = self.definitions.channels.get(&message.channel_id) else {
            return Err(wrong("a message has no channel".into()));
        };
        Ok(Message {
            channel,
            schema: self.definitions.schemas.get(&channel.schema_id),
            sequence: message.sequence,
            log_time: message.log_time,
            publish_time: message.publish_time,
            data: message.data.0,
        })
    }

    /// Returns the number of messages of each channel by the summary.
    /// `None` without such a summary.
    pub fn channel_counts(&self) -> Option<impl Iterator<Item = (&Arc<Channel>, u64)>> {
        let summary = &self.outline.summary;
        let counts = &summary.statistics.as_ref()?.channel_message_counts;
        let channels = summary.definitions.channels.iter();
        Some(channels.map(|(id, channel)| (channel, counts.get(id).copied().unwrap_or(0))))
    }

    /// Calls `take` for each message of these topics.
    /// Reads nothing but the chunks that have some; then it is at the first message. False, and nothing is read, if the
    /// file does not say which chunks these are.
    pub fn each_of(
        &mut self,
        topics: &[&str],
        mut take: impl FnMut(&Message<'_>) -> Result<(), Error>,
    ) -> Result<bool, Error> {
        let known = &self.outline.summary.definitions;
        let counted: u64 = self.channel_counts().map_or(0, |said| said.map(|(_, count)| count).sum());
        let is_indexed = self.outline.chunks.iter().all(|chunk| !chunk.message_index_offsets.is_empty());
        if counted == 0 || !is_indexed || self.outline.is_loose {
            return Ok(false);
        }
        let is_meant =
            |id: &u16| known.channels.get(id).is_none_or(|own| topics.contains(&own.topic.as_str()));
        let chunks = self.outline.chunks.iter();
        let chunks = chunks.filter(|chunk| chunk.message_index_offsets.keys().any(is_meant));
        let chunks: Vec<_> = chunks.map(|chunk| chunk.chunk_start_offset).collect();
        for start in chunks {
            // Definitions before the chunk come from the summary, which is checked when all data are read.
            self.definitions = self.outline.summary.definitions.clone();
            self.next = start;
            self.advance()?;
            while let Some((start, end)) = self.next_record() {
                let message = self.message(&self.records[start..end])?;
                if topics.contains(&message.channel.topic.as_str()) {
                    take(&message)?;
                }
            }
        }
        self.rewind();
        Ok(true)
    }

    /// Returns the range of the next message.
    fn find(&mut self) -> Result<Option<(usize, usize)>, Error> {
        loop {
            if let Some(found) = self.next_record() {
                return Ok(Some(found));
            }
            if self.is_done {
                return Ok(None);
            }
            self.is_done = !self.advance()?;
        }
    }

    /// Returns the range of the next message among the records already read.
    fn next_record(&mut self) -> Option<(usize, usize)> {
        while self.offset < self.records.len() {
            let mut rest = RecordInput(&self.records[self.offset..]);
            let opcode = u8::read(&mut rest).ok()?;
            let body: &[u8] = Field::read(&mut rest).ok()?;
            self.offset = self.records.len() - rest.0.len();
            if opcode == MessageRecord::OPCODE {
                return Some((self.offset - body.len(), self.offset));
            }
        }
        None
    }

    /// Reads the next records; false at the end of the data.
    fn advance(&mut self) -> Result<bool, Error> {
        self.records.clear();
        self.offset = 0;
        loop {
            if self.outline.cut == Some(self.next) {
                return Ok(false);
            }
            self.source.seek(self.next)?;
            let frame = self.source.frame()?;
            self.next = frame.end();
            self.at = frame.offset;
            match frame.opcode {
                Schema::OPCODE | Channel::OPCODE | MessageRecord::OPCODE => {
                    self.source.body(frame, &mut self.body)?;
                    self.records.extend(frame.bytes());
                    self.records.extend(&self.body);
                    self.content(frame)?;
                    return Ok(true);
                }
                Chunk::OPCODE => {
                    self.read_chunk(frame)?;
                    return Ok(true);
                }
                DataEnd::OPCODE => {
                    self.check_summary()?;
                    return Ok(false);
                }
                _ => {}
            }
        }
    }

    fn read_chunk(&mut self, frame: RecordFrame) -> Result<(), Error> {
        self.source.body(frame, &mut self.body)?;
        let times = self.unpack(frame)?;
        let content = self.content(frame)?;
        if content.times != times {
            let span = |(from, to)| format!("from {} s to {} s", seconds(from), seconds(to));
            let what =
                format!("in a chunk, messages are {} and should be {}", span(content.times), span(times));
            return Err(self.source.damaged(frame.offset, what));
        }
        self.read_indexes(frame, content)
    }

    /// Decompresses the records of a chunk that was read; returns their expected times.
    fn unpack(&mut self, frame: RecordFrame) -> Result<(u64, u64), Error> {
        let chunk: Chunk = self.source.parse(frame, &self.body)?;
        let damaged = |what: String| self.source.damaged(frame.offset, format!("in a chunk, {what}"));
        decompress(&chunk.compression, chunk.records, chunk.uncompressed_size, &mut self.records)
            .map_err(damaged)?;
        if self.records.len() as u64 != chunk.uncompressed_size {
            let (found, said) = (self.records.len(), chunk.uncompressed_size);
            return Err(damaged(format!("found {found} bytes of records, expected {said}")));
        }
        let (said, found) = (chunk.uncompressed_crc, crc32fast::hash(&self.records));
        if said != 0 && said != found {
            return Err(damaged(format!("the checksum of the records is {found:08x}, expected {said:08x}")));
        }
        Ok((chunk.message_start_time, chunk.message_end_time))
    }

    /// Checks the records that were read, and counts their messages.
    fn content(&mut self, frame: RecordFrame) -> Result<Content, Error> {
        let content = Content::read(&self.records, &mut self.definitions)
            .map_err(|what| self.source.damaged(frame.offset, what))?;
        for (channel, entries) in &content.index {
            *self.counts.entry(*channel).or_default() += entries.len() as u64;
        }
        if !content.index.is_empty() {
            let (from, to) = content.times;
            self.times = Some(self.times.map_or((from, to), |times| (times.0.min(from), times.1.max(to))));
        }
        Ok(content)
    }

    /// Checks the message indexes after a chunk: none, or those of all its messages.
    fn read_indexes(&mut self, chunk: RecordFrame, mut content: Content) -> Result<(), Error> {
        let mut is_indexed = false;
        loop {
            if self.outline.cut == Some(self.next) {
                // The chunk is whole, and what was to follow it is not there.
                return Ok(());
            }
            let frame = self.source.frame()?;
            if frame.opcode != MessageIndex::OPCODE {
                break;
            }
            self.source.body(frame, &mut self.body)?;
            self.next = frame.end();
            is_indexed = true;
            let mut index: MessageIndex = self.source.parse(frame, &self.body)?;
            let mut found = content.index.remove(&index.channel_id).unwrap_or_default();
            index.records.sort_unstable();
            found.sort_unstable();
            if index.records != found {
                let what = format!(
                    "the message index of channel {} does not match the chunk before it",
                    index.channel_id
                );
                return Err(self.source.damaged(frame.offset, what));
            }
        }
        match content.index.keys().next() {
            Some(channel) if is_indexed => {
                let what = format!("no message index of channel {channel} follows the chunk");
                Err(self.source.damaged(chunk.offset, what))
            }
            _ => Ok(()),
        }
    }

    /// Checks the summary against the chunks.
    fn check_summary(&self) -> Result<(), Error> {
        let summary = &self.outline.summary;
        let damaged = |what: &str| Err(self.source.damaged(summary.start, what));
        let mut all = self.definitions.clone();
        for schema in summary.definitions.schemas.values() {
            if all.add_schema(Schema::clone(schema)).is_err() {
                return damaged("a schema of the summary is another one than that of the data");
            }
        }
        for channel in summary.definitions.channels.values() {
            if all.add_channel(Channel::clone(channel)).is_err() {
                return damaged("a channel of the summary is another one than that of the data");
            }
        }
        let Some(statistics) = &summary.statistics else { return Ok(()) };
        let counts: SortedMap<u16, u64> =
            statistics.channel_message_counts.clone().into_iter().filter(|(_, count)| *count > 0).collect();
        let kinds = (u64::from(statistics.schema_count), u64::from(statistics.channel_count));
        let times = (statistics.message_start_time, statistics.message_end_time);
        if counts != self.counts || statistics.message_count != counts.values().sum::<u64>() {
            return damaged("the statistics count other messages than there are");
        }
        if kinds != (all.schemas.len() as u64, all.channels.len() as u64) {
            return damaged("the statistics count other schemas or channels than there are");
        }
        if times != self.times.unwrap_or_default() {
            return damaged("the statistics have other times than the messages");
        }
        Ok(())
    }

    /// Reads all metadata, in the order of the file.
    ///
    /// # Errors
    /// When the file can't be read any more.
    pub fn metadata(&mut self) -> Result<Vec<Metadata>, Error> {
        let places: Vec<_> = self.outline.metadata.iter().map(|index| index.offset).collect();
        let read = |offset| {
            let frame = self.record_at(offset)?;
            self.source.parse(frame, &self.body)
        };
        places.into_iter().map(read).collect()
    }

    /// Returns the number of attachments.
    pub fn attachments(&self) -> usize {
        self.outline.attachments.len()
    }

    /// Reads an attachment by its number in the file; `None` beyond the last.
    ///
    /// # Errors
    /// When the file can't be read any more.
    pub fn attachment(&mut self, number: usize) -> Result<Option<Attachment>, Error> {
        let Some(offset) = self.outline.attachments.get(number).map(|index| index.offset) else {
            return Ok(None);
        };
        let frame = self.record_at(offset)?;
        let record: AttachmentRecord = self.source.parse(frame, &self.body)?;
        Ok(Some(Attachment {
            log_time: record.log_time,
            create_time: record.create_time,
            name: record.name,
            media_type: record.media_type,
            data: record.data.to_vec(),
        }))
    }

    fn record_at(&mut self, offset: u64) -> Result<RecordFrame, Error> {
        self.source.seek(offset)?;
        let frame = self.source.frame()?;
        self.source.body(frame, &mut self.body)?;
        Ok(frame)
    }
}
