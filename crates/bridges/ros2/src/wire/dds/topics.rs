//! Subscriptions and publishers on DDS.

use std::sync::Arc;
use std::task::Waker;

use rustdds::RTPSEntity;
use slate_dds::wire::{Matches, RawMessage};

use super::participant::{RosDataReader, RosDataWriter};
use crate::wire::{TopicReader, TopicWriter};

/// Subscription.
pub struct DdsTopicReader {
    pub reader: RosDataReader,
    pub matches: Arc<Matches>,
}

impl TopicReader for DdsTopicReader {
    fn set_waker(&self, waker: &Waker) {
        self.reader.drain_read_notifications();
        self.reader.set_waker(Some(waker.clone()));
    }

    fn take(&self) -> Result<Option<Vec<u8>>, String> {
        match self.reader.try_take_one() {
            Ok(change) => Ok(change.map(|change| change.into_value().0)),
            Err(error) => Err(error.to_string()),
        }
    }

    fn take_dropped(&self) -> u64 {
        // RustDDS does not count them.
        0
    }

    fn publishers(&self) -> usize {
        self.matches.count(self.reader.guid())
    }
}

/// Publisher.
pub struct DdsTopicWriter {
    pub writer: RosDataWriter,
    pub matches: Arc<Matches>,
}

impl TopicWriter for DdsTopicWriter {
    fn write(&self, message: Vec<u8>) -> Result<(), String> {
        self.writer.write(RawMessage(message), None).map_err(|error| error.to_string())
    }

    fn subscriptions(&self) -> usize {
        self.matches.count(self.writer.guid())
    }
}
