//! The file itself: pieces that are closed soon, each with its checksum.

use std::io::Write;
use std::sync::Arc;
use std::time::Duration;

use super::channels::{Channel, Sent};
use super::disk::{Disk, DiskQueue};
use super::hub::{FIRST_TOPIC_ID, Sink};
use super::messages::{self, TOPICS, Topic};
use super::run::RecordingHeader;
use slate_bag::{self as bag, Attachment, Compression, Header, Metadata, Repeated, Schema, Writer};
use slate_blackboard::{Access, Stamp};
use slate_ros_messages as ros;
use slate_sorted::SortedMap;

/// Path, schema and access of the values that a channel carries.
type ChannelKey = (String, u64, &'static str);

/// Limits of the data of a file that are not on the disk yet, bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Size at which a piece is closed, bytes.
    pub chunk: u64,
    /// Maximum size of the data queued for the disk, bytes.
    /// Two of the largest values may be queued besides.
    pub buffer: u64,
}

/// Name of the file in errors that no recorder names.
const RECORDING: &str = "recording";

/// Maximum time until the disk reports that nothing can be written at all.
const OPEN_TIMEOUT: Duration = Duration::from_secs(1);

/// An MCAP file that is being written.
pub(super) struct File {
    /// Writer of the file; `None` once it is closed.
    writer: Option<Writer<Disk>>,
    disk: Arc<DiskQueue>,
    /// Channels by their numbers at the recorder.
    channels: Vec<Option<u16>>,
    /// Channels of mailboxes, by number and sender.
    mailboxes: SortedMap<(u32, u32), u16>,
    others: SortedMap<u32, u16>,
    /// Schemas by name and definition.
    schemas: SortedMap<(String, String), u16>,
    /// Channels that were defined.
    channel_count: u16,
    /// Channels by their content.
    /// A property that is created anew, because links changed, continues in the channel of the one before.
    known: SortedMap<ChannelKey, u16>,
    /// Definitions of the current piece.
    repeated: Repeated,
    /// Offset from the agent's time to that of the file, nanoseconds.
    epoch: u64,
    limits: Limits,
    /// Bytes of the current piece.
    open: u64,
    scratch: Vec<u8>,
    pub values: u64,
    /// Set if the current piece has content that must not be lost.
    urgent: bool,
    /// Reason why nothing is written any more.
    failure: Option<String>,
    /// Number of drops, by channel, as last written.
    written_drops: SortedMap<String, u64>,
}

impl File {
    /// Creates a file with the preface of the run.
    pub fn create(
        writer: Box<dyn Write + Send>,
        recording_header: RecordingHeader,
        limits: Limits,
    ) -> Result<Self, String> {
        let (own, disk) = Disk::start(writer).map_err(|error| error.to_string())?;
        let header =
            Header { profile: "ros2".into(), library: format!("slate {}", env!("CARGO_PKG_VERSION")) };
        let bag = Writer::new(own, RECORDING, &header, Compression::None).map_err(text)?;
        let mut file = Self {
            // Pieces are closed here, by size and time.
            writer: Some(bag.with_chunk_size(usize::MAX)),
            disk,
            channels: Vec::new(),
            mailboxes: SortedMap::new(),
            others: SortedMap::new(),
            schemas: SortedMap::new(),
            channel_count: 0,
            known: SortedMap::new(),
            repeated: Repeated::default(),
            epoch: recording_header.epoch,
            limits,
            open: 0,
            scratch: Vec::new(),
            values: 0,
            urgent: false,
            failure: None,
            written_drops: SortedMap::new(),
        };
        for (name, metadata) in recording_header.metadata {
            file.metadata(name, metadata)?;
        }
        for (name, media_type, data) in recording_header.attachments {
            let attachment = Attachment {
                log_time: file.epoch,
                create_time: file.epoch,
                name,
                media_type: media_type.into(),
                data,
            };
            file.writer()?.attachment(&attachment).map_err(text)?;
        }
        file.writer()?.flush().map_err(text)?;
        // A disk that is slow is no reason not to begin.
        let _ = file.disk.settle(0, OPEN_TIMEOUT);
        file.disk.failure().map_or(Ok(file), Err)
    }

    fn writer(&mut self) -> Result<&mut Writer<Disk>, String> {
        self.writer.as_mut().ok_or_else(|| "it is closed".into())
    }

    fn metadata(&mut self, name: &str, metadata: SortedMap<String, String>) -> Result<(), String> {
        self.writer()?.metadata(&Metadata { name: name.into(), metadata }).map_err(text)
    }

    fn add(&mut self, channel: &Channel, sender: Option<u32>) -> Result<u16, String> {
        let access = match channel.access {
            Access::Output => "output",
            Access::Setting => "setting",
            Access::Messages => "messages",
        };
        let carried = (channel.path.clone(), channel.descriptor.hash, access);
        if let Some(id) = self.known.get(&carried) {
            return Ok(*id);
        }
        let mut metadata = SortedMap::from([
            ("access".to_owned(), access.to_owned()),
            ("hash".to_owned(), format!("{:016x}", channel.descriptor.hash)),
            ("repeats".to_owned(), channel.repeats().to_string()),
            ("offered_qos_profiles".to_owned(), String::new()),
        ]);
        metadata.extend(sender.map(|sender| ("sender".to_owned(), sender.to_string())));
        let from = sender.and_then(|sender| channel.sender_name(sender));
        metadata.extend(from.map(|from| ("from".to_owned(), format!("/{from}"))));
        let topic = format!("/{}", channel.path);
        let ros::Definition { name, text } = ros::definition(channel.descriptor);
        let id = self.define(&name, &text, &topic, metadata)?;
        // Mailboxes have a channel for each sender.
        if sender.is_none() {
            self.known.insert(carried, id);
        }
        Ok(id)
    }

    /// Adds a channel with its schema, which is repeated after the current piece.
    fn define(
        &mut self,
        schema: &str,
        definition: &str,
        topic: &str,
        metadata: SortedMap<String, String>,
    ) -> Result<u16, String> {
        let full = |what: &str| format!("a file has at most {} {what}", u16::MAX);
        let content = (schema.to_owned(), definition.to_owned());
        let next = u16::try_from(self.schemas.len() + 1).map_err(|_| full("schemas"))?;
        let schema_id = *self.schemas.entry(content).or_insert(next);
        let id = self.channel_count.checked_add(1).ok_or_else(|| full("channels"))?;
        let (name, data) = (schema.into(), definition.into());
        let schema = Schema { id: schema_id, name, encoding: "ros2msg".into(), data };
        let (topic, message_encoding) = (topic.into(), "cdr".into());
        let channel = bag::Channel { id, schema_id, topic, message_encoding, metadata };
        let writer = self.writer()?;
        writer.schema(&schema).and_then(|()| writer.channel(&channel)).map_err(text)?;
        self.channel_count = id;
        self.repeated.add(&schema, &channel);
        Ok(id)
    }

    fn other(&mut self, topic: &Topic) -> Result<u16, String> {
        if let Some(id) = self.others.get(&topic.id) {
            return Ok(*id);
        }
        let metadata = SortedMap::from([("offered_qos_profiles".to_owned(), String::new())]);
        let id = self.define(topic.schema, topic.definition, topic.name, metadata)?;
        self.others.insert(topic.id, id);
        Ok(id)
    }

    fn write(&mut self, channel_id: u16, stamp: Stamp, time: u64, bytes: &[u8]) -> Result<(), String> {
        // The format counts in 32 bits.
        let sequence = stamp.sequence as u32;
        let (log_time, publish_time) =
            (self.epoch.saturating_add(time), self.epoch.saturating_add(stamp.time));
        self.writer()?.message(channel_id, sequence, log_time, publish_time, bytes).map_err(text)?;
        self.open += MESSAGE_HEAD_SIZE + bytes.len() as u64;
        if self.open >= self.limits.chunk { self.close_piece() } else { Ok(()) }
    }

    /// Writes a value at a time in the file, that of its stamp or a later one.
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
            let own = self.other(topic)?;
            return self.write(own, stamp, time, bytes);
        };
        if let Some(Sent { time: sent, sender }) = channel.sent(bytes) {
            let own = match self.mailboxes.get(&(id, sender)) {
                Some(own) => *own,
                None => {
                    let own = self.add(channel, Some(sender))?;
                    *self.mailboxes.entry((id, sender)).or_insert(own)
                }
            };
            // It was sent, and then it was taken.
            return self.encode(own, channel, items, (Stamp { time: sent, ..stamp }, time), bytes);
        }
        let index = id as usize;
        if self.channels.len() <= index {
            self.channels.resize(index + 1, None);
        }
        let own = match self.channels[index] {
            Some(own) => own,
            None => {
                let own = self.add(channel, None)?;
                *self.channels[index].insert(own)
            }
        };
        self.urgent |= channel.descriptor.name == "ModuleState" && stamp.sequence > 1;
        self.encode(own, channel, items, (stamp, time), bytes)
    }

    fn encode(
        &mut self,
        own: u16,
        channel: &Channel,
        items: usize,
        (stamp, time): (Stamp, u64),
        bytes: &[u8],
    ) -> Result<(), String> {
        let mut scratch = std::mem::take(&mut self.scratch);
        scratch.clear();
        let encoded = channel.encode(items, bytes, &mut scratch).map_err(|error| error.to_string());
        let written = encoded.and_then(|()| self.write(own, stamp, time, &scratch));
        self.scratch = scratch;
        self.values += 1;
        written
    }

    /// Closes the current piece: its content is then handed over to the disk's thread.
    pub fn close_piece(&mut self) -> Result<(), String> {
        (self.open, self.urgent) = (0, false);
        let mut repeated = std::mem::take(&mut self.repeated);
        let closed = self.writer().and_then(|writer| {
            writer.close_chunk_with(&mut repeated).and_then(|()| writer.flush()).map_err(text)
        });
        self.repeated = repeated;
        closed
    }

    /// Returns true if the current piece has content.
    pub fn is_open(&self) -> bool {
        self.open > 0
    }

    pub fn is_urgent(&self) -> bool {
        self.urgent
    }

    /// Writes the number of a property's drops until then, if it has changed.
    pub fn write_drops(&mut self, path: &str, count: u64, time: u64) {
        let is_written = count == 0 || self.written_drops.get(path) == Some(&count);
        if is_written || self.failure.is_some() || !self.has_room(0) {
            return;
        }
        self.written_drops.insert(path.to_owned(), count);
        let message = messages::dropped(&format!("/{path}"), count);
        let id = self.other(&messages::DROPPED_TOPIC);
        let written = id.and_then(|id| {
            let stamp = Stamp { time, ..Stamp::default() };
            self.write(id, stamp, time, &message)
        });
        self.note(written);
    }

    /// Writes a value from before the file, at the time at which the file begins.
    pub fn write_initial(
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

    /// Returns true if `length` more bytes may be queued for the disk.
    pub fn has_room(&self, length: usize) -> bool {
        let (waiting, more) = (self.disk.waiting(), length as u64);
        waiting == 0 || waiting + self.open + more <= self.limits.buffer.max(2 * more)
    }

    /// Waits for the disk until it has room for more.
    pub fn settle(&mut self) {
        if self.failure.is_none() && !self.has_room(0) {
            let settled = self.disk.settle_in_time(self.limits.buffer / 2);
            self.note(settled);
        }
    }

    /// Returns the time that the disk has spent on the current piece.
    pub fn stall_duration(&self) -> Duration {
        self.disk.stall_duration()
    }

    /// Returns the reason why nothing can be written any more, if there is one.
    pub fn failure(&self) -> Option<String> {
        self.failure.clone().or_else(|| self.disk.failure())
    }

    /// Writes the list of properties that never had a value.
    pub fn write_unwritten(&mut self, unwritten: SortedMap<String, String>) -> Result<(), String> {
        self.metadata("unwritten", unwritten)
    }

    /// Writes the final metadata under `name` and the index; waits for the disk.
    pub fn end(&mut self, name: &str, end: SortedMap<String, String>) -> Result<(), String> {
        self.close_piece()?;
        let drops =
            self.written_drops.iter().map(|(path, count)| (format!("/{path}"), count.to_string())).collect();
        self.metadata("dropped", drops)?;
        self.metadata(name, end)?;
        if let Some(writer) = self.writer.take() {
            writer.finish().map_err(text)?;
        }
        self.disk.settle_in_time(0)
    }

    /// Returns the number of bytes of the closed pieces.
    pub fn closed(&self) -> u64 {
        self.disk.submitted()
    }

    /// Returns true if the operating system has the first `bytes` of pieces.
    pub fn has(&self, bytes: u64) -> bool {
        self.disk.has(bytes)
    }

    /// Returns the number of bytes of the file until now.
    pub fn bytes(&self) -> u64 {
        self.disk.bytes()
    }
}

impl Sink for File {
    fn value(&mut self, channel: Option<&Channel>, id: u32, items: usize, stamp: Stamp, bytes: &[u8]) {
        debug_assert!(channel.is_some() || id >= FIRST_TOPIC_ID);
        if self.failure.is_none() {
            let written = self.put(channel, id, items, (stamp, stamp.time), bytes);
            self.note(written);
        }
    }
}

/// Size of a message without its content, bytes.
const MESSAGE_HEAD_SIZE: u64 = 31;

/// Returns the text of an error; the recorder names the file.
fn text(error: bag::Error) -> String {
    match error {
        bag::Error::Write { source, .. } => source.to_string(),
        other => other.to_string(),
    }
}
