//! Flow of messages from topics to inputs.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::Duration;

use slate_blackboard::wake::Wake;
use slate_topics::{InboundTopics, ReaderWaker, RosMessage};

use crate::wire::TopicReader;

/// Sleep time of a thread while no messages arrive.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Messages of a topic that are taken before those of the next.
const BATCH_LIMIT: usize = 256;

/// Readers of topics that fill inputs, by place.
pub struct TopicReaders(pub Vec<(Arc<dyn TopicReader>, RosMessage)>);

impl TopicReaders {
    /// Takes received messages until the end; `look` is called periodically.
    pub fn receive(&self, inbound: &InboundTopics, wake: &Arc<Wake>, ended: &AtomicBool, look: impl Fn()) {
        let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(wake))));
        while !ended.load(Ordering::Acquire) {
            look();
            let mut is_done = true;
            for (place, (reader, message)) in self.0.iter().enumerate() {
                // Before it is looked: what comes after that wakes this thread.
                reader.set_waker(&waker);
                is_done &= take(&**reader, message, |value| inbound.push(place, value));
                inbound.note_dropped(place, reader.take_dropped());
            }
            if is_done {
                wake.wait_timeout(IDLE_PERIOD);
            }
        }
    }
}

/// Takes the received messages of a topic; returns whether none is left.
fn take(reader: &dyn TopicReader, message: &RosMessage, push: impl Fn(Result<Vec<u8>, String>)) -> bool {
    for _ in 0..BATCH_LIMIT {
        push(match reader.take() {
            Ok(Some(bytes)) => message.decode(&bytes).map_err(|error| error.to_string()),
            Ok(None) => return true,
            Err(reason) => Err(reason),
        });
    }
    false
}
