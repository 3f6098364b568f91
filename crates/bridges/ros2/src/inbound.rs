//! From topics to inputs.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::Duration;

use slate_blackboard::wake::Wake;
use slate_topics::{InboundTopics, ReaderWaker, RosMessage};

use crate::wire::TopicReader;

/// How long a thread sleeps when nothing comes.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Messages of a topic that are taken before those of the next.
const TURN: usize = 256;

/// Readers of topics that fill inputs, by place.
pub struct TopicReaders(pub Vec<(Arc<dyn TopicReader>, RosMessage)>);

impl TopicReaders {
    /// Takes what comes, until the end; `look` is called now and then.
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

/// Takes what came of a topic; whether that is all.
fn take(reader: &dyn TopicReader, message: &RosMessage, push: impl Fn(Result<Vec<u8>, String>)) -> bool {
    for _ in 0..TURN {
        push(match reader.take() {
            Ok(Some(bytes)) => message.decode(&bytes).map_err(|error| error.to_string()),
            Ok(None) => return true,
            Err(reason) => Err(reason),
        });
    }
    false
}
