//! Streams of a property's values as they arrive, for readers that keep up.

use std::sync::Arc;
use std::time::Duration;

use hyper::body::Bytes;
use serde_json::{Value as Json, json};
use slate_blackboard::interface::{FieldPath, View, find};
use slate_blackboard::{BoardError, Property, Stamp, Watching};
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};

use crate::picture::Picture;
use crate::select::Selection;
use crate::surface::ControlSurface;

/// Size from which values are copied and encoded in another thread, bytes.
/// So nothing else waits.
const LARGE_SIZE: usize = 4096;

/// Boundary between the pictures of a stream.
const BOUNDARY: &str = "slate-picture";

/// Time without values after which a stream sends a comment.
const KEEP_ALIVE_PERIOD: Duration = Duration::from_secs(15);

/// Polled property; another one may replace it at its path.
pub struct Watcher {
    path: String,
    found: Option<FoundProperty>,
    /// Sequence number of the newest value that was taken.
    last: u64,
}

struct FoundProperty {
    field_path: Option<FieldPath>,
    /// Watch, by which outputs without other readers are computed.
    watching: Watching,
}

/// Value of a property with its stamp.
pub struct Sample {
    /// Property.
    pub property: Arc<Property>,
    field_path: Option<FieldPath>,
    /// Value.
    pub bytes: Vec<u8>,
    /// Number of items in its tail.
    pub items: usize,
    /// Stamp of the write.
    pub stamp: Stamp,
}

impl Sample {
    /// Returns the value, or the field of it.
    pub fn json(&self) -> Json {
        let view = View::new(self.property.descriptor(), &self.bytes, self.items);
        let value = match &self.field_path {
            None => view.map(|view| view.value()),
            Some(field_path) => view.and_then(|view| view.at(field_path)),
        };
        value.and_then(|value| serde_json::to_value(value).ok()).unwrap_or_default()
    }
}

impl Watcher {
    /// Watches a property or a field of it.
    /// `last` is the sequence number of the newest value already known.
    pub fn new(surface: &ControlSurface, path: &str, last: u64) -> Result<Self, BoardError> {
        let mut watcher = Self { path: path.into(), found: None, last };
        watcher.refresh(surface)?;
        Ok(watcher)
    }

    fn refresh(&mut self, surface: &ControlSurface) -> Result<(), BoardError> {
        let (property, field) = surface.board().find(&self.path)?;
        if self.found.as_ref().is_some_and(|found| Arc::ptr_eq(found.watching.property(), &property)) {
            return Ok(());
        }
        let wrong = |error| BoardError::Access { url: format!("/{}", property.path()), error };
        let field_path = match field.as_str() {
            "" => None,
            field => Some(find(property.descriptor(), field).map_err(wrong)?),
        };
        if self.found.is_some() {
            // Another property has its own count.
            self.last = 0;
        }
        self.found = Some(FoundProperty { field_path, watching: property.watch() });
        Ok(())
    }

    /// Returns the property, while it exists.
    pub fn property(&self) -> Option<&Arc<Property>> {
        self.found.as_ref().map(|found| found.watching.property())
    }

    /// Returns whether a new value is available.
    pub fn has_update(&mut self, surface: &ControlSurface) -> bool {
        // A removed property may appear again.
        let exists = self.refresh(surface).is_ok();
        let published =
            self.property().and_then(|property| property.channel()).map_or(0, |channel| channel.published());
        exists && published != self.last
    }

    /// Returns the maximum size of a value, bytes.
    pub fn size(&self) -> usize {
        let channel = self.property().and_then(|property| property.channel());
        channel.map_or(0, |channel| channel.shape().bytes(channel.shape().capacity))
    }

    /// Takes the newest value, if it was not taken yet.
    pub fn take(&mut self) -> Result<Option<Sample>, BoardError> {
        let Some(found) = &self.found else { return Ok(None) };
        let property = Arc::clone(found.watching.property());
        let Some((bytes, items, stamp)) = property.newest()? else { return Ok(None) };
        if stamp.sequence == self.last {
            return Ok(None);
        }
        self.last = stamp.sequence;
        Ok(Some(Sample { property, field_path: found.field_path.clone(), bytes, items, stamp }))
    }

    /// Takes all values that are kept and were not taken yet, the oldest first.
    pub fn take_all(&mut self) -> Result<Vec<Sample>, BoardError> {
        let Some(found) = &self.found else { return Ok(Vec::new()) };
        let property = found.watching.property();
        let mut kept = property.snapshot()?.unwrap_or_default().values;
        kept.retain(|kept| kept.stamp.sequence > self.last);
        self.last = kept.last().map_or(self.last, |kept| kept.stamp.sequence);
        let sample = |kept: slate_blackboard::channel::StampedValue| Sample {
            property: Arc::clone(property),
            field_path: found.field_path.clone(),
            bytes: kept.bytes,
            items: kept.items,
            stamp: kept.stamp,
        };
        Ok(kept.into_iter().map(sample).collect())
    }
}

/// Runs work, in a blocking thread if `is_long`.
pub async fn offload<T: Send + 'static>(
    is_long: bool,
    work: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    if !is_long {
        return Some(work());
    }
    tokio::task::spawn_blocking(work).await.ok()
}

/// Stream of a property's values.
pub struct ValueStream {
    /// Surface of the agent.
    pub surface: Arc<ControlSurface>,
    /// Watcher of the property.
    pub watcher: Watcher,
    /// Polling period.
    pub period: Duration,
    /// Content of the stream.
    pub content: StreamContent,
}

/// Content of a stream.
pub enum StreamContent {
    /// Events with values.
    Events {
        /// Part of each value.
        selection: Selection,
        /// Each value that is kept, and not only the newest.
        every: bool,
    },
    /// JPEGs of that quality.
    Pictures(u8),
}

impl ValueStream {
    /// Starts the stream, which ends when its reader has gone.
    pub fn begin(self) -> (&'static str, mpsc::Receiver<Bytes>) {
        let kind = match self.content {
            StreamContent::Events { .. } => "text/event-stream",
            StreamContent::Pictures(_) => "multipart/x-mixed-replace; boundary=slate-picture",
        };
        // With a capacity of 1, a slow client gets the newest value.
        let (sender, receiver) = mpsc::channel(1);
        tokio::spawn(self.run(sender));
        (kind, receiver)
    }

    async fn run(mut self, sender: mpsc::Sender<Bytes>) {
        let mut ticks = interval(self.period);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut idle = Duration::ZERO;
        loop {
            ticks.tick().await;
            if sender.is_closed() {
                return;
            }
            if !self.watcher.has_update(&self.surface) {
                idle += self.period;
                if idle >= KEEP_ALIVE_PERIOD {
                    idle = Duration::ZERO;
                    if matches!(self.content, StreamContent::Events { .. })
                        && sender.send(Bytes::from_static(b":\n\n")).await.is_err()
                    {
                        return;
                    }
                }
                continue;
            }
            idle = Duration::ZERO;
            let large = self.watcher.size() > LARGE_SIZE;
            let encoded = offload(large, move || {
                let text = next_part(&mut self.watcher, &self.content);
                (self, text)
            });
            let Some((back, text)) = encoded.await else { return };
            self = back;
            if !text.is_empty() && sender.send(text.into()).await.is_err() {
                return;
            }
        }
    }
}

/// Returns the next part of a stream; empty without a new value.
fn next_part(watcher: &mut Watcher, content: &StreamContent) -> Vec<u8> {
    match content {
        StreamContent::Events { selection, every } => {
            let samples = if *every {
                watcher.take_all()
            } else {
                watcher.take().map(|sample| sample.into_iter().collect())
            };
            let events = samples.unwrap_or_default().into_iter().map(|sample| {
                let (sequence, time) = (sample.stamp.sequence, sample.stamp.time);
                match selection.of(&sample.json()) {
                    Ok(value) => {
                        let data = json!({ "value": value, "sequence": sequence, "time": time });
                        format!("id: {sequence}\ndata: {data}\n\n")
                    }
                    Err(problem) => format!("id: {sequence}\nevent: problem\ndata: {}\n\n", problem.json()),
                }
            });
            events.collect::<String>().into_bytes()
        }
        StreamContent::Pictures(quality) => {
            let Ok(Some(sample)) = watcher.take() else { return Vec::new() };
            let picture = Picture::of(sample.property.descriptor(), &sample.bytes, sample.items);
            let Some(Ok(jpeg)) = picture.map(|picture| picture.jpeg(*quality)) else { return Vec::new() };
            let (length, time) = (jpeg.len(), sample.stamp.time);
            let head = format!(
                "--{BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {length}\r\nSlate-Time: {time}\r\n\r\n"
            );
            [head.as_bytes(), &jpeg, b"\r\n"].concat()
        }
    }
}
