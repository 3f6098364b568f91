//! Collects the values of all threads.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering, fence};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::{Thread, ThreadId};

use slate_blackboard::channel::Tap;
use slate_blackboard::message::Message;
use slate_blackboard::{Property, Stamp};
use slate_sorted::SortedMap;

use super::channels::{Channel, Sent};
use super::ring::{Inlet, Outlet, ValueHead, ring, warm_ring};

/// Collects the values of all threads of an agent.
pub struct Hub {
    number: u64,
    /// Bytes that a thread may be ahead.
    buffer: usize,
    /// Initial size of a thread's ring, bytes.
    begin: AtomicUsize,
    /// Set while values are taken.
    is_on: AtomicBool,
    /// Set if any recording wants the log and the changes.
    wants_topics: AtomicBool,
    /// Set if a writing thread waits while its ring is full.
    waits: AtomicBool,
    /// Size of the largest wanted value, bytes.
    largest: AtomicUsize,
    /// Set when the present values must be in the file at once.
    pub urgent: AtomicBool,
    channels: Mutex<Vec<Channel>>,
    /// The recordings and the values they want, by number.
    wants: Mutex<SortedMap<u64, HubRecording>>,
    /// Rings that are not drained yet.
    fresh: Mutex<Vec<(ThreadId, Outlet)>>,
    /// Rings in reserve for threads without one.
    /// Thus no thread has to allocate one in the middle of a tick.
    spares: Mutex<Vec<(Inlet, Outlet)>>,
    /// The thread that takes values out; none before the beginning.
    reader: OnceLock<Thread>,
}

/// Predicate of a recording: true for channels whose values it wants.
pub type ChannelFilter = Box<dyn Fn(&Channel) -> bool + Send>;

struct HubRecording {
    wants: ChannelFilter,
    /// Set if the recording counts as an observer, so that debug outputs have values.
    watches: bool,
}

/// Receives the values from the rings.
pub trait Sink: Send {
    /// Takes a value of the channel with that number.
    /// Values that belong to no property have numbers of their own.
    fn value(&mut self, channel: Option<&Channel>, id: u32, items: usize, stamp: Stamp, bytes: &[u8]);
}

/// First number that belongs to no property.
pub const FIRST_TOPIC_ID: u32 = u32::MAX - 16;

/// Initial size of a thread's ring while no file is written, bytes.
/// It stays in the cache, and grows when it is full.
const INITIAL_RING_SIZE: usize = 256 << 10;

/// The largest ring, bytes.
const MAX_RING_SIZE: usize = 1 << 30;

/// Maximum size of a ring for more than two of the largest values, bytes.
/// A larger one is made only on request.
const MAX_AMPLE_RING_SIZE: usize = 32 << 20;

/// The largest one before a reader takes values out, as perhaps none ever will.
const MAX_RING_SIZE_BEFORE_START: usize = 64 << 20;

/// The ring of this thread to each recorder.
struct ThreadRing {
    hub: u64,
    inlet: Inlet,
}

thread_local! {
    static THREAD_RINGS: RefCell<Vec<ThreadRing>> = const { RefCell::new(Vec::new()) };
}

/// Counter of recorders.
/// It tells them apart in a thread that writes for several agents.
static HUB_COUNTER: AtomicU64 = AtomicU64::new(0);

/// Number of rings in reserve.
/// One is for the loop, one for the thread of its timing, and another.
const SPARE_RINGS: usize = 3;

/// Enables the values of a property if a recording wants them.
/// Returns whether one does.
fn enable_channel(wants: &SortedMap<u64, HubRecording>, channel: &Channel) -> bool {
    let mut wanting = wants.values().filter(|wanting| (wanting.wants)(channel)).peekable();
    let is_wanted = wanting.peek().is_some();
    channel.watch(wanting.any(|wanting| wanting.watches));
    channel.wanted.store(is_wanted, Ordering::Relaxed);
    is_wanted
}

impl Hub {
    /// Creates a hub without recordings.
    /// Each writing thread may be ahead by `buffer` bytes.
    pub fn new(buffer: u64) -> Arc<Self> {
        let buffer = usize::try_from(buffer).unwrap_or(MAX_RING_SIZE);
        Arc::new(Self {
            number: HUB_COUNTER.fetch_add(1, Ordering::Relaxed),
            buffer,
            begin: AtomicUsize::new(buffer.min(INITIAL_RING_SIZE)),
            is_on: AtomicBool::new(true),
            wants_topics: AtomicBool::new(false),
            waits: AtomicBool::new(false),
            largest: AtomicUsize::new(0),
            urgent: AtomicBool::new(false),
            channels: Mutex::default(),
            wants: Mutex::default(),
            fresh: Mutex::default(),
            spares: Mutex::default(),
            reader: OnceLock::new(),
        })
    }

    /// Returns the tap of a property.
    pub fn tap(self: &Arc<Self>, property: &Property) -> Option<Arc<dyn Tap>> {
        // The recorder's own properties would record themselves.
        if property.path().starts_with("record/") {
            return None;
        }
        let channel = Channel::of(property);
        let (dropped, wanted) = (Arc::clone(&channel.dropped), Arc::clone(&channel.wanted));
        // Held until it is among the channels, so that no want misses it.
        let wants = self.wants();
        if enable_channel(&wants, &channel) {
            self.largest.fetch_max(channel.largest, Ordering::Relaxed);
        }
        let mut channels = self.channels();
        let id = u32::try_from(channels.len()).ok().filter(|id| *id < FIRST_TOPIC_ID)?;
        channels.push(channel);
        Some(Arc::new(PropertyTap { hub: Arc::clone(self), id, dropped, wanted }))
    }

    /// Adds a recording of that number.
    pub fn add_recording(&self, number: u64, want: ChannelFilter) {
        self.begin.store(self.buffer, Ordering::Relaxed);
        self.add(number, want, true);
    }

    /// Adds a recording with smaller rings at the beginning.
    /// Otherwise as [`add_recording`](Hub::add_recording); nothing is computed for it alone.
    pub fn add_light_recording(&self, number: u64, want: ChannelFilter) {
        self.add(number, want, false);
    }

    fn add(&self, number: u64, want: ChannelFilter, watches: bool) {
        let mut wants = self.wants();
        let channels = self.channels();
        let largest = channels.iter().filter(|channel| want(channel)).map(|channel| channel.largest).max();
        drop(channels);
        self.largest.fetch_max(largest.unwrap_or(0), Ordering::Relaxed);
        if self.reader.get().is_some() {
            // All memory that this takes is there before the first value comes.
            self.make_spares();
        }
        wants.insert(number, HubRecording { wants: want, watches });
        self.enable_channels(&wants);
        // A recording that reads the present values and then takes new ones misses none.
        fence(Ordering::SeqCst);
    }

    /// Removes a recording.
    pub fn remove_recording(&self, number: u64) {
        let mut wants = self.wants();
        wants.remove(&number);
        self.enable_channels(&wants);
    }

    fn enable_channels(&self, wants: &SortedMap<u64, HubRecording>) {
        for channel in &*self.channels() {
            enable_channel(wants, channel);
        }
        self.wants_topics.store(!wants.is_empty(), Ordering::Relaxed);
    }

    fn wants(&self) -> MutexGuard<'_, SortedMap<u64, HubRecording>> {
        self.wants.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Creates rings for threads without one, or with one that is too small.
    fn make_spares(&self) {
        let capacity = self.ring_size(0);
        self.spares().retain(|(inlet, _)| inlet.capacity() >= capacity);
        let missing = SPARE_RINGS.saturating_sub(self.spares().len());
        let made: Vec<_> = (0..missing).map(|_| warm_ring(capacity)).collect();
        self.spares().extend(made);
    }

    fn spares(&self) -> MutexGuard<'_, Vec<(Inlet, Outlet)>> {
        self.spares.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins: from now on `reader` takes values out of the rings.
    pub fn begin(&self, waits: bool, reader: Thread) {
        self.waits.store(waits, Ordering::Release);
        // It begins once.
        let _ = self.reader.set(reader);
    }

    /// Stops taking values.
    pub fn stop(&self) {
        self.is_on.store(false, Ordering::Release);
    }

    /// Returns true while values are taken.
    pub fn is_on(&self) -> bool {
        self.is_on.load(Ordering::Acquire)
    }

    /// The channels of all recorded properties.
    pub fn channels(&self) -> MutexGuard<'_, Vec<Channel>> {
        self.channels.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Hands over a value whose bytes come in parts; false if there is no room for it.
    #[inline]
    pub fn push<const PARTS: usize>(
        &self,
        id: u32,
        items: u32,
        sequence: u64,
        time: u64,
        parts: [&[u8]; PARTS],
    ) -> bool {
        if !self.is_on.load(Ordering::Relaxed) {
            return true;
        }
        let length = parts.iter().map(|part| part.len()).sum::<usize>();
        let Ok(length) = u32::try_from(length) else { return false };
        let head = ValueHead { id, items, length, sequence, time };
        // Nothing else of this thread writes values meanwhile, and at its end it is too late.
        let push = |own: &RefCell<Vec<ThreadRing>>| match own.try_borrow_mut() {
            Ok(mut own) => self.push_to(&mut own, head, parts),
            Err(_) => false,
        };
        THREAD_RINGS.try_with(push).unwrap_or(false)
    }

    #[inline]
    fn push_to<const PARTS: usize>(
        &self,
        own: &mut Vec<ThreadRing>,
        head: ValueHead,
        parts: [&[u8]; PARTS],
    ) -> bool {
        if let Some(own) = own.iter_mut().find(|own| own.hub == self.number)
            && own.inlet.push(head, parts)
        {
            return true;
        }
        self.push_slow(own, head, parts)
    }

    /// Hands over a value if this thread's ring is full or does not exist yet.
    #[cold]
    fn push_slow<const PARTS: usize>(
        &self,
        own: &mut Vec<ThreadRing>,
        head: ValueHead,
        parts: [&[u8]; PARTS],
    ) -> bool {
        let needed = head.length as usize;
        loop {
            let Some(index) = own.iter().position(|own| own.hub == self.number) else {
                own.retain(|own| !own.inlet.is_abandoned());
                own.push(self.new_ring(needed));
                continue;
            };
            let inlet = &mut own[index].inlet;
            if inlet.push(head, parts) {
                return true;
            }
            let has_begun = self.reader.get().is_some();
            if needed > inlet.capacity() || inlet.capacity() < self.buffer || !has_begun {
                // Values written before the file is open must fit, as must the first value of a larger kind, and more than
                // was thought at the beginning.
                let needed = needed.max(if has_begun { self.buffer / 2 } else { 0 });
                let wanted = needed.saturating_mul(2).max(inlet.capacity().saturating_mul(2));
                if wanted > if has_begun { MAX_RING_SIZE } else { MAX_RING_SIZE_BEFORE_START } {
                    return false;
                }
                own[index] = self.new_ring(wanted);
                continue;
            }
            if let Some(reader) = self.reader.get() {
                reader.unpark();
            }
            if !self.waits.load(Ordering::Acquire) {
                return false;
            }
            if !self.is_on() || inlet.is_abandoned() {
                // The recorder has given up, and reports that.
                return true;
            }
            std::thread::yield_now();
        }
    }

    /// Returns the size of a ring for values of `needed` bytes and more.
    fn ring_size(&self, needed: usize) -> usize {
        let largest = self.largest.load(Ordering::Relaxed);
        // The recorder may have to wait for a processor while a camera continues.
        let several = largest.saturating_mul(16).min(MAX_AMPLE_RING_SIZE);
        let begin = self.begin.load(Ordering::Relaxed);
        needed.max(begin).max(several).max(largest.saturating_mul(2)).min(MAX_RING_SIZE)
    }

    /// Creates a ring of this thread, for values of `needed` bytes and more.
    fn new_ring(&self, needed: usize) -> ThreadRing {
        let capacity = self.ring_size(needed);
        let spare = self.spares.try_lock().ok().and_then(|mut spares| spares.pop());
        let spare = spare.filter(|(inlet, _)| inlet.capacity() >= capacity);
        let (inlet, outlet) = spare.unwrap_or_else(|| ring(capacity));
        let mut fresh = self.fresh.lock().unwrap_or_else(PoisonError::into_inner);
        fresh.push((std::thread::current().id(), outlet));
        ThreadRing { hub: self.number, inlet }
    }

    /// Hands something over that is encoded already.
    pub fn push_whole(&self, id: u32, sequence: u64, time: u64, bytes: &[u8]) {
        if self.wants_topics.load(Ordering::Relaxed) {
            self.push(id, 0, sequence, time, [bytes]);
        }
    }

    /// Requests that the present values are in the file at once.
    pub fn request_write(&self) {
        self.urgent.store(true, Ordering::Release);
        self.wake();
    }

    /// Wakes the reader of the rings.
    pub fn wake(&self) {
        if let Some(reader) = self.reader.get() {
            reader.unpark();
        }
    }
}

/// Hands the values of one property over.
struct PropertyTap {
    hub: Arc<Hub>,
    id: u32,
    dropped: Arc<AtomicU64>,
    wanted: Arc<AtomicBool>,
}

impl Tap for PropertyTap {
    fn wrote(&self, bytes: &[u8], items: usize, stamp: Stamp) {
        if self.wanted.load(Ordering::Relaxed)
            && !self.hub.push(self.id, items as u32, stamp.sequence, stamp.time, [bytes])
        {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn took(&self, message: &Message<'_>, now: u64) {
        let sent = Sent { time: message.time(), sender: message.sender() }.to_bytes();
        let (items, sequence) = (message.items() as u32, message.sequence());
        if self.wanted.load(Ordering::Relaxed)
            && !self.hub.push(self.id, items, sequence, now, [sent.as_slice(), message.bytes()])
        {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Reader of the values in all rings.
#[derive(Default)]
pub struct Drain {
    rings: Vec<(ThreadId, Outlet)>,
    channels: Vec<Channel>,
    bytes: Vec<u8>,
}

impl Drain {
    /// Takes out the present values; returns true if there were any.
    pub fn take_values(&mut self, hub: &Hub, sink: &mut dyn Sink) -> bool {
        self.rings.append(&mut hub.fresh.lock().unwrap_or_else(PoisonError::into_inner));
        let mut found = false;
        let mut index = 0;
        while index < self.rings.len() {
            let thread = self.rings[index].0;
            // A thread continues in a larger ring; what is in the one before comes first.
            if self.rings[..index].iter().any(|(own, _)| *own == thread) {
                index += 1;
                continue;
            }
            let outlet = &mut self.rings[index].1;
            let is_over = outlet.is_abandoned();
            // Not more than is there now, so that the others get their turn.
            let mut budget = outlet.waiting();
            while budget > 0 {
                let channels = &mut self.channels;
                let taken = outlet.take(budget, &mut self.bytes, |head, bytes| {
                    let index = head.id as usize;
                    if index >= channels.len() && head.id < FIRST_TOPIC_ID {
                        let known = hub.channels();
                        channels.extend(known[channels.len()..].iter().cloned());
                    }
                    let stamp = Stamp { sequence: head.sequence, time: head.time, generation: 0 };
                    sink.value(channels.get(index), head.id, head.items as usize, stamp, bytes);
                });
                if taken == 0 {
                    break;
                }
                found = true;
                budget -= taken;
            }
            if is_over && outlet.waiting() == 0 {
                drop(self.rings.remove(index));
            } else {
                index += 1;
            }
        }
        found
    }
}
