use std::sync::Arc;

use super::pool::{self, NO_SLOT, Slot};
use super::{Channel, IDLE, WriterTaken};
use crate::Stamp;
use crate::sync::{Ordering, order};

/// Slots for drafts that late steps hold.
pub(super) const SPARE_SLOTS: usize = 8;

/// What handles are given out, and what one writer leaves to the next.
#[derive(Debug)]
pub(super) struct Desk {
    pub latest: u16,
    pub queues: Vec<bool>,
    /// Drafts that late steps held at some time; each took one more slot.
    pub asides: usize,
    /// Nothing while a writer has it.
    ledger: Option<Ledger>,
}

impl Desk {
    pub fn new(depth: usize, limit: usize) -> Self {
        let ledger = Ledger {
            pins: vec![0; limit],
            in_ring: vec![false; limit],
            ring: vec![NO_SLOT; depth],
            draft: NO_SLOT,
            hint: 0,
        };
        Self { latest: 0, queues: Vec::new(), asides: 0, ledger: Some(ledger) }
    }
}

/// What only the writer knows of the slots.
#[derive(Debug)]
struct Ledger {
    /// Pins taken on each slot, counted when it leaves the ring.
    pins: Vec<u64>,
    in_ring: Vec<bool>,
    /// The slot in each cell.
    ring: Vec<u16>,
    /// The slot that is worked in.
    draft: u16,
    hint: u16,
}

/// The one writer of a channel.
#[derive(Debug)]
pub struct Writer {
    channel: Arc<Channel>,
    ledger: Ledger,
    sequence: u64,
    generation: u64,
}

/// A reader that must not be overtaken has no room; nothing was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a reader that must see every value is behind by the whole queue")]
pub struct Blocked;

/// The slot that the next value is written in.
#[derive(Debug)]
pub struct Draft<'a> {
    data: *mut u8,
    capacity: usize,
    writer: std::marker::PhantomData<&'a mut Writer>,
}

impl Draft<'_> {
    /// The beginning of the value.
    pub fn as_mut_ptr(&mut self) -> *mut u8 {
        self.data
    }

    /// How many tail items fit.
    pub fn capacity(&self) -> usize {
        self.capacity
    }
}

impl Writer {
    pub(super) fn new(channel: &Arc<Channel>) -> Result<Self, WriterTaken> {
        let mut desk = channel.desk();
        let state = channel.writer.load(Ordering::Acquire);
        let generation = state >> 1;
        match desk.ledger.take() {
            Some(ledger) if state & 1 == 0 => {
                channel.writer.store((generation + 1) << 1 | 1, Ordering::Release);
                let sequence = channel.published();
                Ok(Self { channel: Arc::clone(channel), ledger, sequence, generation: generation + 1 })
            }
            ledger => {
                desk.ledger = ledger;
                Err(WriterTaken { generation })
            }
        }
    }

    /// The slot for the next value; the same one until that is published.
    pub fn draft(&mut self) -> Draft<'_> {
        let data = self.draft_ptr();
        Draft { data, capacity: self.channel.shape.capacity, writer: std::marker::PhantomData }
    }

    /// The beginning of the slot for the next value.
    #[inline]
    pub fn draft_ptr(&mut self) -> *mut u8 {
        if self.ledger.draft == NO_SLOT {
            self.ledger.draft = self.find_free();
        }
        Slot::data(self.channel.pool.slot(self.ledger.draft))
    }

    #[inline]
    fn find_free(&mut self) -> u16 {
        let ready = self.channel.pool.ready() as u16;
        let mut index = self.ledger.hint;
        for _ in 0..ready {
            if index >= ready {
                index = 0;
            }
            let i = usize::from(index);
            // SAFETY: the index is below the number of slots that are ready.
            let slot = unsafe { self.channel.pool.slot_ref(index) };
            let unpinned =
                slot.returned.load(order::ACQUIRE) == self.ledger.pins[i] || cfg!(feature = "mutant-readers");
            if !self.ledger.in_ring[i] && unpinned && !slot.aside.load(Ordering::Acquire) {
                self.ledger.hint = index + 1;
                return index;
            }
            index += 1;
        }
        unreachable!("there is a slot for every pin that the handles given out may hold, and one more")
    }

    /// Publishes the draft with `items` tail items.
    ///
    /// # Errors
    /// When a reader that must not be overtaken is behind; the draft stays as it is.
    #[inline]
    pub fn publish(&mut self, items: usize, time: u64) -> Result<Stamp, Blocked> {
        let channel = &*self.channel;
        if channel.blockers.load(Ordering::Acquire) > 0 && self.is_blocked() {
            return Err(Blocked);
        }
        if self.ledger.draft == NO_SLOT {
            self.ledger.draft = self.find_free();
        }
        let channel = &*self.channel;
        let index = self.ledger.draft;
        let sequence = self.sequence + 1;
        let stamp = Stamp { sequence, time, generation: self.generation };
        // SAFETY: the draft is ready, and no reader has it.
        let slot = unsafe { channel.pool.slot_ref(index) };
        slot.header.write(|header| {
            // SAFETY: the writer alone has the draft.
            unsafe { *header = pool::Header { items, stamp } }
        });
        let old = channel.cell(sequence).swap(pool::word(index), order::PUBLISH);
        channel.ring[0].tail.store(sequence, order::RELEASE);
        let left = pool::slot_of(old);
        if left != NO_SLOT {
            let left = usize::from(left);
            self.ledger.pins[left] += pool::pins_of(old);
            self.ledger.in_ring[left] = false;
        }
        self.ledger.in_ring[usize::from(index)] = true;
        let place = if self.ledger.ring.len() == 1 {
            0
        } else {
            ((sequence - 1) % self.ledger.ring.len() as u64) as usize
        };
        self.ledger.ring[place] = index;
        self.ledger.draft = NO_SLOT;
        self.sequence = sequence;
        Ok(stamp)
    }

    fn is_blocked(&self) -> bool {
        let next = self
            .channel
            .cursors
            .iter()
            .map(|cursor| cursor.load(order::ACQUIRE))
            .filter(|next| *next != IDLE)
            .min();
        next.is_some_and(|next| self.sequence + 1 >= next + self.channel.ring.len() as u64)
    }

    /// Copies a value of `bytes` with `items` tail items, and publishes it. What does not fit is cut.
    ///
    /// # Errors
    /// As [`publish`](Writer::publish).
    #[inline]
    pub fn write(&mut self, bytes: &[u8], items: usize, time: u64) -> Result<Stamp, Blocked> {
        let shape = self.channel.shape;
        let items = items.min(shape.capacity);
        let length = bytes.len().min(shape.bytes(items));
        let data = self.draft_ptr();
        // SAFETY: the draft has room for that many items, and nobody else has it.
        unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), data, length) };
        self.publish(items, time)
    }

    /// Leaves the draft to a late step that may still write to it, and takes another one.
    ///
    /// This makes a slot, the only one that is made after linking.
    pub fn set_aside(&mut self) -> SetAside {
        let _ = self.draft_ptr();
        let index = std::mem::replace(&mut self.ledger.draft, NO_SLOT);
        // SAFETY: a draft is ready.
        unsafe { self.channel.pool.slot_ref(index) }.aside.store(true, Ordering::Release);
        let mut desk = self.channel.desk();
        desk.asides = (desk.asides + 1).min(SPARE_SLOTS);
        self.channel.provide(&mut desk);
        drop(desk);
        SetAside { channel: Arc::clone(&self.channel), index }
    }

    /// The stamp of the last value, but for its time.
    pub fn last(&self) -> Stamp {
        Stamp { sequence: self.sequence, time: 0, generation: self.generation }
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        let mut desk = self.channel.desk();
        let empty =
            Ledger { pins: Vec::new(), in_ring: Vec::new(), ring: Vec::new(), draft: NO_SLOT, hint: 0 };
        desk.ledger = Some(std::mem::replace(&mut self.ledger, empty));
        self.channel.writer.store(self.generation << 1, Ordering::Release);
    }
}

/// A draft that a late step may still write to. Dropping this says that it no longer does.
#[derive(Debug)]
pub struct SetAside {
    channel: Arc<Channel>,
    index: u16,
}

impl Drop for SetAside {
    fn drop(&mut self) {
        // SAFETY: the slot was a draft, so it is ready.
        unsafe { self.channel.pool.slot_ref(self.index) }.aside.store(false, Ordering::Release);
        let mut desk = self.channel.desk();
        desk.asides = desk.asides.saturating_sub(1);
    }
}
