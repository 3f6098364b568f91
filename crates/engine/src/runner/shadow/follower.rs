//! Thread in which new code makes the steps of the old.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use slate_blackboard::channel::Writer;
use slate_blackboard::interface::{Text, View};
use slate_module::{Direction, Flags, Frame, Level, PortSlot};

use super::snapshot::{INBOX, INPUT, PortCopy, PortShape, QUEUE, Snapshot};
use super::{ShadowExchange, ShadowState};
use crate::log::ModuleLog;
use crate::runner::{AlignedMemory, Retired};

/// State of the shadow's thread.
pub(super) struct Follower {
    pub ports: Vec<PortShape>,
    pub params: usize,
    pub writer: Writer,
    pub log: Box<ModuleLog>,
    pub shared: Arc<ShadowExchange>,
}

// SAFETY: what the snapshots point to is theirs, and the rest is this thread's alone.
unsafe impl Send for Follower {}

impl Follower {
    /// Makes every step of the old code, until it is stopped.
    pub fn follow(mut self) {
        let shared = Arc::clone(&self.shared);
        let mut state = ShadowState::default();
        // Where the new code writes.
        let mut outputs: Vec<_> = self.ports.iter().map(PortCopy::new).collect();
        while !shared.stop.load(Ordering::Acquire) {
            let snapshot = shared.filled.pop();
            if let Some(new) = &mut *shared.locked() {
                if let Some(Err(refusal)) = new.state.take().map(|saved| new.code.restore(&saved)) {
                    self.log
                        .write(Level::Warn, &format!("the new code restarts with a fresh state: {refusal}"));
                }
                if let Some(snapshot) = &snapshot {
                    let code = self.step(&mut new.code, snapshot, &mut outputs);
                    state.ticks += 1;
                    if code < 0 {
                        state.panics = 1 + shared.panics.fetch_add(1, Ordering::Relaxed);
                    }
                }
            }
            let Some(mut snapshot) = snapshot else {
                shared.wake.wait_timeout(Duration::from_millis(100));
                continue;
            };
            state.skipped = shared.skipped.load(Ordering::Relaxed);
            if let Some(port) = self.difference(&mut snapshot, &mut outputs) {
                state.differences += 1;
                if state.first_difference == 0 {
                    (state.first_difference, state.port) = (snapshot.number, Text::new(port));
                }
            }
            // Only a recorder in lockstep may hold a writer up; the next state comes with the next step.
            let _ = self.writer.write(View::of(&mut state).bytes(), 0, snapshot.now);
            // The capacity is the number of ports.
            let _ = shared.free.push(snapshot);
        }
        // It ends here, where a call that hangs delays no other thread.
        let ended = shared.locked().take();
        drop(ended);
    }

    fn step(&self, new: &mut Retired, snapshot: &Snapshot, outputs: &mut [PortCopy]) -> i32 {
        let host = self.log.host();
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
            host: &raw const host,
        };
        self.log.set_time(snapshot.now);
        // SAFETY: the frame was filled for this instance, which is this thread's alone.
        let code = unsafe { new.tick(&raw const frame) };
        for (slot, output) in slots.iter().zip(outputs) {
            output.slot.flags.set(slot.flags.get());
            output.slot.items.set(slot.items.get());
            output.slot.priority.set(slot.priority.get());
            output.slot.count.set(slot.count.get());
        }
        code
    }

    /// Returns the first port whose value differs between the new code and the old.
    fn difference(&self, snapshot: &mut Snapshot, outputs: &mut [PortCopy]) -> Option<&str> {
        let ports = self.ports.iter().zip(&mut snapshot.ports).zip(outputs);
        let mut different =
            ports.filter_map(|((port, old), new)| differ(port, old, new).then_some(&port.name));
        different.next().map(String::as_str)
    }
}

fn differ(port: &PortShape, old: &mut PortCopy, new: &mut PortCopy) -> bool {
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
            // As they are committed.
            // SAFETY: both hold a value of the port with that many items.
            let [old, new] =
                [old, new].map(|copy| unsafe { port.form.canonical(copy.value.as_mut_ptr(), bytes, items) });
            old != new
        }
        Direction::Outbox => {
            let count = new.slot.count.get();
            let size = port.shape.size;
            let differs = |(old, new): (&mut AlignedMemory, &mut AlignedMemory)| {
                for value in [&mut *old, &mut *new] {
                    // SAFETY: both hold a value of the port.
                    unsafe { port.form.clear_gaps(value.as_mut_ptr(), size, 0) };
                }
                old.bytes_mut(size) != new.bytes_mut(size)
            };
            count != old.slot.count.get()
                || old.values.iter_mut().zip(&mut new.values).take(count).any(differs)
        }
        _ => false,
    }
}
