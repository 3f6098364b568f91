use std::collections::VecDeque;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, Weak};

use super::{Change, Database, Prefix, lock};

type Handler = dyn FnMut(&Database, &[Change]) + Send;

/// Handlers of changes, and the changes that they have not received yet.
#[derive(Default)]
pub(super) struct Handlers {
    subscribers: Mutex<Vec<Arc<HandlerSubscriber>>>,
    queue: Mutex<ChangeQueue>,
}

#[derive(Default)]
struct ChangeQueue {
    waiting: VecDeque<Arc<[Change]>>,
    /// True while a thread calls handlers.
    /// It takes all waiting changes, one after the other.
    busy: bool,
}

struct HandlerSubscriber {
    prefix: Prefix,
    alive: AtomicBool,
    panics: AtomicU64,
    /// Handler; only the one thread that calls handlers locks it.
    handler: Mutex<Box<Handler>>,
}

/// Subscription of a handler, until this is dropped.
#[must_use = "dropping it ends the subscription"]
pub struct Subscription {
    subscriber: Arc<HandlerSubscriber>,
    handlers: Weak<Handlers>,
}

impl Subscription {
    /// Number of the handler's panics.
    pub fn panics(&self) -> u64 {
        self.subscriber.panics.load(Ordering::Relaxed)
    }
}

impl Drop for Subscription {
    fn drop(&mut self) {
        self.subscriber.alive.store(false, Ordering::Release);
        if let Some(handlers) = self.handlers.upgrade() {
            lock(&handlers.subscribers).retain(|other| !Arc::ptr_eq(other, &self.subscriber));
        }
    }
}

impl fmt::Debug for Subscription {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Subscription").field("prefix", &self.subscriber.prefix).finish_non_exhaustive()
    }
}

impl Handlers {
    /// Adds a handler of the changes below a path.
    pub(super) fn subscribe(
        self: &Arc<Self>,
        prefix: Prefix,
        handler: impl FnMut(&Database, &[Change]) + Send + 'static,
    ) -> Subscription {
        let subscriber = Arc::new(HandlerSubscriber {
            prefix,
            alive: AtomicBool::new(true),
            panics: AtomicU64::new(0),
            handler: Mutex::new(Box::new(handler)),
        });
        lock(&self.subscribers).push(Arc::clone(&subscriber));
        Subscription { subscriber, handlers: Arc::downgrade(self) }
    }

    pub(super) fn queue(&self, changes: &[Change]) {
        if !changes.is_empty() {
            lock(&self.queue).waiting.push_back(changes.into());
        }
    }

    /// Calls the handlers of all waiting changes.
    /// Does nothing while another call is active.
    pub(super) fn deliver(&self, database: &Database) {
        loop {
            let changes = {
                let mut queue = lock(&self.queue);
                if queue.busy {
                    return;
                }
                let Some(changes) = queue.waiting.pop_front() else { return };
                queue.busy = true;
                changes
            };
            let subscribers = lock(&self.subscribers).clone();
            for subscriber in subscribers {
                subscriber.call(database, &changes);
            }
            lock(&self.queue).busy = false;
        }
    }
}

impl HandlerSubscriber {
    fn call(&self, database: &Database, changes: &[Change]) {
        let mine: Vec<Change> =
            changes.iter().filter(|change| self.prefix.holds(&change.names)).cloned().collect();
        if mine.is_empty() || !self.alive.load(Ordering::Acquire) {
            return;
        }
        let mut handler = lock(&self.handler);
        if catch_unwind(AssertUnwindSafe(|| handler(database, &mine))).is_err() {
            self.panics.fetch_add(1, Ordering::Relaxed);
        }
    }
}
