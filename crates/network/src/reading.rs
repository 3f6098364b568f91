//! Inputs that read from the network.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, Weak};

use serde_json::Value as Json;
use slate_blackboard::Access;
use slate_blackboard::wake::Wake;
use slate_control::ControlSurface;
use slate_module::Level;
use slate_runtime::{Composer, ExternalContent, ExternalDelivery, ExternalValue};
use zenoh::sample::{Sample, SampleKind};

use crate::attachment::SampleAttachment;
use crate::key::InputSource;
use crate::messages::InboxMessages;
use crate::options::{ReadMode, ReadOptions, ReadRate, ReadValues};
use crate::payload::{Decoded, Payload};
use crate::recovery::SampleRecovery;
use crate::settings::{NetworkInput, NetworkSettings};
use crate::shared::locked;

/// Time without a value after which a stream is requested again, ns.
const QUERY_PERIOD: u64 = 1_000_000_000;

/// Queue limits of an input in lockstep until the end of a cycle.
/// For the newest values, or for as many as possible of all.
const QUEUE_LIMITS: (usize, usize) = (16, 1024);

/// Status of an input that reads from the network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadingStatus {
    /// Path of the input.
    pub input: String,
    /// Source of its values.
    pub source: InputSource,
    /// Values that it was set to.
    pub received: u64,
    /// Values that were sent and did not come.
    pub lost: u64,
    /// Number of values not sent.
    /// A newer one replaced them, or the options wanted fewer.
    pub thinned: u64,
    /// Values that did not fit.
    pub refused: u64,
    /// Reason why the last value did not fit; `None` if it did.
    pub error: Option<String>,
}

/// Input that reads from the network.
/// Values arrive in threads of Zenoh, and none of them waits for the agent.
pub struct InputReader {
    input: Arc<str>,
    pub source: InputSource,
    pub options: ReadOptions,
    composer: Composer,
    /// Queue of values until the end of a lockstep cycle, and the input's index there.
    delivery: Option<(Arc<ExternalDelivery>, usize)>,
    /// Queue of messages, if the input is an inbox.
    inbox: Option<InboxMessages>,
    /// Recovery of lost values, if it is wanted.
    recovery: Option<Arc<SampleRecovery>>,
    state: Mutex<ReaderState>,
    /// Pending request for the newest value.
    is_due: AtomicBool,
    /// Arrival of a value since the request, and the time of the request, ns.
    is_answered: AtomicBool,
    queried: AtomicU64,
}

#[derive(Default)]
struct ReaderState {
    received: u64,
    lost: u64,
    thinned: u64,
    refused: u64,
    error: Option<String>,
    last: Option<SampleAttachment>,
    /// Possible restart of the source agent, perhaps as a new process.
    may_be_new: bool,
    /// Value held back until `next`, ns, as values exceed the rate of the options.
    held: Option<ExternalContent>,
    next: u64,
}

impl InputReader {
    /// Creates an input of an agent that was [checked](crate::check_properties).
    pub fn new(
        composer: &Composer,
        input: &str,
        reading: &NetworkInput,
        delivery: Option<(Arc<ExternalDelivery>, usize)>,
        inbox: Option<InboxMessages>,
        wake: &Arc<Wake>,
    ) -> Arc<Self> {
        Arc::new_cyclic(|own: &Weak<Self>| Self {
            recovery: (reading.options.mode == ReadMode::Reliable).then(|| {
                let (own, composer) = (own.clone(), composer.clone());
                let is_of_agent = matches!(reading.source, InputSource::Property { .. });
                let pass = move |sample: &Sample| own.upgrade().is_some_and(|own| own.take(sample, false));
                let now = move || composer.steady_now();
                let key = reading.source.key(&reading.options);
                Arc::new(SampleRecovery::new(key, is_of_agent, now, pass, wake))
            }),
            input: input.into(),
            delivery,
            inbox,
            source: reading.source.clone(),
            options: reading.options,
            composer: composer.clone(),
            state: Mutex::default(),
            is_due: AtomicBool::new(true),
            is_answered: AtomicBool::new(false),
            queried: AtomicU64::new(0),
        })
    }

    /// Returns the recovery of lost values, if it is wanted.
    pub fn recovery(&self) -> Option<&Arc<SampleRecovery>> {
        self.recovery.as_ref()
    }

    /// Returns whether to request the newest value now.
    /// The request that begins a stream is repeated until a value comes, as a query may be lost.
    pub fn needs_query(&self, now: u64) -> bool {
        let is_stream =
            self.options != ReadOptions::default() && matches!(self.source, InputSource::Property { .. });
        let is_late = || {
            is_stream
                && !self.is_answered.load(Ordering::Acquire)
                && now.saturating_sub(self.queried.load(Ordering::Acquire)) > QUERY_PERIOD
        };
        let is_due = self.is_due.swap(false, Ordering::AcqRel) || is_late();
        if is_due {
            self.is_answered.store(false, Ordering::Release);
            self.queried.store(now, Ordering::Release);
        }
        is_due
    }

    pub fn status(&self) -> ReadingStatus {
        let state = locked(&self.state);
        ReadingStatus {
            input: self.input.to_string(),
            source: self.source.clone(),
            received: state.received,
            lost: state.lost,
            thinned: state.thinned,
            refused: state.refused,
            error: state.error.clone(),
        }
    }

    /// Handles the arrival of the source agent, perhaps after a restart.
    /// Its newest value is requested, and its numbers may begin anew.
    pub fn restart(&self) {
        locked(&self.state).may_be_new = true;
        self.is_due.store(true, Ordering::Release);
    }

    /// Sets the input to a received value; returns whether it is held back.
    /// A requested value may be older than those received meanwhile.
    pub fn take(&self, sample: &Sample, is_reply: bool) -> bool {
        if sample.kind() == SampleKind::Delete {
            return false;
        }
        self.is_answered.store(true, Ordering::Release);
        let encoding = sample.encoding().to_string();
        let attachment = sample.attachment().map(|bytes| bytes.to_bytes()).unwrap_or_default();
        let bytes = sample.payload().to_bytes();
        let payload = Payload { encoding: &encoding, bytes: &bytes, attachment: &attachment };
        // The lock keeps the order of the values.
        let mut state = locked(&self.state);
        let stamp = payload.attachment().ok().flatten();
        if stamp.is_some() && std::mem::take(&mut state.may_be_new) {
            // A sample that is older than the last one is of a new process.
            let continues = |last: &SampleAttachment| {
                stamp.is_some_and(|new| {
                    new.stamp.sequence >= last.stamp.sequence && new.stamp.time >= last.stamp.time
                })
            };
            state.last = state.last.filter(continues);
        }
        if let (Some(last), Some(stamp)) = (state.last, stamp) {
            let is_old = last.stamp.generation == stamp.stamp.generation
                && stamp.stamp.sequence <= last.stamp.sequence;
            // A stream that loses nothing has the answer among its values, in its turn.
            if is_old && (is_reply || self.recovery.is_some()) || is_reply && self.recovery.is_some() {
                return false;
            }
        }
        match self.content(&payload) {
            Ok(content) => {
                if let (Some(last), Some(new)) = (state.last, stamp) {
                    let (lost, thinned) = self.missed(&last, &new);
                    state.lost += lost;
                    state.thinned += thinned;
                }
                state.last = stamp;
                self.limit_rate(&mut state, content)
            }
            Err(error) => {
                self.note(&mut state, Err(error));
                false
            }
        }
    }

    /// Sets the input to a value, or holds it back if values exceed the wanted rate.
    fn limit_rate(&self, state: &mut ReaderState, content: ExternalContent) -> bool {
        let interval = self.interval();
        if interval == 0 {
            self.set(state, content);
            return false;
        }
        let now = self.composer.steady_now();
        if now < state.next {
            state.thinned += u64::from(state.held.replace(content).is_some());
            return true;
        }
        state.next = now.saturating_add(interval);
        self.set(state, content);
        false
    }

    /// Sets the input to the value that was held back, if it is due.
    /// Returns the time at which it is due otherwise.
    pub fn release(&self, now: u64) -> Option<u64> {
        let mut state = locked(&self.state);
        if now < state.next {
            return state.held.is_some().then_some(state.next);
        }
        let content = state.held.take()?;
        state.next = now.saturating_add(self.interval());
        self.set(&mut state, content);
        None
    }

    /// Returns the minimum period of the values, ns.
    /// The origin enforces it, unless it is not an agent.
    fn interval(&self) -> u64 {
        match (&self.source, self.options.rate) {
            (InputSource::Property { .. }, _) => 0,
            (InputSource::Key(_), ReadRate::Every(time) | ReadRate::OnChange { interval: time }) => time,
        }
    }

    fn set(&self, state: &mut ReaderState, content: ExternalContent) {
        if let Some(inbox) = &self.inbox {
            match self.message(content) {
                Ok(message) => state.lost += u64::from(!inbox.push(message)),
                Err(error) => self.note(state, Err(error)),
            }
            return;
        }
        if let Some((delivery, index)) = &self.delivery {
            if !delivery.push(*index, content) {
                match self.options.values {
                    ReadValues::All => state.lost += 1,
                    ReadValues::Newest => state.thinned += 1,
                }
            }
            return;
        }
        let value = ExternalValue { input: Arc::clone(&self.input), content };
        for result in self.composer.set_external(vec![value]) {
            self.note(state, result.map_err(|error| error.to_string()));
        }
    }

    /// Converts a value to a message.
    fn message(&self, content: ExternalContent) -> Result<Json, String> {
        let found = self.composer.board().get(&self.input);
        let (property, _) = found.ok_or_else(|| format!("/{} is no longer there", self.input))?;
        let decoded = match content {
            ExternalContent::Bytes(bytes) => Decoded::Bytes(bytes),
            ExternalContent::Value { value, .. } => Decoded::Value(value),
        };
        decoded.json(property.descriptor())
    }

    /// Sends messages to the inbox, until the end.
    pub fn send_messages(&self) {
        if let Some(inbox) = &self.inbox {
            inbox.run(|result| self.note_set(result));
        }
    }

    /// Returns the queue of messages, if the input is an inbox.
    pub fn inbox(&self) -> Option<&InboxMessages> {
        self.inbox.as_ref()
    }

    /// Records the outcome of a value that was set later.
    pub fn note_set(&self, result: Result<(), String>) {
        self.note(&mut locked(&self.state), result);
    }

    /// Records the outcome of a value; the same reason is logged once.
    fn note(&self, state: &mut ReaderState, result: Result<(), String>) {
        match result {
            Ok(()) => {
                state.received += 1;
                state.error = None;
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

    /// Returns the key that it reads.
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
            // The stream begins after the answer to a query.
            (0, _) => (0, written),
            (_, ReadValues::All) => (written, 0),
            (number, ReadValues::Newest) => {
                let lost = between(number, new.number).min(written);
                (lost, written - lost)
            }
        }
    }

    fn content(&self, payload: &Payload<'_>) -> Result<ExternalContent, String> {
        let found = self.composer.board().get(&self.input);
        let (property, field) = found.ok_or_else(|| format!("/{} is no longer there", self.input))?;
        let decoded = payload.decode(property.descriptor(), &field).map_err(|error| error.to_string())?;
        Ok(match decoded {
            Decoded::Bytes(bytes) => ExternalContent::Bytes(bytes),
            Decoded::Value(value) => ExternalContent::Value { field, value },
        })
    }
}

/// Inputs of an agent that read from the network.
/// In lockstep also the queue of their values.
pub struct InputReaders {
    pub readers: Vec<Arc<InputReader>>,
    pub delivery: Option<Arc<ExternalDelivery>>,
}

impl InputReaders {
    /// Creates the reading inputs of an agent, which must be checked before.
    /// See [`check_properties`](crate::check_properties). Tools and recordings know from now on what fills them.
    pub fn new(surface: &Arc<ControlSurface>, settings: &NetworkSettings, wake: &Arc<Wake>) -> Self {
        let composer = surface.agent.composer();
        let (usual, many) = QUEUE_LIMITS;
        let depth =
            |reading: &NetworkInput| if reading.options.values == ReadValues::All { many } else { usual };
        let delivery = composer.is_lockstep().then(|| {
            let inputs = settings.read.iter().map(|(input, reading)| (input.clone(), depth(reading)));
            Arc::new(ExternalDelivery::new(composer.clone(), inputs))
        });
        let reader = |(index, (input, reading)): (usize, (&String, &NetworkInput))| {
            let delivery = delivery.as_ref().map(|delivery| (Arc::clone(delivery), index));
            let found = composer.board().get(input);
            let is_inbox = found.is_some_and(|(property, _)| property.access() == Access::Messages);
            let inbox = is_inbox.then(|| InboxMessages::new(surface, input));
            InputReader::new(composer, input, reading, delivery, inbox, wake)
        };
        let readers = Self { readers: settings.read.iter().enumerate().map(reader).collect(), delivery };
        readers.declare(true);
        readers
    }

    /// Declares on the blackboard that the inputs are filled, or no longer so.
    fn declare(&self, is_filled: bool) {
        for reader in &self.readers {
            let Some((property, field)) = reader.composer.board().get(&reader.input) else { continue };
            let source = reader.source.to_string();
            let before = property.external();
            // Several keys may fill fields of one input.
            let text = match (is_filled, field.is_empty() || before.is_empty()) {
                (false, _) => String::new(),
                (true, true) => source,
                (true, false) => format!("{before}, {source}"),
            };
            property.set_external(&text);
        }
    }

    /// Sets inputs in lockstep, until the end.
    pub fn deliver(&self) {
        let Some(delivery) = &self.delivery else { return };
        delivery.run(|index, result| {
            self.readers[index].note_set(result.map_err(|error| error.to_string()));
        });
    }
}

impl Drop for InputReaders {
    fn drop(&mut self) {
        self.declare(false);
    }
}
