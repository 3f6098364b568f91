//! A recording, read from its beginning to its end, piece by piece.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use mcap::parse_record;
use mcap::records::{Channel, MessageHeader, Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// What comes next.
pub(super) enum Item {
    Channel(Channel),
    Message(MessageHeader, Vec<u8>),
    Metadata(String, BTreeMap<String, String>),
    Attachment(String, Vec<u8>),
}

/// A recording that is read.
pub(super) struct Source {
    path: PathBuf,
    file: BufReader<File>,
    reader: LinearReader,
    /// Whether the data are at their end, behind which everything is said again.
    is_over: bool,
}

/// No record of a recording is larger, so whoever writes a length can't have more memory taken, bytes.
const LIMIT: usize = 256 << 20;

/// How much is read at once, bytes: the index behind each piece has many short records.
const AT_ONCE: usize = 256 << 10;

/// Why a recording can't be read.
#[derive(Debug, thiserror::Error)]
#[error("the recording {} can't be read: {reason}", slate_runtime::printable(path))]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// Why.
    pub reason: String,
}

impl Source {
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let failed = |error: std::io::Error| ReadError { path: path.into(), reason: error.to_string() };
        let file = BufReader::with_capacity(AT_ONCE, File::open(path).map_err(failed)?);
        let options =
            LinearReaderOptions::default().with_prevalidate_chunk_crcs(true).with_record_length_limit(LIMIT);
        let reader = LinearReader::new_with_options(options);
        Ok(Self { path: path.into(), file, reader, is_over: false })
    }

    pub fn error(&self, reason: impl ToString) -> ReadError {
        ReadError { path: self.path.clone(), reason: reason.to_string() }
    }

    /// The next item, with messages of those channels only; nothing at the end of what can be read. A file whose writer was
    /// killed ends in the middle.
    pub fn next(&mut self, wants: impl Fn(u16) -> bool) -> Result<Option<Item>, ReadError> {
        while !self.is_over {
            let event = match self.reader.next_event() {
                None => break,
                Some(Err(mcap::McapError::UnexpectedEof)) => break,
                Some(Err(error)) => {
                    let reason = error.to_string();
                    return Err(self.error(reason));
                }
                Some(Ok(event)) => event,
            };
            let item = match event {
                LinearReadEvent::ReadRequest(need) => {
                    let space = self.reader.insert(need);
                    let count = self.file.read(space);
                    let count = count
                        .map_err(|error| ReadError { path: self.path.clone(), reason: error.to_string() })?;
                    self.reader.notify_read(count);
                    continue;
                }
                LinearReadEvent::Record { data, opcode } if !is_wanted(opcode, data, &wants) => continue,
                LinearReadEvent::Record { data, opcode } => match parse_record(opcode, data) {
                    Ok(Record::Channel(channel)) => Item::Channel(channel),
                    Ok(Record::Message { header, data }) => Item::Message(header, data.into_owned()),
                    Ok(Record::Metadata(metadata)) => Item::Metadata(metadata.name, metadata.metadata),
                    Ok(Record::Attachment { header, data, .. }) => {
                        Item::Attachment(header.name, data.into_owned())
                    }
                    Ok(Record::DataEnd(_)) => {
                        self.is_over = true;
                        continue;
                    }
                    Ok(_) => continue,
                    Err(error) => {
                        let reason = error.to_string();
                        return Err(self.error(reason));
                    }
                },
            };
            return Ok(Some(item));
        }
        self.is_over = true;
        Ok(None)
    }
}

/// Whether a record is looked at; what of it can't be read is told by whoever does.
fn is_wanted(opcode: u8, data: &[u8], wants: impl Fn(u16) -> bool) -> bool {
    match opcode {
        op::MESSAGE => data.first_chunk().is_none_or(|channel| wants(u16::from_le_bytes(*channel))),
        op::CHANNEL | op::METADATA | op::ATTACHMENT | op::DATA_END => true,
        _ => false,
    }
}
