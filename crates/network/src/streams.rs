//! Streams to readers with options.

use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::channel::{Policy, QueueReader, Start};
use slate_blackboard::{Property, Watching};
use slate_module::Level;
use slate_sorted::SortedMap;
use zenoh::bytes::Encoding;

use crate::error::NetworkError;
use crate::key::read_key;
use crate::options::{ReadMode, ReadOptions, ReadRate, ReadValues, StreamName};
use crate::payload::encoding;
use crate::publisher::ValuePublisher;
use crate::shared::{NetworkShared, locked};

/// Time that a stream without readers is kept, ns.
/// Its reader's subscription may be on its way, or its link may be cut.
const STREAM_LIFETIME: u64 = 5_000_000_000;
const RELIABLE_STREAM_LIFETIME: u64 = 30_000_000_000;

/// Streams of an agent at a time.
pub const MAX_STREAMS: usize = 1024;

/// Requested streams, as long as they are read.
/// It belongs to the network's thread.
pub struct Streams {
    shared: Arc<NetworkShared>,
    open: SortedMap<StreamName, Stream>,
}

struct Stream {
    publisher: ValuePublisher,
    options: ReadOptions,
    /// Property, while it exists and has readers.
    source: Option<StreamSource>,
    /// Time of the last read, and time when the next value may be sent, ns.
    read: u64,
    next: u64,
    is_error_logged: bool,
}

struct StreamSource {
    property: Arc<Property>,
    encoding: Encoding,
    /// Watch that keeps debug outputs computed.
    _watching: Watching,
    /// Queue of all values, if they are requested.
    queue: Option<QueueReader>,
    /// Number of the value that was sent last.
    sent: u64,
}

impl Streams {
    pub fn new(shared: Arc<NetworkShared>) -> Self {
        Self { shared, open: SortedMap::new() }
    }

    /// Opens requested streams, sends due values and closes unread streams.
    /// Returns how long nothing will be due.
    pub fn step(&mut self, pause: Duration) -> Duration {
        let now = self.shared.surface.agent.composer().steady_now();
        let wanted = std::mem::take(&mut *locked(&self.shared.wanted));
        for name in wanted {
            if let Err(error) = self.open(name, now) {
                self.shared.log(Level::Warn, &error.to_string());
            }
        }
        let mut next = now.saturating_add(pause.as_nanos() as u64);
        let shared = &self.shared;
        self.open.retain(|(path, options), stream| {
            match stream.step(shared, path, now) {
                Ok(Some(due)) => next = next.min(due),
                Ok(None) => {}
                Err(reason) if !std::mem::replace(&mut stream.is_error_logged, true) => {
                    shared.log(Level::Warn, &format!("/{path} with `{options}` is not published: {reason}"));
                }
                Err(_) => {}
            }
            let kept =
                if options.mode == ReadMode::Reliable { RELIABLE_STREAM_LIFETIME } else { STREAM_LIFETIME };
            now.saturating_sub(stream.read) < kept
        });
        Duration::from_nanos(next.saturating_sub(now))
    }

    fn open(&mut self, name: StreamName, now: u64) -> Result<(), NetworkError> {
        if let Some(stream) = self.open.get_mut(&name) {
            stream.read = now;
            return Ok(());
        }
        let (path, options) = &name;
        let key = read_key(self.shared.board().agent(), &options.to_string(), path);
        let newest = self.shared.board().get(path).and_then(|(property, _)| property.newest().ok().flatten());
        let size = newest.map_or(0, |(bytes, ..)| bytes.len());
        let publisher =
            ValuePublisher::new(&self.shared.session, (key, size), options.mode, &self.shared.wake)?;
        let stream = Stream {
            publisher,
            options: *options,
            source: None,
            read: now,
            next: now,
            is_error_logged: false,
        };
        self.open.insert(name, stream);
        *locked(&self.shared.streams) = self.open.len();
        Ok(())
    }
}

impl Stream {
    /// Sends the due values; returns when the next will be due, if known.
    fn step(&mut self, shared: &NetworkShared, path: &str, now: u64) -> Result<Option<u64>, String> {
        if self.publisher.is_read() {
            self.read = now;
        } else if self.options.mode != ReadMode::Reliable {
            // The next reader receives the newest value at once.
            self.source = None;
            return Ok(None);
        }
        // The cache keeps values for a reader whose link is cut for a moment.
        self.follow(shared, path)?;
        if self.options.values == ReadValues::All {
            return self.send_all().map(|()| None);
        }
        let Some(source) = &mut self.source else { return Ok(None) };
        let has_news = source.property.channel().is_some_and(|channel| channel.published() != source.sent);
        match self.options.rate {
            _ if now < self.next => return Ok(has_news.then_some(self.next)),
            ReadRate::OnChange { interval } if has_news => self.next = now + interval,
            ReadRate::OnChange { .. } => return Ok(None),
            ReadRate::Every(period) => {
                // Missed periods are skipped.
                let missed = (now - self.next) / period;
                self.next += (missed + 1) * period;
            }
        }
        if has_news
            && let Some((bytes, items, stamp)) =
                source.property.newest().map_err(|error| error.to_string())?
        {
            source.sent = stamp.sequence;
            self.publisher.put(source.property.descriptor(), &source.encoding, (&bytes, items, stamp))?;
        }
        Ok(matches!(self.options.rate, ReadRate::Every(_)).then_some(self.next))
    }

    /// Switches to the present property.
    fn follow(&mut self, shared: &NetworkShared, path: &str) -> Result<(), String> {
        let found =
            shared.board().get(path).filter(|(_, field)| field.is_empty()).map(|(property, _)| property);
        let known = self.source.as_ref().map(|source| &source.property);
        let is_same = match (known, &found) {
            (Some(known), Some(found)) => Arc::ptr_eq(known, found),
            (None, None) => true,
            _ => false,
        };
        if !is_same {
            let wants_all = self.options.values == ReadValues::All;
            self.source = found.map(|property| StreamSource::new(property, wants_all)).transpose()?;
        }
        Ok(())
    }

    fn send_all(&mut self) -> Result<(), String> {
        let Some(StreamSource { property, encoding, queue: Some(queue), .. }) = &mut self.source else {
            return Ok(());
        };
        // Values that were overwritten meanwhile are missing in the numbers.
        while queue.pull().unwrap_or(0) > 0 {
            for loan in queue.window() {
                let value = (loan.bytes(), loan.items(), loan.stamp());
                self.publisher.put(property.descriptor(), encoding, value)?;
            }
        }
        Ok(())
    }
}

impl StreamSource {
    fn new(property: Arc<Property>, wants_all: bool) -> Result<Self, String> {
        let queue = property
            .channel()
            .filter(|_| wants_all)
            .map(|channel| channel.queue(Policy::Skip, Start::Oldest));
        Ok(Self {
            encoding: Encoding::from(encoding(property.descriptor())),
            _watching: property.watch(),
            queue: queue.transpose().map_err(|error| error.to_string())?,
            property,
            sent: 0,
        })
    }
}
