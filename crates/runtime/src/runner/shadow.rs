//! New code beside the old: it makes the same steps on the same inputs in a thread of its own, and what it writes is
//! compared and thrown away. So whatever it does, the module does not notice.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam_queue::ArrayQueue;
use slate_blackboard::Shape;
use slate_blackboard::channel::Writer;
use slate_blackboard::interface::{FloatMap, Text, View};
use slate_blackboard::wake::Wake;
use slate_module::{Description, Direction, Entry, Flags, Frame, Host, PortSlot, Random, interface};

use super::{Memory, Retired, Runner};
use crate::log::ModuleLog;

/// How new code compares with the old: `/module/shadow`.
#[interface]
pub(crate) struct ShadowState {
    /// Steps made.
    pub ticks: u64,
    /// Steps in which it wrote something else.
    pub differences: u64,
    /// Steps that it missed because it was too slow; from then on its state may be another one.
    pub skipped: u64,
    /// Steps in which it panicked.
    pub panics: u64,
    /// The module's step in which it first wrote something else; 0 for none.
    pub first_difference: u64,
    /// The port with that difference.
    pub port: Text<60>,
}

/// Steps that the new code may lag behind.
const LAG: usize = 16;

/// What a step saw and wrote.
struct Snapshot {
    now: u64,
    elapsed: u64,
    number: u64,
    params_version: u64,
    random: Random,
    params: Memory,
    ports: Vec<PortCopy>,
}

/// What a port held.
struct PortCopy {
    slot: PortSlot,
    shape: Shape,
    /// Input: the value. Output: what the old code wrote.
    value: Memory,
    /// Queue and inbox: the values. Outbox: what the old code sent.
    values: Vec<Memory>,
    entries: Vec<Entry>,
}

// SAFETY: the pointers lead into memory that the snapshot owns.
unsafe impl Send for Snapshot {}

/// The tick's end of a shadow.
pub(crate) struct Shadow {
    shared: Arc<Shared>,
    current: Option<Box<Snapshot>>,
    thread: Option<JoinHandle<Retired>>,
}

struct Shared {
    free: ArrayQueue<Box<Snapshot>>,
    filled: ArrayQueue<Box<Snapshot>>,
    wake: Wake,
    stop: AtomicBool,
    skipped: AtomicU64,
}

/// What a port carries, and how much of it.
struct Carried {
    name: String,
    direction: Direction,
    shape: Shape,
    window: usize,
    floats: FloatMap,
}

impl Shadow {
    /// Starts the new code beside the old.
    ///
    /// # Errors
    /// When its thread can't be started.
    pub fn start(
        name: &str,
        description: &Description,
        new: Retired,
        writer: Writer,
        log: Box<ModuleLog>,
    ) -> std::io::Result<Self> {
        let params = description.params.size;
        let ports: Vec<_> = description
            .ports
            .iter()
            .map(|port| Carried {
                name: port.name.clone(),
                direction: port.direction,
                shape: port.descriptor.shape(port.capacity),
                window: port.window,
                floats: FloatMap::new(port.descriptor),
            })
            .collect();
        let shared = Arc::new(Shared {
            free: ArrayQueue::new(LAG),
            filled: ArrayQueue::new(LAG),
            wake: Wake::new(),
            stop: AtomicBool::new(false),
            skipped: AtomicU64::new(0),
        });
        for _ in 0..LAG {
            // There is room for as many.
            let _ = shared.free.push(Box::new(Snapshot::new(&ports, params)));
        }
        let own = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name(format!("{name}/shadow"))
            .spawn(move || Follower { ports, params, new, writer, log, shared: own }.follow())?;
        Ok(Self { shared, current: None, thread: Some(thread) })
    }

    /// Before a step of the old code: keeps what it will see.
    pub fn before(&mut self, frame: &Frame, slots: &[PortSlot], random: Random) {
        let Some(mut snapshot) = self.shared.free.pop() else {
            self.shared.skipped.fetch_add(1, Ordering::Relaxed);
            return;
        };
        snapshot.see(frame, slots, random);
        self.current = Some(snapshot);
    }

    /// After a step of the old code: keeps what it wrote, and lets the new code make the same step.
    pub fn after(&mut self, slots: &[PortSlot]) {
        if let Some(mut snapshot) = self.current.take() {
            snapshot.keep(slots);
            // There is room for as many as there are.
            let _ = self.shared.filled.push(snapshot);
            self.shared.wake.notify(1);
        }
    }

    /// Ends the new code's steps when it has made all that it was given, and returns it; nothing when it does not
    /// return within `limit`.
    pub fn end(mut self, limit: Duration) -> Option<Retired> {
        self.shared.stop.store(true, Ordering::Release);
        self.shared.wake.notify(1);
        let thread = self.thread.take()?;
        let mut waited = Duration::ZERO;
        while !thread.is_finished() && waited < limit {
            std::thread::sleep(LOOK);
            waited += LOOK;
        }
        // A thread that hangs keeps what it uses.
        if thread.is_finished() { thread.join().ok() } else { None }
    }
}

/// How often is looked whether the thread has ended.
const LOOK: Duration = Duration::from_millis(1);

impl Drop for Shadow {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Release);
        self.shared.wake.notify(1);
    }
}

impl Snapshot {
    fn new(ports: &[Carried], params: usize) -> Self {
        Self {
            now: 0,
            elapsed: 0,
            number: 0,
            params_version: 0,
            random: Random::new(0, ""),
            params: Memory::zeroed(params),
            ports: ports.iter().map(PortCopy::new).collect(),
        }
    }

    fn see(&mut self, frame: &Frame, slots: &[PortSlot], random: Random) {
        (self.now, self.elapsed, self.number) = (frame.now, frame.elapsed, frame.number);
        (self.params_version, self.random) = (frame.params_version, random);
        // SAFETY: the frame points to a value of the parameters, and the copy is as large.
        unsafe { self.params.as_mut_ptr().copy_from_nonoverlapping(frame.params, frame.params_size) };
        for (copy, slot) in self.ports.iter_mut().zip(slots) {
            copy.see(slot);
        }
    }

    fn keep(&mut self, slots: &[PortSlot]) {
        for (copy, slot) in self.ports.iter_mut().zip(slots) {
            copy.keep(slot);
        }
    }
}

impl PortCopy {
    fn new(port: &Carried) -> Self {
        let size = port.shape.bytes(port.shape.capacity);
        let several = matches!(port.direction, Direction::Queue | Direction::Inbox | Direction::Outbox);
        let mut values: Vec<_> =
            (0..if several { port.window.max(16) } else { 0 }).map(|_| Memory::zeroed(size)).collect();
        let entries = values.iter_mut().map(|value| entry(value.as_mut_ptr())).collect();
        let slot = PortSlot {
            schema: 0,
            direction: port.direction as u32,
            data: std::ptr::null_mut(),
            items: Cell::new(0),
            capacity: port.shape.capacity,
            stamp: Default::default(),
            flags: Cell::new(0),
            priority: Cell::new(0),
            entries: std::ptr::null(),
            count: Cell::new(0),
            missed: 0,
        };
        Self { slot, shape: port.shape, value: Memory::zeroed(size), values, entries }
    }

    /// How many of so many tail items the copy has room for, and the bytes of a value with them.
    fn extent(&self, items: usize) -> (usize, usize) {
        let items = items.min(self.shape.capacity);
        (items, self.shape.bytes(items))
    }

    /// Copies what a step will see.
    fn see(&mut self, slot: &PortSlot) {
        let own = &mut self.slot;
        (own.schema, own.stamp, own.missed, own.capacity) =
            (slot.schema, slot.stamp, slot.missed, slot.capacity);
        own.flags.set(slot.flags.get());
        own.items.set(slot.items.get());
        match self.slot.direction {
            INPUT => {
                let (items, bytes) = self.extent(slot.items.get());
                // SAFETY: the slot holds a value of at least so many items, and the copy has room for them.
                unsafe { self.value.as_mut_ptr().copy_from_nonoverlapping(slot.data, bytes) };
                self.slot.items.set(items);
                self.slot.data = self.value.as_mut_ptr();
            }
            QUEUE | INBOX => self.copy_entries(slot),
            _ => {
                // Whether a debug output is wanted is all that a step sees of an output.
                self.slot.data = slot.data;
                self.slot.count.set(0);
            }
        }
    }

    /// Copies what a step wrote.
    fn keep(&mut self, slot: &PortSlot) {
        match self.slot.direction {
            INPUT | QUEUE | INBOX => {}
            OUTBOX => self.copy_entries(slot),
            _ => {
                self.slot.flags.set(slot.flags.get());
                self.slot.items.set(slot.items.get());
                self.slot.priority.set(slot.priority.get());
                if slot.flags.get() & Flags::SET != 0 && !slot.data.is_null() {
                    let (_, bytes) = self.extent(slot.items.get().min(slot.capacity));
                    // SAFETY: the step wrote so many items, and the copy has room for them.
                    unsafe { self.value.as_mut_ptr().copy_from_nonoverlapping(slot.data, bytes) };
                }
            }
        }
    }

    fn copy_entries(&mut self, slot: &PortSlot) {
        let count = slot.count.get().min(self.entries.len());
        for i in 0..count {
            // SAFETY: the slot has that many entries, each with a value of its items, for which the copy has room.
            unsafe {
                let entry = &*slot.entries.add(i);
                let (items, bytes) = self.extent(entry.items.get());
                self.values[i].as_mut_ptr().copy_from_nonoverlapping(entry.data, bytes);
                let own = &mut self.entries[i];
                own.items.set(items);
                (own.stamp, own.sender) = (entry.stamp, entry.sender);
                own.answer.set(0);
            }
        }
        self.slot.count.set(count);
        self.slot.entries = self.entries.as_ptr();
    }
}

const INPUT: u32 = Direction::Input as u32;
const QUEUE: u32 = Direction::Queue as u32;
const INBOX: u32 = Direction::Inbox as u32;
const OUTBOX: u32 = Direction::Outbox as u32;

fn entry(data: *mut u8) -> Entry {
    Entry { data, items: Cell::new(0), stamp: Default::default(), answer: Cell::new(0), sender: 0 }
}

/// The thread's end.
struct Follower {
    ports: Vec<Carried>,
    params: usize,
    new: Retired,
    writer: Writer,
    log: Box<ModuleLog>,
    shared: Arc<Shared>,
}

// SAFETY: instances are `Send`, and the rest is this thread's alone.
unsafe impl Send for Follower {}

impl Follower {
    /// Makes every step that the old code makes, until it is told to stop.
    fn follow(mut self) -> Retired {
        let mut state = ShadowState::default();
        // Where the new code writes.
        let mut outputs: Vec<_> = self.ports.iter().map(PortCopy::new).collect();
        let host = self.log.host();
        loop {
            let Some(mut snapshot) = self.shared.filled.pop() else {
                if self.shared.stop.load(Ordering::Acquire) {
                    return self.new;
                }
                self.shared.wake.wait_timeout(Duration::from_millis(100));
                continue;
            };
            let code = self.step(&snapshot, &mut outputs, &host);
            state.ticks += 1;
            state.skipped = self.shared.skipped.load(Ordering::Relaxed);
            if code < 0 {
                state.panics += 1;
            }
            if let Some(port) = self.difference(&mut snapshot, &mut outputs) {
                state.differences += 1;
                if state.first_difference == 0 {
                    (state.first_difference, state.port) = (snapshot.number, Text::new(port));
                }
            }
            // Only a recorder in lockstep may hold a writer up; the next state comes with the next step.
            let _ = self.writer.write(View::of(&state).bytes(), 0, snapshot.now);
            // There is room for as many as there are.
            let _ = self.shared.free.push(snapshot);
        }
    }

    fn step(&mut self, snapshot: &Snapshot, outputs: &mut [PortCopy], host: &Host) -> i32 {
        let slots: Vec<PortSlot> = snapshot
            .ports
            .iter()
            .zip(outputs.iter_mut())
            .map(|(seen, output)| {
                let writes = !matches!(seen.slot.direction, INPUT | QUEUE | INBOX);
                let wanted = seen.slot.direction != Direction::Debug as u32 || !seen.slot.data.is_null();
                let entries = if writes { output.entries.as_ptr() } else { seen.entries.as_ptr() };
                PortSlot {
                    schema: seen.slot.schema,
                    direction: seen.slot.direction,
                    data: match writes {
                        true if wanted => output.value.as_mut_ptr(),
                        true => std::ptr::null_mut(),
                        false => seen.slot.data,
                    },
                    items: Cell::new(if writes { 0 } else { seen.slot.items.get() }),
                    capacity: seen.slot.capacity,
                    stamp: seen.slot.stamp,
                    flags: Cell::new(if writes { 0 } else { seen.slot.flags.get() }),
                    priority: Cell::new(0),
                    entries,
                    count: Cell::new(if writes { 0 } else { seen.slot.count.get() }),
                    missed: seen.slot.missed,
                }
            })
            .collect();
        let random = Cell::new(snapshot.random);
        let frame = Frame {
            ports: slots.as_ptr(),
            port_count: slots.len(),
            params: snapshot.params.as_ptr(),
            params_size: self.params,
            params_version: snapshot.params_version,
            now: snapshot.now,
            elapsed: snapshot.elapsed,
            number: snapshot.number,
            random: &raw const random,
            host,
        };
        self.log.set_time(snapshot.now);
        // SAFETY: the frame was filled for this instance, which is this thread's alone.
        let code = unsafe { self.new.tick(&raw const frame) };
        for (slot, output) in slots.iter().zip(outputs) {
            output.slot.flags.set(slot.flags.get());
            output.slot.items.set(slot.items.get());
            output.slot.priority.set(slot.priority.get());
            output.slot.count.set(slot.count.get());
        }
        code
    }

    /// The first port to which the new code wrote something else.
    fn difference(&self, snapshot: &mut Snapshot, outputs: &mut [PortCopy]) -> Option<&str> {
        let ports = self.ports.iter().zip(&mut snapshot.ports).zip(outputs);
        let mut different =
            ports.filter_map(|((port, old), new)| differ(port, old, new).then_some(&port.name));
        different.next().map(String::as_str)
    }
}

fn differ(port: &Carried, old: &mut PortCopy, new: &mut PortCopy) -> bool {
    match port.direction {
        Direction::Output | Direction::Debug | Direction::Command => {
            let is_set = |copy: &PortCopy| copy.slot.flags.get() & Flags::SET != 0;
            if !is_set(old) && !is_set(new) {
                return false;
            }
            if is_set(old) != is_set(new)
                || old.slot.items.get() != new.slot.items.get()
                || old.slot.priority.get() != new.slot.priority.get()
            {
                return true;
            }
            let (items, bytes) = new.extent(new.slot.items.get());
            let (old, new) = (old.value.bytes_mut(bytes), new.value.bytes_mut(bytes));
            // As they are committed.
            port.floats.canonicalize(old, items);
            port.floats.canonicalize(new, items);
            old != new
        }
        Direction::Outbox => {
            let count = new.slot.count.get();
            let size = port.shape.size;
            count != old.slot.count.get()
                || (0..count).any(|i| old.values[i].bytes_mut(size) != new.values[i].bytes_mut(size))
        }
        _ => false,
    }
}

impl Runner {
    /// From the next step on runs new code beside this one.
    pub fn begin_shadow(&mut self, shadow: Shadow) {
        self.shadow = Some(shadow);
        self.look_for_company();
    }

    /// Keeps what the step will see for the new code beside this one.
    pub(super) fn show_shadow(&mut self) {
        if let Some(shadow) = &mut self.shadow {
            shadow.before(&self.frame, &self.slots, self.random.get());
        }
    }

    /// Hands what the step wrote to the new code beside this one.
    pub(super) fn hand_to_shadow(&mut self) {
        if let Some(shadow) = &mut self.shadow {
            shadow.after(&self.slots);
        }
    }
}
