use std::ops::DerefMut;
use std::sync::{Arc, PoisonError, Weak};

use super::Pattern;
use crate::channel::HandleChange;
use crate::sync::{AtomicU32, AtomicU64, GuardedCell, Mutex, Ordering, order};
use crate::wake::Wake;

/// Event of the property at a path.
/// The first event of a property is that it appeared and the last that it vanished, also when another one takes its
/// path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The property was added.
    Appeared(Arc<str>),
    /// The property was removed.
    /// Existing handles still work, without an effect on the board.
    Vanished(Arc<str>),
    /// The property has a writer, of that generation.
    /// The event may come before that of the former writer's leaving. A property that the host sets has a writer that
    /// never leaves, so it has no such event.
    WriterCame(Arc<str>, u64),
    /// The writer of that generation is gone.
    WriterLeft(Arc<str>, u64),
    /// The property has one more reader.
    /// Tools that look at the newest value don't count.
    ReaderCame(Arc<str>),
    /// The property has one reader less.
    ReaderLeft(Arc<str>),
}

impl Event {
    /// Returns the path of the property.
    pub fn path(&self) -> &Arc<str> {
        match self {
            Self::Appeared(path)
            | Self::Vanished(path)
            | Self::WriterCame(path, _)
            | Self::WriterLeft(path, _)
            | Self::ReaderCame(path)
            | Self::ReaderLeft(path) => path,
        }
    }
}

/// Receiver of the events of properties, in the order of each property.
/// It is an iterator over a queue, which can continue after it has returned `None`. The cause of an event never waits for
/// it.
#[derive(Debug)]
pub struct Observer {
    ring: Arc<Ring>,
}

impl Observer {
    /// Returns the number of events lost because the queue was full.
    pub fn missed(&self) -> u64 {
        self.ring.missed.load(Ordering::Relaxed)
    }
}

impl Iterator for Observer {
    type Item = Event;

    fn next(&mut self) -> Option<Event> {
        self.ring.pop()
    }
}

/// Queue of the events for one observer.
/// One thread at a time puts events in, and one takes them out.
#[derive(Debug)]
struct Ring {
    pattern: Pattern,
    wake: Option<Arc<Wake>>,
    slots: Box<[GuardedCell<Option<Event>>]>,
    pushed: AtomicU64,
    popped: AtomicU64,
    missed: AtomicU64,
}

// SAFETY: the pusher uses a slot before it counts as pushed and after it counts as popped, else the observer.
unsafe impl Send for Ring {}
// SAFETY: as above.
unsafe impl Sync for Ring {}

impl Ring {
    fn slot(&self, number: u64) -> &GuardedCell<Option<Event>> {
        &self.slots[(number % self.slots.len() as u64) as usize]
    }

    /// Adds an event; called under the lock of the list, so by one thread at a time.
    fn push(&self, event: &Event) {
        if !self.pattern.matches(event.path()) {
            return;
        }
        let pushed = self.pushed.load(Ordering::Relaxed);
        let waiting = pushed - self.popped.load(order::ACQUIRE);
        if waiting < self.slots.len() as u64 || cfg!(feature = "mutant-events") {
            // SAFETY: the observer has taken the earlier item, and no other thread pushes.
            self.slot(pushed).write(|slot| unsafe { *slot = Some(event.clone()) });
            self.pushed.store(pushed + 1, order::RELEASE);
        } else {
            self.missed.fetch_add(1, Ordering::Relaxed);
        }
        if let Some(wake) = &self.wake {
            wake.notify(1);
        }
    }

    /// Takes the next event; called by the observer only.
    fn pop(&self) -> Option<Event> {
        let popped = self.popped.load(Ordering::Relaxed);
        if self.pushed.load(order::ACQUIRE) == popped {
            return None;
        }
        // SAFETY: it was pushed, so no thread touches it until it is popped.
        let event = self.slot(popped).write(|slot| unsafe { (*slot).take() });
        self.popped.store(popped + 1, order::RELEASE);
        event
    }
}

/// Observers of a board.
#[derive(Debug)]
pub(super) struct Observers {
    /// Number of changes by the host.
    settings: Arc<AtomicU64>,
    /// Queues of the observers.
    /// Locked to cause an event, and to begin to observe; not to get events.
    rings: Mutex<Vec<Weak<Ring>>>,
}

impl Observers {
    pub fn new() -> Self {
        Self { settings: Arc::new(AtomicU64::new(0)), rings: Mutex::new(Vec::new()) }
    }

    pub fn settings(&self) -> SettingsCounter {
        SettingsCounter(Arc::clone(&self.settings))
    }

    fn rings(&self) -> impl DerefMut<Target = Vec<Weak<Ring>>> {
        self.rings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn observe(&self, pattern: &Pattern, limit: usize, wake: Option<Arc<Wake>>) -> Observer {
        let ring = Arc::new(Ring {
            pattern: pattern.clone(),
            wake,
            slots: (0..limit.max(1)).map(|_| GuardedCell::new(None)).collect(),
            pushed: AtomicU64::new(0),
            popped: AtomicU64::new(0),
            missed: AtomicU64::new(0),
        });
        let mut rings = self.rings();
        rings.retain(|ring| ring.strong_count() > 0);
        rings.push(Arc::downgrade(&ring));
        Observer { ring }
    }
}

/// Counter of changes to all properties of a board that the host sets.
/// If it is unchanged, a module knows with one read that none of its own have changed.
#[derive(Clone, Debug)]
pub struct SettingsCounter(Arc<AtomicU64>);

impl SettingsCounter {
    /// Returns the number of changes so far.
    /// A reader of the number sees everything that was set until then.
    #[inline]
    pub fn count(&self) -> u64 {
        self.0.load(order::ACQUIRE)
    }
}

/// Source of the events of one property.
#[derive(Debug)]
pub(super) struct EventSource {
    path: Arc<str>,
    observers: Arc<Observers>,
    /// 1 from its appearing to its vanishing. Changed under the lock of the list.
    present: AtomicU32,
}

impl EventSource {
    pub fn new(path: &str, observers: Arc<Observers>) -> Self {
        Self { path: path.into(), observers, present: AtomicU32::new(0) }
    }

    pub fn path(&self) -> &str {
        &self.path
    }

    /// Counts a change of the property by the host.
    pub fn set(&self) {
        self.observers.settings.fetch_add(1, order::RELEASE);
    }

    pub fn appear(&self) {
        self.emit(Event::Appeared(Arc::clone(&self.path)));
    }

    pub fn vanish(&self) {
        self.emit(Event::Vanished(Arc::clone(&self.path)));
    }

    pub fn link(&self, link: HandleChange) {
        let path = Arc::clone(&self.path);
        self.emit(match link {
            HandleChange::WriterCame(generation) => Event::WriterCame(path, generation),
            HandleChange::WriterLeft(generation) => Event::WriterLeft(path, generation),
            HandleChange::ReaderCame => Event::ReaderCame(path),
            HandleChange::ReaderLeft => Event::ReaderLeft(path),
        });
    }

    fn emit(&self, event: Event) {
        let mut rings = self.observers.rings();
        let present = match event {
            Event::Appeared(_) => {
                self.present.store(1, Ordering::Relaxed);
                true
            }
            Event::Vanished(_) => self.present.swap(0, Ordering::Relaxed) == 1,
            _ => self.present.load(Ordering::Relaxed) == 1,
        };
        if present {
            rings.retain(|ring| ring.upgrade().inspect(|ring| ring.push(&event)).is_some());
        }
    }
}
