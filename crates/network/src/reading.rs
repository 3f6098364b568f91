//! Inputs that read from the network.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use slate_module::Level;
use slate_runtime::Composer;
use zenoh::sample::{Sample, SampleKind};

use crate::attachment::SampleAttachment;
use crate::key::InputSource;
use crate::options::{ReadOptions, ReadValues};
use crate::payload::{Decoded, Payload};
use crate::settings::NetworkInput;
use crate::shared::locked;

/// After so long without a value, ns, a stream is asked for again.
const RETRY: u64 = 1_000_000_000;

/// How an input that reads from the network stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadingStatus {
    /// Path of the input.
    pub input: String,
    /// Where it reads.
    pub source: InputSource,
    /// Values that it was set to.
    pub received: u64,
    /// Values that were sent and did not come.
    pub lost: u64,
    /// Values that were not sent, as a newer one took their place or the options wanted fewer.
    pub thinned: u64,
    /// Values that did not fit.
    pub refused: u64,
    /// Why the last value did not fit; nothing when it did.
    pub error: Option<String>,
}

/// An input that reads. Values come in threads of Zenoh, and none of them waits for the agent.
pub struct InputReader {
    input: String,
    pub source: InputSource,
    pub options: ReadOptions,
    composer: Composer,
    state: Mutex<ReaderState>,
    /// Whether its newest value is to be asked for.
    is_due: AtomicBool,
    /// Whether a value has come since it was asked for, and when that was, ns.
    is_answered: AtomicBool,
    asked: AtomicU64,
}

#[derive(Default)]
struct ReaderState {
    received: u64,
    lost: u64,
    thinned: u64,
    refused: u64,
    error: Option<String>,
    last: Option<SampleAttachment>,
    /// Whether the agent that it reads of has come back, perhaps as a new process.
    may_be_new: bool,
}

impl InputReader {
    /// An input of an agent that was [checked](crate::check_inputs).
    pub fn new(composer: &Composer, input: &str, reading: &NetworkInput) -> Self {
        Self {
            input: input.into(),
            source: reading.source.clone(),
            options: reading.options,
            composer: composer.clone(),
            state: Mutex::default(),
            is_due: AtomicBool::new(true),
            is_answered: AtomicBool::new(false),
            asked: AtomicU64::new(0),
        }
    }

    /// Whether its newest value is to be asked for now. What begins a stream is asked again until a value comes: a query may be lost.
    pub fn is_to_ask(&self, now: u64) -> bool {
        let is_late = || {
            self.options != ReadOptions::default()
                && !self.is_answered.load(Ordering::Acquire)
                && now.saturating_sub(self.asked.load(Ordering::Acquire)) > RETRY
        };
        let is_due = self.is_due.swap(false, Ordering::AcqRel) || is_late();
        if is_due {
            self.is_answered.store(false, Ordering::Release);
            self.asked.store(now, Ordering::Release);
        }
        is_due
    }

    pub fn status(&self) -> ReadingStatus {
        let state = locked(&self.state);
        ReadingStatus {
            input: self.input.clone(),
            source: self.source.clone(),
            received: state.received,
            lost: state.lost,
            thinned: state.thinned,
            refused: state.refused,
            error: state.error.clone(),
        }
    }

    /// The agent that it reads of is there, perhaps again: its newest value is to be asked for, and its numbers may begin anew.
    pub fn restart(&self) {
        locked(&self.state).may_be_new = true;
        self.is_due.store(true, Ordering::Release);
    }

    /// Sets the input to a value that came; one that was asked for may be older than what came meanwhile.
    pub fn take(&self, sample: &Sample, was_asked: bool) {
        if sample.kind() == SampleKind::Delete {
            return;
        }
        self.is_answered.store(true, Ordering::Release);
        let encoding = sample.encoding().to_string();
        let attachment = sample.attachment().map(|bytes| bytes.to_bytes()).unwrap_or_default();
        let bytes = sample.payload().to_bytes();
        let payload = Payload { encoding: &encoding, bytes: &bytes, attachment: &attachment };
        // One value after the other.
        let mut state = locked(&self.state);
        let stamp = payload.attachment().ok().flatten();
        if stamp.is_some() && std::mem::take(&mut state.may_be_new) {
            // What is older than the last one is of a new process.
            let goes_on = |last: &SampleAttachment| {
                stamp.is_some_and(|new| {
                    new.stamp.sequence >= last.stamp.sequence && new.stamp.time >= last.stamp.time
                })
            };
            state.last = state.last.filter(goes_on);
        }
        if let (true, Some(last), Some(stamp)) = (was_asked, state.last, stamp)
            && last.stamp.generation == stamp.stamp.generation
            && stamp.stamp.sequence <= last.stamp.sequence
        {
            return;
        }
        match self.set(&payload) {
            Ok(()) => {
                state.received += 1;
                state.error = None;
                if let (Some(last), Some(new)) = (state.last, stamp) {
                    let (lost, thinned) = self.missed(&last, &new);
                    state.lost += lost;
                    state.thinned += thinned;
                }
                state.last = stamp;
            }
            Err(error) => {
                state.refused += 1;
                if state.error.as_ref() != Some(&error) {
                    let text =
                        format!("network: a value of {} does not fit /{}: {error}", self.source, self.input);
                    self.composer.log(Level::Warn, &text);
                    state.error = Some(error);
                }
            }
        }
    }

    /// The key that it reads.
    pub fn key(&self) -> String {
        self.source.key(&self.options)
    }

    /// Values between two samples that were lost, and that were not sent.
    fn missed(&self, last: &SampleAttachment, new: &SampleAttachment) -> (u64, u64) {
        if last.stamp.generation != new.stamp.generation {
            return (0, 0);
        }
        let between = |last: u64, new: u64| new.saturating_sub(last.saturating_add(1));
        let written = between(last.stamp.sequence, new.stamp.sequence);
        match (last.number, self.options.values) {
            // After an answer to a query the stream only begins.
            (0, _) => (0, written),
            (_, ReadValues::All) => (written, 0),
            (number, ReadValues::Newest) => {
                let lost = between(number, new.number).min(written);
                (lost, written - lost)
            }
        }
    }

    fn set(&self, payload: &Payload<'_>) -> Result<(), String> {
        let found = self.composer.board().get(&self.input);
        let (property, field) = found.ok_or_else(|| format!("/{} is no longer there", self.input))?;
        let decoded = payload.decode(property.descriptor(), &field).map_err(|error| error.to_string())?;
        let now = self.composer.now();
        let set = match decoded {
            Decoded::Bytes(bytes) => property.set_bytes(&bytes, now),
            Decoded::Value(value) => property.set(&field, &value, now),
        };
        set.map(drop).map_err(|error| error.to_string())
    }
}
