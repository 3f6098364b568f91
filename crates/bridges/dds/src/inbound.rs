//! Flow of messages from topics to inputs.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::Duration;

use slate_blackboard::wake::Wake;
use slate_topics::{InboundTopics, ReaderWaker};

use crate::message::DdsMessage;
use crate::participant::DdsReader;

/// Sleep time of the thread while no messages arrive.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Messages of a topic that are taken before those of the next.
const BATCH_LIMIT: usize = 256;

/// Receives messages of topics for inputs, by place, until the end.
/// `look` is called in between.
pub fn receive(
    mut readers: Vec<(DdsReader, DdsMessage)>,
    inbound: &InboundTopics,
    wake: &Arc<Wake>,
    ended: &AtomicBool,
    look: impl Fn(),
) {
    let waker = Waker::from(Arc::new(ReaderWaker(Arc::clone(wake))));
    while !ended.load(Ordering::Acquire) {
        look();
        let mut is_done = true;
        for (place, (reader, message)) in readers.iter_mut().enumerate() {
            // Before messages are taken: later ones wake this thread.
            reader.watch(&waker);
            let mut taken = std::iter::from_fn(|| reader.take(&waker)).take(BATCH_LIMIT);
            let mut count = 0;
            taken.by_ref().for_each(|bytes| {
                count += 1;
                inbound.push(place, bytes.and_then(|bytes| message.decode(&bytes)));
            });
            is_done &= count < BATCH_LIMIT;
        }
        if is_done {
            wake.wait_timeout(IDLE_PERIOD);
        }
    }
}
