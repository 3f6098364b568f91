use std::io::Write;
use std::path::Path;

use slate_blackboard::interface::{Descriptor, Interface, View};
use slate_interfaces::LaserScan;
use slate_sorted::SortedMap;

use slate_bag::{Channel, Compression, Error, Header, Metadata, Schema, Writer};
use slate_ros_messages::{self as ros, Definition};

/// A recording that is made of a log.
pub(super) struct Output<W> {
    writer: Writer<W>,
    topics: SortedMap<String, Topic>,
    /// Schemas by name and definition.
    schemas: SortedMap<(String, String), u16>,
    buffer: Vec<u8>,
    messages: u64,
}

struct Topic {
    id: u16,
    sequence: u32,
}

/// Scan of a laser, in the order of the beams.
pub(super) struct Sweep<'a> {
    /// Direction of the first beam, radians.
    pub angle_min: f64,
    /// Angle from beam to beam, radians.
    pub angle_increment: f64,
    /// Minimum range, meters.
    pub range_min: f64,
    /// Maximum range, meters.
    pub range_max: f64,
    /// Ranges, meters.
    pub ranges: &'a [f32],
}

impl<W: Write> Output<W> {
    pub fn new(out: W, path: &Path) -> Result<Self, Error> {
        let library = concat!("slate ", env!("CARGO_PKG_VERSION"));
        let header = Header { profile: "ros2".into(), library: library.into() };
        let writer = Writer::new(out, path, &header, Compression::Lz4)?;
        let (topics, schemas) = (SortedMap::new(), SortedMap::new());
        Ok(Self { writer, topics, schemas, buffer: Vec::new(), messages: 0 })
    }

    /// Writes a message whose definition is at hand when its topic is new.
    pub fn message(
        &mut self,
        topic: &str,
        time: u64,
        definition: impl FnOnce() -> Definition,
        data: &[u8],
    ) -> Result<(), Error> {
        self.message_of(topic, topic, time, definition, data)
    }

    /// Writes a message of a topic that may have messages of several types.
    /// `key` tells the types apart; otherwise as [`message`](Self::message).
    pub fn message_of(
        &mut self,
        key: &str,
        topic: &str,
        time: u64,
        definition: impl FnOnce() -> Definition,
        data: &[u8],
    ) -> Result<(), Error> {
        if !self.topics.contains_key(key) {
            let id = self.channel(topic, definition())?;
            self.topics.insert(key.into(), Topic { id, sequence: 0 });
        }
        let Some(known) = self.topics.get_mut(key) else { return Ok(()) };
        let (id, sequence) = (known.id, known.sequence);
        known.sequence = sequence.wrapping_add(1);
        self.messages += 1;
        self.writer.message(id, sequence, time, time, data)
    }

    fn channel(&mut self, topic: &str, definition: Definition) -> Result<u16, Error> {
        let full = |_| self.writer.unfit("it would have more than 65535 topics".into());
        let id = u16::try_from(self.topics.len() + 1).map_err(full)?;
        let next = u16::try_from(self.schemas.len() + 1).map_err(full)?;
        let key = (definition.name.clone(), definition.text.clone());
        let schema_id = *self.schemas.entry(key).or_insert(next);
        let (name, data) = (definition.name, definition.text.into_bytes());
        self.writer.schema(&Schema { id: schema_id, name, encoding: "ros2msg".into(), data })?;
        let (topic, message_encoding) = (topic.into(), "cdr".into());
        self.writer.channel(&Channel {
            id,
            schema_id,
            topic,
            message_encoding,
            metadata: SortedMap::new(),
        })?;
        Ok(id)
    }

    /// Returns the error of a recording that can't be written as wanted.
    pub fn unfit(&self, what: String) -> Error {
        self.writer.unfit(what)
    }

    /// Writes a value of an interface, in the form that recordings of Slate have.
    pub fn value<T: Interface + Copy>(&mut self, topic: &str, time: u64, value: &T) -> Result<(), Error> {
        let mut value = *value;
        self.memory(topic, time, T::DESCRIPTOR, View::of(&mut value).bytes())
    }

    pub fn sweep(&mut self, topic: &str, time: u64, sweep: &Sweep<'_>) -> Result<(), Error> {
        // As an interface with a tail lies in memory.
        let mut memory = Vec::with_capacity(32 + 4 * sweep.ranges.len());
        for number in [sweep.angle_min, sweep.angle_increment, sweep.range_min, sweep.range_max] {
            memory.extend(number.to_ne_bytes());
        }
        memory.extend(sweep.ranges.iter().flat_map(|range| range.to_ne_bytes()));
        self.memory(topic, time, LaserScan::DESCRIPTOR, &memory)
    }

    fn memory(
        &mut self,
        topic: &str,
        time: u64,
        descriptor: &'static Descriptor,
        memory: &[u8],
    ) -> Result<(), Error> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        let encoded = ros::encode(descriptor, memory, &mut buffer);
        let encoded = encoded.map_err(|error| self.writer.unfit(format!("`{topic}`: {error}")));
        let written =
            encoded.and_then(|()| self.message(topic, time, || ros::definition(descriptor), &buffer));
        self.buffer = buffer;
        written
    }

    pub fn metadata(&mut self, name: &str, metadata: SortedMap<String, String>) -> Result<(), Error> {
        self.writer.metadata(&Metadata { name: name.into(), metadata })
    }

    /// Ends the recording, and returns how many messages it has.
    pub fn finish(self) -> Result<u64, Error> {
        let mut out = self.writer.finish()?;
        // A failure is reported when the file is closed.
        let _ = out.flush();
        Ok(self.messages)
    }
}

/// CDR writer of a message whose definition is written by hand, little-endian.
pub(super) struct OutputBytes<'a>(ros::CdrWriter<'a>);

impl<'a> OutputBytes<'a> {
    pub fn new(out: &'a mut Vec<u8>) -> Self {
        out.clear();
        Self(ros::CdrWriter::new(out))
    }

    pub fn double(mut self, number: f64) -> Self {
        self.0.numbers(&number.to_ne_bytes(), 8);
        self
    }

    pub fn whole(mut self, number: i32) -> Self {
        self.0.numbers(&number.to_ne_bytes(), 4);
        self
    }

    pub fn singles(mut self, numbers: &[f32]) -> Self {
        // They are no more than the bytes of a line.
        self.0.length(numbers.len() as u32);
        for number in numbers {
            self.0.numbers(&number.to_ne_bytes(), 4);
        }
        self
    }

    /// Writes a text.
    /// It has no zero, because it was a word of a line.
    pub fn text(mut self, text: &str) -> Result<Self, ros::Error> {
        self.0.text(&text.replace('\0', " "))?;
        Ok(self)
    }
}
