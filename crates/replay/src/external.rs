//! Values that came from outside of a recorded agent, set once more in a rerun.

use std::collections::VecDeque;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use slate_blackboard::Carrier;
use slate_blackboard::interface::Kind;
use slate_runtime::Agent;
use slate_sorted::SortedMap;

use slate_bag::{Error, MessageLocation, Reader};
use slate_ros_messages as ros;

/// Selection of the data that are set again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ExternalSelection {
    /// Values of inputs.
    Values,
    /// Values of inputs, and messages to inboxes.
    /// The playback of a part of the modules sends messages itself.
    ValuesAndMessages,
}

/// A value in the file.
struct ExternalInputValue {
    time: u64,
    /// Number of the value among those of the input, counted from 1.
    sequence: u32,
    /// Place of the input among all.
    input: usize,
    location: MessageLocation,
}

/// The values of those inputs that programs outside of the agent filled.
pub(super) struct ExternalValues {
    reader: Option<Reader<BufReader<File>>>,
    inputs: Vec<String>,
    /// Values in the order in which they were set.
    waiting: VecDeque<ExternalInputValue>,
}

impl ExternalValues {
    /// Finds the values of these inputs; the file is read once more if there are any.
    ///
    /// # Errors
    /// When the file can't be read.
    pub fn find(
        path: &Path,
        epoch: u64,
        inputs: Vec<String>,
        what: ExternalSelection,
    ) -> Result<Self, Error> {
        let mut values = Self { reader: None, inputs, waiting: VecDeque::new() };
        if values.inputs.is_empty() {
            return Ok(values);
        }
        let mut reader = Reader::open_unfinished(path)?;
        let topics = values.inputs.iter().enumerate();
        let topics: SortedMap<_, _> = topics.map(|(index, input)| (format!("/{input}"), index)).collect();
        let mut found = Vec::new();
        while let Some((location, _, message)) = reader.next_located()? {
            if let Some(input) = topics.get(&message.channel.topic) {
                let metadata = &message.channel.metadata;
                let is_message = metadata.get("access").is_some_and(|access| access == "messages");
                // Modules send theirs themselves.
                if is_message && (what == ExternalSelection::Values || metadata.contains_key("from")) {
                    continue;
                }
                // A message is taken in the cycle after it was sent.
                let time = if is_message { message.publish_time } else { message.log_time };
                let time = time.saturating_sub(epoch);
                let sequence = message.sequence;
                found.push(ExternalInputValue { time, sequence, input: *input, location });
            }
        }
        // Those of one time stay in the order of the file.
        found.sort_by_key(|value| value.time);
        values.waiting = found.into();
        values.reader = Some(reader);
        Ok(values)
    }

    /// Sets the values that came until a time.
    ///
    /// # Errors
    /// Why one of them can't be set again.
    pub fn set_until(&mut self, agent: &Agent, until: u64) -> Result<(), String> {
        let Some(reader) = &mut self.reader else { return Ok(()) };
        while let Some(value) = self.waiting.pop_front_if(|value| value.time <= until) {
            let input = &self.inputs[value.input];
            let lost = |error: &dyn std::fmt::Display| {
                format!("a value set from outside at /{input} can't be set again: {error}")
            };
            let (property, _) = agent.board().get(input).ok_or_else(|| lost(&"the input does not exist"))?;
            // The rerun has the value of the configuration already.
            if property.channel().is_some_and(|channel| channel.published() >= value.sequence.into()) {
                continue;
            }
            let message = reader.message_at(value.location).map_err(|error| lost(&error))?;
            let bytes = ros::decode(property.descriptor(), message.data).map_err(|error| lost(&error))?;
            if let Carrier::Mailbox(mailbox) = property.carrier() {
                let items = bytes.len().saturating_sub(property.descriptor().size);
                let items = items / property.descriptor().tail().map_or(1, Kind::size).max(1);
                let mut sender = mailbox.sender().map_err(|error| lost(&error))?;
                sender.send(&bytes, items, value.time).map_err(|error| lost(&error))?;
                continue;
            }
            property.set_bytes(&bytes, value.time).map_err(|error| lost(&error))?;
        }
        Ok(())
    }
}
