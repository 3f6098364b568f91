//! Sources of values in a recording: properties, mailboxes and the log.

use slate_module::Level;
use slate_sorted::{SortedMap, SortedSet};

use super::form::ValueForm;
use slate_bag::Message;

/// A recorded property.
pub(super) struct PropertyTrack {
    pub topic: String,
    /// Path without a leading slash.
    pub path: String,
    pub form: ValueForm,
    /// Set if a run of the same configuration writes the same values.
    pub is_compared: bool,
    /// Hash of the schema, if an agent recorded it, and the accesses of its channels.
    /// An input may be set at times, and filled by links at others.
    pub origin: Option<String>,
    pub accesses: SortedSet<String>,
    /// Set if the property is written on the loop of a run in lockstep.
    pub is_on_loop: bool,
    /// Set if the numbers of the recording count its values.
    pub is_counted: bool,
    pub last_sequence: u64,
    /// The latest time so far.
    pub latest: u64,
    /// Values with a time before that of one before them.
    pub backwards: u64,
    /// Values in the order of time, by their places among all.
    pub values: Vec<u32>,
}

impl PropertyTrack {
    /// Notes a value recorded at a time.
    /// The error says why it is not a value of this track.
    pub fn note(&mut self, message: &Message<'_>, time: u64) -> Result<(), String> {
        let number = self.values.len() as u64 + 1;
        self.form.note(message.data).map_err(|error| {
            let (topic, name) = (&self.topic, self.form.descriptor.name);
            format!("value {number} of {topic} is not a {name}: {error}")
        })?;
        let sequence = u64::from(message.sequence);
        self.is_counted &= sequence > self.last_sequence;
        self.last_sequence = sequence;
        self.backwards += u64::from(time < self.latest);
        self.latest = self.latest.max(time);
        // Places are given when all values are in order.
        self.values.push(0);
        Ok(())
    }
}

/// A mailbox whose messages are recorded.
pub(super) struct Mailbox {
    /// Path without a leading slash.
    pub path: String,
    pub form: ValueForm,
    /// Number of senders.
    pub senders: u32,
    /// Paths of the senders' outboxes, by number, as far as they are recorded.
    pub from: SortedMap<u32, String>,
}

impl Mailbox {
    /// Notes a message of a sender.
    /// The error says why it is not a message of this mailbox.
    pub fn note(&mut self, message: &Message<'_>, sender: u32) -> Result<(), String> {
        self.form.note(message.data).map_err(|error| {
            let name = self.form.descriptor.name;
            format!("a message to /{} is not a {name}: {error}", self.path)
        })?;
        self.senders = self.senders.max(sender.saturating_add(1));
        Ok(())
    }
}

/// A line of the log.
pub(super) struct LogLine {
    pub time: u64,
    pub level: Level,
    pub module: String,
    pub text: String,
}
