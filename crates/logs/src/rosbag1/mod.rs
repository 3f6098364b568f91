//! Recordings of ROS 1: rosbag format 2.0.
//! Chunks are uncompressed, or compressed by bzip2 or LZ4.
//!
//! Messages become those of ROS 2: the same fields, but for the sequence number of a `std_msgs/Header`, which ROS 2 does not have.

mod definition;
mod message;
mod record;
mod resume;

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

use slate_sorted::SortedMap;

use self::message::Types;
use self::record::{BagRecord, Records};
use self::resume::next_chunk;
use super::output::Output;
use super::{Imported, Options};
use slate_bag::{Error, MAXIMUM_RECORD};
use slate_ros_messages::Definition;

/// First bytes of a file.
pub(super) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// Connection of a bag: topic and type of its messages.
struct BagConnection {
    topic: String,
    /// Types of the messages.
    /// `None` if the definition can't be read, which is reported.
    types: Option<Types>,
    definition: Definition,
    /// Connections of one topic and type are one channel.
    key: String,
}

pub(super) fn read<W: Write>(
    path: &Path,
    output: &mut Output<W>,
    options: &Options,
    imported: &mut Imported,
) -> Result<(), Error> {
    let failed = |source| Error::Read { path: path.into(), source };
    let mut input = BufReader::with_capacity(1 << 16, File::open(path).map_err(failed)?);
    let mut magic = [0; MAGIC.len()];
    input.read_exact(&mut magic).map_err(failed)?;
    if magic != *MAGIC {
        let what = "it does not begin with `#ROSBAG V2.0`; older ones are made new by `rosbag fix`".into();
        return Err(Error::Unfit { path: path.into(), what });
    }
    let connections = SortedMap::new();
    let mut log = Log { output, options, imported, path, connections, buffer: Vec::new(), index: None };
    let mut records = Records::new(input, MAGIC.len() as u64);
    let mut resumes = 0;
    loop {
        let offset = records.offset();
        match records.next() {
            Ok(None) => return log.end(offset),
            Ok(Some(record)) => log.record(record, offset, true)?,
            // Where the next record begins is not known, but what a chunk looks like is.
            Err(what) => {
                resumes += 1;
                let mut file = File::open(path).map_err(failed)?;
                let next =
                    next_chunk(&mut file, offset + 1).map_err(failed)?.filter(|_| resumes < MAX_RESUMPTIONS);
                let Some(next) = next else {
                    return log.wrong(offset, format!("{what}; nothing behind it can be read"));
                };
                log.wrong(offset, format!("{what}; a chunk that can be read begins at byte {next}"))?;
                file.seek(SeekFrom::Start(next)).map_err(failed)?;
                records = Records::new(BufReader::with_capacity(1 << 16, file), next);
            }
        }
    }
}

/// Maximum number of resumptions in a damaged file.
const MAX_RESUMPTIONS: u64 = 1000;

struct Log<'a, W> {
    output: &'a mut Output<W>,
    options: &'a Options,
    imported: &'a mut Imported,
    path: &'a Path,
    connections: SortedMap<u32, BagConnection>,
    buffer: Vec<u8>,
    /// Offset of the index at the end and its number of connections, from the header.
    index: Option<(u64, u64)>,
}

impl<W: Write> Log<'_, W> {
    /// Checks the end of the file.
    /// A file can end where a record does, and not be whole.
    fn end(&mut self, length: u64) -> Result<(), Error> {
        match self.index {
            Some((0, _)) => self.wrong(
                length,
                "it was not closed: its header has no index; `rosbag reindex` adds one".into(),
            ),
            Some((index, connections)) if index > length || (index == length && connections > 0) => {
                self.wrong(length, format!("it is cut off: its index should begin at byte {index}"))
            }
            Some(_) => Ok(()),
            None => self.wrong(length, "it has no head".into()),
        }
    }

    fn wrong(&mut self, offset: u64, what: String) -> Result<(), Error> {
        self.imported.wrong(self.options, Error::Damaged { path: self.path.into(), offset, what })
    }

    fn record(&mut self, record: BagRecord, offset: u64, is_outside: bool) -> Result<(), Error> {
        let done = match record.number(b"op", 1) {
            Ok(0x02) => return self.message(&record, offset),
            Ok(0x05) if is_outside => return self.chunk(&record, offset),
            Ok(0x07) => self.connection(&record),
            Ok(0x03) if is_outside => self.head(&record),
            // Indexes, and what is said of chunks.
            Ok(0x04 | 0x06) if is_outside => Ok(()),
            Ok(other) => Err(format!("a record of op {other:#04x} can't stand here")),
            Err(what) => Err(what),
        };
        done.or_else(|what| self.wrong(offset, what))
    }

    fn head(&mut self, record: &BagRecord) -> Result<(), String> {
        self.index = Some((record.number(b"index_pos", 8)?, record.number(b"conn_count", 4)?));
        Ok(())
    }

    fn chunk(&mut self, record: &BagRecord, offset: u64) -> Result<(), Error> {
        let unpacked = record.text(b"compression").and_then(|compression| {
            let size = record.number(b"size", 4)?;
            unpack(&compression, &record.data, size)
        });
        let bytes = match unpacked {
            Ok(bytes) => bytes,
            Err(what) => return self.wrong(offset, format!("a chunk: {what}")),
        };
        let mut records = Records::new(&bytes[..], 0);
        loop {
            let inside = records.offset();
            match records.next() {
                Ok(None) => return Ok(()),
                Ok(Some(record)) => self.record(record, offset, false)?,
                Err(what) => return self.wrong(offset, format!("at byte {inside} of a chunk: {what}")),
            }
        }
    }

    fn connection(&mut self, record: &BagRecord) -> Result<(), String> {
        let number = record.number(b"conn", 4)? as u32;
        if self.connections.contains_key(&number) {
            // It is said in each chunk that has messages of it, and at the end.
            return Ok(());
        }
        let about = BagRecord::fields(&record.data).map_err(|what| format!("connection {number}: {what}"))?;
        let about = BagRecord { header: about, data: Vec::new() };
        let (kind, text) = (about.text(b"type")?, about.text(b"message_definition")?);
        // The record itself has the topic after mapping.
        let topic = record.text(b"topic")?;
        let types = Types::parse(&kind, &text);
        let (types, definition) = match types {
            Ok(types) => {
                let definition = types.definition(&kind);
                (Some(types), definition)
            }
            Err(what) => {
                let what = format!("the definition of `{kind}` of `{topic}`: {what}");
                let connection = BagConnection {
                    topic,
                    types: None,
                    definition: Definition::default(),
                    key: String::new(),
                };
                self.connections.insert(number, connection);
                return Err(what);
            }
        };
        let key = format!("{topic}\n{}\n{}", definition.name, definition.text);
        self.connections.insert(number, BagConnection { topic, types, definition, key });
        Ok(())
    }

    fn message(&mut self, record: &BagRecord, offset: u64) -> Result<(), Error> {
        let head =
            record.number(b"conn", 4).and_then(|number| Ok((number as u32, record.number(b"time", 8)?)));
        let (number, time) = match head {
            Ok(head) => head,
            Err(what) => return self.wrong(offset, what),
        };
        let Some(connection) = self.connections.get(&number) else {
            return self.wrong(
                offset,
                format!("a message is of connection {number}, which is not described before it"),
            );
        };
        let Some(types) = &connection.types else {
            // The reason is reported.
            self.imported.unread(&connection.topic);
            return Ok(());
        };
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        // Seconds and nanoseconds, as two numbers of 32 bits.
        let time = (time & 0xffff_ffff) * 1_000_000_000 + (time >> 32);
        let written = match types.convert(&record.data, &mut buffer) {
            Ok(()) => {
                let definition = || connection.definition.clone();
                self.output.message_of(&connection.key, &connection.topic, time, definition, &buffer)
            }
            Err(what) => {
                let what = format!("a message of `{}`: {what}", connection.topic);
                self.wrong(offset, what)
            }
        };
        self.buffer = buffer;
        written
    }
}

/// Returns the records of a chunk.
fn unpack(compression: &str, bytes: &[u8], size: u64) -> Result<Vec<u8>, String> {
    if size > MAXIMUM_RECORD {
        return Err(format!("it should have {size} bytes, and at most {MAXIMUM_RECORD} are read"));
    }
    let mut out = Vec::new();
    let unpacked = match compression {
        "none" => bytes.take(size + 1).read_to_end(&mut out),
        "bz2" => bzip2::bufread::MultiBzDecoder::new(bytes).take(size + 1).read_to_end(&mut out),
        "lz4" => lz4_flex::frame::FrameDecoder::new(bytes).take(size + 1).read_to_end(&mut out),
        other => return Err(format!("unknown compression `{other}`: expected none, bz2 or lz4")),
    };
    unpacked.map_err(|error| format!("it can't be unpacked from {compression}: {error}"))?;
    match out.len() as u64 {
        found if found == size => Ok(out),
        found => Err(format!("it has {found} bytes, expected {size}")),
    }
}
