//! The file itself: pieces that are closed soon, each with its checksum.

use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::channels::Channel;
use super::lines::{OTHERS, Sink};
use super::messages::{self, TOPICS, Topic};
use super::run::Preface;
use crate::ros;
use mcap::records::MessageHeader;
use mcap::write::{Metadata, NoSeek};
use mcap::{Attachment, WriteOptions};
use slate_blackboard::interface::Descriptor;
use slate_blackboard::{Access, Stamp};

/// What a file is written through; it counts its bytes.
struct Counted {
    writer: BufWriter<Box<dyn Write + Send>>,
    bytes: Arc<AtomicU64>,
}

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let count = self.writer.write(bytes)?;
        self.bytes.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.writer.flush()
    }
}

/// Room for a whole piece, so that it is mostly one call of the system.
const BUFFER: usize = 256 << 10;

/// An MCAP file that is being written.
pub(super) struct File {
    writer: mcap::Writer<NoSeek<Counted>>,
    /// By the numbers of the channels.
    channels: Vec<Option<u16>>,
    others: BTreeMap<u32, u16>,
    /// What is added to the agent's time for the file's.
    epoch: u64,
    /// Bytes from which a piece is closed, and those of the present one.
    chunk: u64,
    open: u64,
    scratch: Vec<u8>,
    pub values: u64,
    bytes: Arc<AtomicU64>,
    /// Whether the present piece has something that must not be lost.
    urgent: bool,
    /// Why nothing is written any more.
    pub failure: Option<String>,
    /// By channel, as last said.
    told: BTreeMap<String, u64>,
}

impl File {
    /// Writes what is known before the run.
    pub fn create(writer: Box<dyn Write + Send>, preface: Preface, chunk: u64) -> Result<Self, String> {
        let counted = Counted { writer: BufWriter::with_capacity(BUFFER, writer), bytes: Arc::default() };
        let bytes = Arc::clone(&counted.bytes);
        let options = WriteOptions::new()
            .profile("ros2")
            .library(format!("slate {}", env!("CARGO_PKG_VERSION")))
            .compression(None)
            // Pieces are closed here, by size and time. They are kept in memory until then, as otherwise a file that
            // ends in one would have a piece of a wrong length.
            .chunk_size(None)
            .disable_seeking(true);
        let mut file = Self {
            writer: options.create(NoSeek::new(counted)).map_err(text)?,
            channels: Vec::new(),
            others: BTreeMap::new(),
            epoch: preface.epoch,
            chunk,
            open: 0,
            scratch: Vec::new(),
            values: 0,
            bytes,
            urgent: false,
            failure: None,
            told: BTreeMap::new(),
        };
        for (name, metadata) in preface.metadata {
            file.metadata(name, metadata).map_err(text)?;
        }
        for (name, media_type, data) in preface.attachments {
            let attachment = Attachment {
                log_time: file.epoch,
                create_time: file.epoch,
                name,
                media_type: media_type.into(),
                data: data.into(),
            };
            file.writer.attach(&attachment).map_err(text)?;
        }
        file.writer.flush().map_err(text)?;
        Ok(file)
    }

    fn metadata(&mut self, name: &str, metadata: BTreeMap<String, String>) -> Result<(), mcap::McapError> {
        self.writer.write_metadata(&Metadata { name: name.into(), metadata })
    }

    fn add(&mut self, channel: &Channel) -> Result<u16, mcap::McapError> {
        let schema = self.schema(channel.descriptor)?;
        let access = match channel.access {
            Access::Output => "output",
            Access::Setting => "setting",
            Access::Messages => "messages",
        };
        let metadata = BTreeMap::from([
            ("access".to_owned(), access.to_owned()),
            ("hash".to_owned(), format!("{:016x}", channel.descriptor.hash)),
            ("repeats".to_owned(), channel.repeats().to_string()),
            ("offered_qos_profiles".to_owned(), String::new()),
        ]);
        self.writer.add_channel(schema, &format!("/{}", channel.path), "cdr", &metadata)
    }

    fn schema(&mut self, descriptor: &'static Descriptor) -> Result<u16, mcap::McapError> {
        let definition = ros::definition(descriptor);
        self.writer.add_schema(&definition.name, "ros2msg", definition.text.as_bytes())
    }

    fn other(&mut self, topic: &Topic) -> Result<u16, mcap::McapError> {
        if let Some(id) = self.others.get(&topic.id) {
            return Ok(*id);
        }
        let schema = self.writer.add_schema(topic.schema, "ros2msg", topic.definition.as_bytes())?;
        let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), String::new())]);
        let id = self.writer.add_channel(schema, topic.name, "cdr", &metadata)?;
        self.others.insert(topic.id, id);
        Ok(id)
    }

    fn write(&mut self, channel_id: u16, stamp: Stamp, time: u64, bytes: &[u8]) -> Result<(), String> {
        // The format counts in 32 bits.
        let header = MessageHeader {
            channel_id,
            sequence: stamp.sequence as u32,
            log_time: self.epoch.saturating_add(time),
            publish_time: self.epoch.saturating_add(stamp.time),
        };
        self.writer.write_to_known_channel(&header, bytes).map_err(text)?;
        self.open += HEAD + bytes.len() as u64;
        if self.open >= self.chunk { self.close_piece() } else { Ok(()) }
    }

    /// A value that stands in the file at a time, which is that of its stamp or a later one.
    fn put(
        &mut self,
        channel: Option<&Channel>,
        id: u32,
        items: usize,
        (stamp, time): (Stamp, u64),
        bytes: &[u8],
    ) -> Result<(), String> {
        let Some(channel) = channel else {
            let Some(topic) = TOPICS.iter().find(|topic| topic.id == id) else { return Ok(()) };
            let own = self.other(topic).map_err(text)?;
            return self.write(own, stamp, time, bytes);
        };
        let index = id as usize;
        if self.channels.len() <= index {
            self.channels.resize(index + 1, None);
        }
        let own = match self.channels[index] {
            Some(own) => own,
            None => {
                let own = self.add(channel).map_err(text)?;
                *self.channels[index].insert(own)
            }
        };
        let mut scratch = std::mem::take(&mut self.scratch);
        scratch.clear();
        let encoded = channel.encode(items, bytes, &mut scratch).map_err(|error| error.to_string());
        let written = encoded.and_then(|()| self.write(own, stamp, time, &scratch));
        self.scratch = scratch;
        self.values += 1;
        self.urgent |= channel.descriptor.name == "ModuleState" && stamp.sequence > 1;
        written
    }

    /// Closes the present piece: what is in it is in the hands of the system then.
    pub fn close_piece(&mut self) -> Result<(), String> {
        (self.open, self.urgent) = (0, false);
        self.writer.flush().map_err(text)
    }

    /// Whether there is something in the present piece, and whether that must not wait.
    pub fn is_open(&self) -> bool {
        self.open > 0
    }

    pub fn is_urgent(&self) -> bool {
        self.urgent
    }

    /// Says how many values of a property were dropped until then, where that is news.
    pub fn tell_drops(&mut self, path: &str, count: u64, time: u64) {
        if count == 0 || self.told.get(path) == Some(&count) || self.failure.is_some() {
            return;
        }
        self.told.insert(path.to_owned(), count);
        let message = messages::dropped(&format!("/{path}"), count);
        let id = self.other(&messages::DROPPED).map_err(text);
        let written = id.and_then(|id| {
            let stamp = Stamp { time, ..Stamp::default() };
            self.write(id, stamp, time, &message)
        });
        self.note(written);
    }

    /// A value that was there before the file, at the time at which that begins.
    pub fn value_from_before(
        &mut self,
        channel: &Channel,
        id: u32,
        items: usize,
        (stamp, begin): (Stamp, u64),
        bytes: &[u8],
    ) {
        if self.failure.is_none() {
            let written = self.put(Some(channel), id, items, (stamp, begin.max(stamp.time)), bytes);
            self.note(written);
        }
    }

    /// Remembers why nothing can be written any more.
    pub fn note(&mut self, written: Result<(), String>) {
        if let Err(reason) = written {
            self.failure.get_or_insert(reason);
        }
    }

    /// Writes what is known at the end, under that name, and the index.
    pub fn end(&mut self, name: &str, end: BTreeMap<String, String>) -> Result<(), String> {
        let drops = self.told.iter().map(|(path, count)| (format!("/{path}"), count.to_string())).collect();
        self.metadata("dropped", drops).map_err(text)?;
        self.metadata(name, end).map_err(text)?;
        self.writer.finish().map(drop).map_err(text)
    }

    /// Bytes of the file until now.
    pub fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }
}

impl Sink for File {
    fn value(&mut self, channel: Option<&Channel>, id: u32, items: usize, stamp: Stamp, bytes: &[u8]) {
        debug_assert!(channel.is_some() || id >= OTHERS);
        if self.failure.is_none() {
            let written = self.put(channel, id, items, (stamp, stamp.time), bytes);
            self.note(written);
        }
    }
}

/// Bytes of a message beside what is in it.
const HEAD: u64 = 31;

/// What went wrong, as the system says it if it was the system.
fn text(error: mcap::McapError) -> String {
    match error {
        mcap::McapError::Io(error) => error.to_string(),
        other => other.to_string(),
    }
}
