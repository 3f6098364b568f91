//! Exports: readers of this agent's properties for another agent.

use std::sync::Arc;

use slate_blackboard::channel::{Latest, LinkError, Loan, Policy, QueueReader, Start};
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Board, BoardError, Property, Watching, nearest_paths};
use slate_module::encode_interface;

use super::Allowance;
use super::rights::may_read;
use crate::carrier::SharedMemory;
use crate::encoding::encode;
use crate::session::{Compression, Content, Encoding, Offer, Options, Sample, Seen};

/// Size from which values go through shared memory, if available, bytes.
const MIN_SHARED_SIZE: usize = 16 << 10;

/// Subscription of another agent.
#[derive(Debug)]
pub(super) struct Export {
    pub path: String,
    pub options: Options,
    seen: Option<Seen>,
    pub source: Option<ExportSource>,
    /// Reason why it waits.
    pub waiting: String,
    wake: Arc<Wake>,
}

/// Source of an export: the property and its reader.
#[derive(Debug)]
pub(super) struct ExportSource {
    /// Registration as reader, which makes debug outputs compute their values.
    watching: Watching,
    reader: ExportReader,
    /// Number of the last value that the subscriber has seen.
    after: u64,
    wake: Arc<Wake>,
}

#[derive(Debug)]
enum ExportReader {
    Newest(Latest),
    Every {
        reader: QueueReader,
        index: usize,
    },
    /// Polling without a handle, as none is left.
    Probe {
        sequence: u64,
    },
}

/// Reason why a subscription is not served.
#[derive(Debug)]
pub(super) enum Unserved {
    /// Temporary reason; the subscription waits.
    Waits(String),
    /// Permanent reason; the subscription is declined.
    Declined(String),
}

impl Export {
    pub fn new(path: String, options: Options, seen: Option<Seen>, wake: Arc<Wake>) -> Self {
        Self { path, options, seen, source: None, waiting: String::new(), wake }
    }

    /// Finds the property; returns its offer.
    pub fn connect(
        &mut self,
        board: &Board,
        instance: u64,
        allowance: Option<&Allowance>,
    ) -> Result<Offer, Unserved> {
        let found = board.get(&self.path).ok_or_else(|| self.not_found(board, allowance));
        let (property, field) = found.map_err(Unserved::Waits)?;
        if !field.is_empty() {
            return Err(Unserved::Declined(format!(
                "/{} is `{field}` of /{}: subscribe to that, and read the field here",
                self.path,
                property.path()
            )));
        }
        let Some(channel) = property.channel() else {
            return Err(Unserved::Declined(format!(
                "/{} takes messages and has no values to read",
                self.path
            )));
        };
        let interface = encode_interface(property.descriptor())
            .map_err(|reason| Unserved::Declined(format!("/{}: {reason}", self.path)))?;
        let (published, kept);
        let reader = match self.options.content {
            Content::All => {
                let reader =
                    channel.queue(Policy::Skip, Start::Oldest).map_err(|error| self.reader_error(error))?;
                published = channel.published();
                kept = published.saturating_sub(reader.lag());
                ExportReader::Every { reader, index: 0 }
            }
            Content::Newest => {
                (published, kept) = (channel.published(), 0);
                channel.latest().map_or(ExportReader::Probe { sequence: 0 }, ExportReader::Newest)
            }
        };
        let is_same_run = |seen: &Seen| seen.instance == instance && seen.sequence <= published;
        let after = self.seen.filter(is_same_run).map_or(kept, |seen| seen.sequence);
        // Later values belong to this property.
        self.seen = None;
        let offer = Offer {
            path: property.path().into(),
            interface,
            doc: property.doc().into(),
            part: property.part(),
            capacity: channel.shape().capacity as u64,
            depth: channel.depth() as u32,
            after,
        };
        if property.access() == Access::Setting {
            property.add_listener(Arc::clone(&self.wake));
        }
        let wake = Arc::clone(&self.wake);
        self.source = Some(ExportSource { watching: property.watch(), reader, after, wake });
        Ok(offer)
    }

    /// Returns the reason for a missing property, with the nearest readable names.
    /// The search for names takes a while, so it runs once and not at each poll.
    fn not_found(&self, board: &Board, allowance: Option<&Allowance>) -> String {
        if !self.waiting.is_empty() {
            return self.waiting.clone();
        }
        let properties = board.properties();
        let paths = properties.iter().map(|property| property.path());
        let near = nearest_paths(&self.path, '/', paths.filter(|path| may_read(allowance, path)));
        BoardError::Unknown { url: format!("/{}", self.path), near }.to_string()
    }

    fn reader_error(&self, error: LinkError) -> Unserved {
        Unserved::Waits(format!("/{}: {error}", self.path))
    }
}

impl ExportSource {
    pub fn property(&self) -> &Arc<Property> {
        self.watching.property()
    }

    pub fn has_update(&self) -> bool {
        match &self.reader {
            ExportReader::Newest(latest) => latest.has_news(),
            ExportReader::Every { reader, index } => *index < reader.len() || reader.lag() > 0,
            ExportReader::Probe { sequence } => {
                self.property().channel().is_some_and(|channel| channel.published() > *sequence)
            }
        }
    }

    /// Returns the number of values that wait to be sent.
    pub fn lag(&self) -> u64 {
        match &self.reader {
            ExportReader::Every { reader, index } => reader.lag() + (reader.len() - index) as u64,
            _ => u64::from(self.has_update()),
        }
    }

    /// Appends the next value.
    pub fn take(
        &mut self,
        compression: Compression,
        memory: Option<&dyn SharedMemory>,
        content: &mut Vec<u8>,
    ) -> Option<Sample> {
        let property = Arc::clone(self.property());
        let after = self.after;
        let mut write = |bytes: &[u8], items: usize, stamp: slate_blackboard::Stamp| {
            if stamp.sequence <= after {
                return None;
            }
            let descriptor = property.descriptor();
            let item = descriptor.tail().map_or(0, slate_blackboard::interface::Kind::size);
            // Without what rounds it up to its alignment.
            let exact = bytes.get(..descriptor.size + items * item)?;
            let placed =
                exact.len() >= MIN_SHARED_SIZE && memory.is_some_and(|memory| memory.place(exact, content));
            let encoding =
                if placed { Encoding::Placed } else { encode(descriptor, exact, compression, content) };
            Some(Sample { stamp, items: items as u32, length: exact.len() as u32, encoding })
        };
        let mut lent = |loan: Loan<'_>| write(loan.bytes(), loan.items(), loan.stamp());
        match &mut self.reader {
            ExportReader::Newest(latest) => {
                latest.refresh();
                latest.value().and_then(lent)
            }
            ExportReader::Every { reader, index } => loop {
                if *index == reader.len() {
                    *index = 0;
                    // It skips what is gone, which shows in the numbers of the values.
                    if reader.pull().unwrap_or(0) == 0 {
                        return None;
                    }
                }
                *index += 1;
                let sample = reader.window().nth(*index - 1).and_then(&mut lent);
                if sample.is_some() {
                    return sample;
                }
            },
            ExportReader::Probe { sequence } => {
                let (bytes, items, stamp) = self.watching.property().newest().ok()??;
                *sequence = stamp.sequence;
                write(&bytes, items, stamp)
            }
        }
    }
}

impl Drop for ExportSource {
    fn drop(&mut self) {
        self.property().remove_listener(&self.wake);
    }
}
