//! Inputs and outputs of a step of the old code, for the same step of the new.

use std::cell::Cell;

use slate_blackboard::Shape;
use slate_blackboard::interface::CanonicalForm;
use slate_module::{Description, Direction, Entry, Flags, Frame, PortSlot, Random};

use crate::runner::AlignedMemory;

/// Shape of a port's values, and their number.
pub(super) struct PortShape {
    pub name: String,
    pub direction: Direction,
    pub shape: Shape,
    window: usize,
    pub form: CanonicalForm,
}

/// Returns the shapes of a module's ports.
pub(super) fn port_shapes(description: &Description) -> Vec<PortShape> {
    let of = |port: &slate_module::PortDescription| PortShape {
        name: port.name.clone(),
        direction: port.direction,
        shape: port.descriptor.shape(port.capacity),
        window: port.window,
        form: CanonicalForm::new(port.descriptor),
    };
    description.ports.iter().map(of).collect()
}

/// Inputs and outputs of a step.
pub(super) struct Snapshot {
    pub now: u64,
    pub elapsed: u64,
    pub number: u64,
    pub params_version: u64,
    pub random: Random,
    pub params: AlignedMemory,
    pub ports: Vec<PortCopy>,
}

/// Copy of a port.
pub(super) struct PortCopy {
    pub slot: PortSlot,
    shape: Shape,
    /// Input: value. Output: value of the old code.
    pub value: AlignedMemory,
    /// Queue and inbox: values. Outbox: messages of the old code.
    pub values: Vec<AlignedMemory>,
    pub entries: Vec<Entry>,
}

// SAFETY: the pointers lead into memory that the snapshot owns.
unsafe impl Send for Snapshot {}

impl Snapshot {
    pub fn new(ports: &[PortShape], params: usize) -> Self {
        Self {
            now: 0,
            elapsed: 0,
            number: 0,
            params_version: 0,
            random: Random::new(0, ""),
            params: AlignedMemory::zeroed(params),
            ports: ports.iter().map(PortCopy::new).collect(),
        }
    }

    pub fn copy_inputs(&mut self, frame: &Frame, slots: &[PortSlot], random: Random) {
        (self.now, self.elapsed, self.number) = (frame.now, frame.elapsed, frame.number);
        (self.params_version, self.random) = (frame.params_version, random);
        // SAFETY: the frame points to a value of the parameters, and the copy is as large.
        unsafe { self.params.as_mut_ptr().copy_from_nonoverlapping(frame.params, frame.params_size) };
        for (copy, slot) in self.ports.iter_mut().zip(slots) {
            copy.copy_inputs(slot);
        }
    }

    pub fn copy_outputs(&mut self, slots: &[PortSlot]) {
        for (copy, slot) in self.ports.iter_mut().zip(slots) {
            copy.copy_outputs(slot);
        }
    }
}

impl PortCopy {
    pub fn new(port: &PortShape) -> Self {
        let size = port.shape.bytes(port.shape.capacity);
        let several = matches!(port.direction, Direction::Queue | Direction::Inbox | Direction::Outbox);
        let mut values: Vec<_> =
            (0..if several { port.window.max(16) } else { 0 }).map(|_| AlignedMemory::zeroed(size)).collect();
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
        Self { slot, shape: port.shape, value: AlignedMemory::zeroed(size), values, entries }
    }

    /// Returns the number of tail items that fit, at most `items`, and the size.
    /// The size is that of a value with them, bytes.
    pub fn extent(&self, items: usize) -> (usize, usize) {
        let items = items.min(self.shape.capacity);
        (items, self.shape.bytes(items))
    }

    /// Copies the inputs of a step.
    pub fn copy_inputs(&mut self, slot: &PortSlot) {
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

    /// Copies the outputs of a step.
    pub fn copy_outputs(&mut self, slot: &PortSlot) {
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

pub(super) const INPUT: u32 = Direction::Input as u32;
pub(super) const QUEUE: u32 = Direction::Queue as u32;
pub(super) const INBOX: u32 = Direction::Inbox as u32;
const OUTBOX: u32 = Direction::Outbox as u32;

fn entry(data: *mut u8) -> Entry {
    Entry { data, items: Cell::new(0), stamp: Default::default(), answer: Cell::new(0), sender: 0 }
}
