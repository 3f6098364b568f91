//! From topics to inputs.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::Duration;

use slate_blackboard::wake::Wake;
use slate_dds::wire::ReaderWaker;
use slate_topics::{InboundTopics, RosMessage};

use crate::participant::TopicReader;

/// How long a thread sleeps when nothing comes.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Messages of a topic that are taken before those of the next.
const TURN: usize = 256;

/// Readers of topics that fill inputs, by place.
pub struct TopicReaders(pub Vec<(TopicReader, RosMessage)>);

impl TopicReaders {
    /// Takes what comes, until the end; `look` is called now and then.
    pub fn receive(&self, inbound: &InboundTopics, wake: &Arc<Wake>, ended: &AtomicBool, look: impl Fn()) {
        let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(wake))));
        while !ended.load(Ordering::Acquire) {
            look();
            let mut is_done = true;
            for (place, (reader, message)) in self.0.iter().enumerate() {
                reader.drain_read_notifications();
                // Before it is looked: what comes after that wakes this thread.
                reader.set_waker(Some(waker.clone()));
                is_done &= take(reader, message, |value| inbound.push(place, value));
            }
            if is_done {
                wake.wait_timeout(IDLE_PERIOD);
            }
        }
    }
}

/// Takes what came of a topic; whether that is all.
fn take(reader: &TopicReader, message: &RosMessage, push: impl Fn(Result<Vec<u8>, String>)) -> bool {
    for _ in 0..TURN {
        push(match reader.try_take_one() {
            Ok(Some(change)) => message.decode(&change.into_value().0).map_err(|error| error.to_string()),
            Ok(None) => return true,
            Err(error) => Err(error.to_string()),
        });
    }
    false
}
