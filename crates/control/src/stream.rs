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
const LARGE: usize = 4096;

/// Boundary between the pictures of a stream.
const BOUNDARY: &str = "slate-picture";

/// After so long without news a stream says that it is still there.
const SILENCE: Duration = Duration::from_secs(15);

/// Property that is polled; it may vanish, and another one take its path.
pub struct Watcher {
    path: String,
    found: Option<FoundProperty>,
    /// Sequence number of the newest value that was taken.
    last: u64,
}

struct FoundProperty {
    place: Option<FieldPath>,
    /// Watch, by which outputs without other readers are computed.
    watching: Watching,
}

/// Value as it was taken.
pub struct Sample {
    /// Property.
    pub property: Arc<Property>,
    place: Option<FieldPath>,
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
        let value = match &self.place {
            None => view.map(|view| view.value()),
            Some(place) => view.and_then(|view| view.at(place)),
        };
        value.and_then(|value| serde_json::to_value(value).ok()).unwrap_or_default()
    }
}

impl Watcher {
    /// Watches a property or a field of it.
    /// `last` is the sequence number of the newest value already known.
    pub fn new(surface: &ControlSurface, path: &str, last: u64) -> Result<Self, BoardError> {
        let mut watcher = Self { path: path.into(), found: None, last };
        watcher.look(surface)?;
        Ok(watcher)
    }

    fn look(&mut self, surface: &ControlSurface) -> Result<(), BoardError> {
        let (property, field) = surface.board().find(&self.path)?;
        if self.found.as_ref().is_some_and(|found| Arc::ptr_eq(found.watching.property(), &property)) {
            return Ok(());
        }
        let wrong = |error| BoardError::Access { url: format!("/{}", property.path()), error };
        let place = match field.as_str() {
            "" => None,
            field => Some(find(property.descriptor(), field).map_err(wrong)?),
        };
        if self.found.is_some() {
            // Another one counts anew.
            self.last = 0;
        }
        self.found = Some(FoundProperty { place, watching: property.watch() });
        Ok(())
    }

    /// Returns the property, while it exists.
    pub fn property(&self) -> Option<&Arc<Property>> {
        self.found.as_ref().map(|found| found.watching.property())
    }

    /// Returns whether a value has not been taken yet.
    pub fn has_news(&mut self, surface: &ControlSurface) -> bool {
        // What is gone may come back.
        let there = self.look(surface).is_ok();
        let published =
            self.property().and_then(|property| property.channel()).map_or(0, |channel| channel.published());
        there && published != self.last
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
        Ok(Some(Sample { property, place: found.place.clone(), bytes, items, stamp }))
    }

    /// Takes all values that are kept and were not taken yet, the oldest first.
    pub fn take_all(&mut self) -> Result<Vec<Sample>, BoardError> {
        let Some(found) = &self.found else { return Ok(Vec::new()) };
        let property = found.watching.property();
        let mut kept = property.freeze()?.unwrap_or_default().values;
        kept.retain(|kept| kept.stamp.sequence > self.last);
        self.last = kept.last().map_or(self.last, |kept| kept.stamp.sequence);
        let sample = |kept: slate_blackboard::channel::FrozenValue| Sample {
            property: Arc::clone(property),
            place: found.place.clone(),
            bytes: kept.bytes,
            items: kept.items,
            stamp: kept.stamp,
        };
        Ok(kept.into_iter().map(sample).collect())
    }
}

/// Runs possibly slow work in a thread for it.
pub async fn apart<T: Send + 'static>(is_long: bool, work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
    if !is_long {
        return Some(work());
    }
    tokio::task::spawn_blocking(work).await.ok()
}

/// Stream of a property's values.
pub struct Follow {
    /// Surface of the agent.
    pub surface: Arc<ControlSurface>,
    /// Watcher of the property.
    pub watcher: Watcher,
    /// Polling period.
    pub period: Duration,
    /// Form of the stream.
    pub what: StreamForm,
}

/// Form of a stream.
pub enum StreamForm {
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

impl Follow {
    /// Starts the stream, which ends when its reader has gone.
    pub fn begin(self) -> (&'static str, mpsc::Receiver<Bytes>) {
        let kind = match self.what {
            StreamForm::Events { .. } => "text/event-stream",
            StreamForm::Pictures(_) => "multipart/x-mixed-replace; boundary=slate-picture",
        };
        // One that waits, and one on its way: who reads slowly gets the newest.
        let (sender, receiver) = mpsc::channel(1);
        tokio::spawn(self.run(sender));
        (kind, receiver)
    }

    async fn run(mut self, sender: mpsc::Sender<Bytes>) {
        let mut ticks = interval(self.period);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut quiet = Duration::ZERO;
        loop {
            ticks.tick().await;
            if sender.is_closed() {
                return;
            }
            if !self.watcher.has_news(&self.surface) {
                quiet += self.period;
                if quiet >= SILENCE {
                    quiet = Duration::ZERO;
                    if matches!(self.what, StreamForm::Events { .. })
                        && sender.send(Bytes::from_static(b":\n\n")).await.is_err()
                    {
                        return;
                    }
                }
                continue;
            }
            quiet = Duration::ZERO;
            let large = self.watcher.size() > LARGE;
            let told = apart(large, move || {
                let text = tell(&mut self.watcher, &self.what);
                (self, text)
            });
            let Some((back, text)) = told.await else { return };
            self = back;
            if !text.is_empty() && sender.send(text.into()).await.is_err() {
                return;
            }
        }
    }
}

/// Returns the next part of a stream; empty without news.
fn tell(watcher: &mut Watcher, what: &StreamForm) -> Vec<u8> {
    match what {
        StreamForm::Events { selection, every } => {
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
        StreamForm::Pictures(quality) => {
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
