//! Buffer between the threads that log and the logger's thread.
//! A sender takes no lock, so that a thread that is preempted while it logs or writes delays no tick.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crossbeam_queue::ArrayQueue;
use slate_blackboard::wake::Wake;

struct Buffer<M> {
    messages: ArrayQueue<M>,
    arrived: Wake,
    /// Notified when half of the places are free again.
    emptied: Wake,
    senders: AtomicUsize,
    /// True once the receiver was dropped.
    closed: AtomicBool,
}

/// Interval at which a waiting sender checks for room.
const POLL_PERIOD: Duration = Duration::from_millis(1);

/// Returns the ends of a buffer with that many places.
pub(super) fn buffer<M>(capacity: usize) -> (Sender<M>, Receiver<M>) {
    let buffer = Arc::new(Buffer {
        messages: ArrayQueue::new(capacity),
        arrived: Wake::new(),
        emptied: Wake::new(),
        senders: AtomicUsize::new(1),
        closed: AtomicBool::new(false),
    });
    (Sender(Arc::clone(&buffer)), Receiver(buffer))
}

pub(super) struct Sender<M>(Arc<Buffer<M>>);

impl<M> Sender<M> {
    /// Sends without waiting.
    ///
    /// # Errors
    /// The message, when there is no room.
    pub fn try_send(&self, message: M) -> Result<(), M> {
        self.0.messages.push(message)?;
        self.0.arrived.notify(1);
        Ok(())
    }

    /// Sends, and waits for room; false if the receiver was dropped.
    pub fn send(&self, mut message: M) -> bool {
        loop {
            match self.try_send(message) {
                Ok(()) => return true,
                Err(_) if self.0.closed.load(Ordering::Acquire) => return false,
                Err(back) => message = back,
            }
            // If two wait, the notification is for one of them and the other one looks.
            self.0.emptied.wait_timeout(POLL_PERIOD);
        }
    }
}

impl<M> Clone for Sender<M> {
    fn clone(&self) -> Self {
        self.0.senders.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(&self.0))
    }
}

impl<M> Drop for Sender<M> {
    fn drop(&mut self) {
        if self.0.senders.fetch_sub(1, Ordering::AcqRel) == 1 {
            self.0.arrived.notify(1);
        }
    }
}

pub(super) struct Receiver<M>(Arc<Buffer<M>>);

/// Reason why no message was received.
pub(super) enum ReceiveError {
    /// None came in time.
    Timeout,
    /// None will ever come.
    Disconnected,
}

impl<M> Receiver<M> {
    /// Returns the next message, within `timeout`.
    ///
    /// # Errors
    /// When the buffer is empty.
    #[allow(clippy::disallowed_methods, reason = "how long nothing comes is a matter of the wall clock")]
    pub fn receive(&self, timeout: Duration) -> Result<M, ReceiveError> {
        if let Some(message) = self.take() {
            return Ok(message);
        }
        let start = Instant::now();
        loop {
            // Before the look into the queue, as the last sender may send and go in between.
            let ended = self.0.senders.load(Ordering::Acquire) == 0;
            if let Some(message) = self.take() {
                return Ok(message);
            }
            let left = timeout.saturating_sub(start.elapsed());
            match (ended, left) {
                (true, _) => return Err(ReceiveError::Disconnected),
                (false, Duration::ZERO) => return Err(ReceiveError::Timeout),
                (false, left) => self.0.arrived.wait_timeout(left),
            };
        }
    }

    fn take(&self) -> Option<M> {
        let message = self.0.messages.pop()?;
        // Not with every place, as each would wake a sender that fills just one.
        if self.0.messages.len() == self.0.messages.capacity() / 2 {
            self.0.emptied.notify(1);
        }
        Some(message)
    }
}

impl<M> Drop for Receiver<M> {
    fn drop(&mut self) {
        self.0.closed.store(true, Ordering::Release);
    }
}
