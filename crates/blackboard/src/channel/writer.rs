use std::marker::PhantomData;
use std::sync::Arc;

use super::ledger::Ledger;
use super::lent::{Lent, LentBytes};
use super::pool::{self, NO_SLOT, SlotPin};
use super::{AdoptError, Blocked, Channel, HandleChange, IDLE_CURSOR, LinkError, SetAside};
use crate::message::Tap;
use crate::sync::{Ordering, order};
use crate::{Shape, Stamp};

/// Maximum number of values counted as missed at once.
/// So the numbers last, whatever is counted.
const MAX_SKIPPED: u64 = 1 << 32;

/// The one writer of a channel.
///
/// In this order, as for [`Channel`].
#[derive(Debug)]
#[repr(C)]
pub struct Writer {
    pub(super) channel: Arc<Channel>,
    /// Bytes of a value without tail items, which most are.
    head: usize,
    /// Capacity of the tail, items.
    capacity: usize,
    generation: u64,
    /// The writer of a channel that gets the same values.
    pub(super) deeper: Option<Box<Writer>>,
    pub(super) ledger: Ledger,
}

/// Slot for the next value, with the content of some older value.
#[derive(Debug)]
pub struct Draft<'a> {
    data: *mut u8,
    capacity: usize,
    writer: PhantomData<&'a mut Writer>,
}

impl Draft<'_> {
    /// Returns the beginning of the value.
    pub fn as_mut_ptr(&mut self) -> *mut u8 {
        self.data
    }

    /// Returns the capacity of the tail, items.
    pub fn capacity(&self) -> usize {
        self.capacity
    }
}

impl Writer {
    pub(super) fn new(channel: &Arc<Channel>) -> Result<Self, LinkError> {
        let mut handles = channel.handles();
        let generation = channel.generation();
        let taken = LinkError::WriterTaken { generation };
        if handles.ledger.is_some() {
            channel.provide(&handles, 0, 0, taken)?;
        }
        if handles.ledger.is_none() {
            return Err(taken);
        }
        let deeper = handles.deeper.as_ref().map(Writer::new).transpose()?;
        let ledger = handles.ledger.take().ok_or(taken)?;
        let generation = generation + 1;
        channel.writer.store(generation << 1 | 1, Ordering::Release);
        let (head, capacity) = (channel.shape.bytes(0), channel.shape.capacity);
        let (channel, deeper) = (Arc::clone(channel), deeper.map(Box::new));
        Ok(Self { channel, head, capacity, generation, deeper, ledger })
    }

    /// Returns the capacity of the tail, items.
    #[inline]
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// Returns the size of a value with `items` tail items, bytes.
    #[inline]
    pub fn bytes(&self, items: usize) -> usize {
        if items == 0 { self.head } else { self.channel.shape.bytes(items) }
    }

    /// Returns the slot for the next value; the same one until that is published.
    pub fn draft(&mut self) -> Draft<'_> {
        Draft { data: self.draft_ptr(), capacity: self.channel.shape.capacity, writer: PhantomData }
    }

    /// Returns the beginning of the slot for the next value.
    /// It is the same one until that is published or set aside.
    #[inline]
    pub fn draft_ptr(&mut self) -> *mut u8 {
        let index = self.draft_index();
        self.channel.pool.data(index)
    }

    #[inline]
    pub(super) fn draft_index(&mut self) -> u16 {
        if self.ledger.draft == NO_SLOT {
            let spare = std::mem::replace(&mut self.ledger.spare, NO_SLOT);
            self.ledger.draft = if spare == NO_SLOT { self.find_free() } else { spare };
        }
        self.ledger.draft
    }

    fn find_free(&mut self) -> u16 {
        self.search().unwrap_or_else(|| self.search_again())
    }

    /// Searches for a free slot again after lent values were given back.
    /// A lent value that is no longer visible counts as pinned until then.
    #[cold]
    fn search_again(&mut self) -> u16 {
        self.give_back();
        let found = self.search();
        found.unwrap_or_else(|| {
            unreachable!("there is a slot for every pin that the handles given out may hold, and one more")
        })
    }

    #[inline(always)] // It is where a write with readers spends its time.
    fn search(&mut self) -> Option<u16> {
        let ready = self.channel.pool.ready();
        let hint = usize::from(self.ledger.hint);
        for index in (hint..ready).chain(0..hint.min(ready)) {
            let entry = *self.ledger.entry(&self.channel.pool, index);
            if entry.in_ring {
                continue;
            }
            let slot = self.channel.pool.slot(index as u16);
            if slot.returned.load(order::ACQUIRE) == entry.pins || cfg!(feature = "mutant-readers") {
                self.ledger.hint = index as u16 + 1;
                return Some(index as u16);
            }
        }
        None
    }

    /// Publishes the draft with `items` tail items at the host's `time` in nanoseconds.
    /// More items than fit are cut.
    ///
    /// # Errors
    /// When a reader that must not be overtaken is behind; the draft remains unchanged.
    #[inline(always)] // A call costs a quarter of the whole.
    pub fn publish(&mut self, items: usize, time: u64) -> Result<Stamp, Blocked> {
        let items = items.min(self.capacity);
        self.commit(items, self.bytes(items), time, 0)
    }

    /// Publishes the draft, with `pins` of the writer itself on it from then on.
    #[inline(always)]
    pub(super) fn commit(
        &mut self,
        items: usize,
        length: usize,
        time: u64,
        pins: u64,
    ) -> Result<Stamp, Blocked> {
        let index = self.draft_index();
        let (channel, ledger) = (&*self.channel, &mut self.ledger);
        let sequence = ledger.last.sequence + 1;
        if channel.blockers.load(Ordering::Relaxed) > 0 && would_overtake(channel, sequence) {
            return Err(Blocked);
        }
        let stamp = Stamp { sequence, time, generation: self.generation };
        channel.pool.slot(index).header.write(|header| {
            // SAFETY: the writer alone has the draft.
            unsafe { header.write(pool::Header { length, items, stamp }) }
        });
        let ring = &*channel.ring;
        let (cell, first) = (&ring[ledger.cell], &ring[0]);
        // Publishes the value to the readers that pin it, and what readers gave back before they pinned anew to the writer: so
        // it never counts more pins of a reader than that may hold.
        let old = cell.word.swap(pool::word(index) | pins, order::PUBLISH);
        first.tail.store(sequence, order::RELEASE);
        ledger.remove(&channel.pool, old);
        ledger.entry(&channel.pool, usize::from(index)).in_ring = true;
        ledger.cell = if ledger.cell + 1 == ring.len() { 0 } else { ledger.cell + 1 };
        ledger.draft = NO_SLOT;
        ledger.last = stamp;
        if let Some(deeper) = &mut self.deeper {
            deeper.copy(channel.pool.data(index), length, items, time);
        }
        if let Some(tap) = channel.tap.get() {
            show(tap, channel.pool.data(index), length, items, stamp);
        }
        Ok(stamp)
    }

    /// Writes the newest value of another channel of the same shape.
    #[cold]
    #[inline(never)]
    fn copy(&mut self, data: *const u8, length: usize, items: usize, time: u64) {
        // SAFETY: the value is in the other channel's ring, so its writer, which calls this, does not touch it.
        let bytes = unsafe { std::slice::from_raw_parts(data, length) };
        // Nothing blocks a deeper channel.
        let _ = self.write(bytes, items, time);
    }

    /// Puts an older value, which fits, at the place of `sequence`, as the newest one.
    pub(super) fn place(&mut self, bytes: &[u8], items: usize, stamp: Stamp, sequence: u64) {
        let index = self.draft_index();
        let (channel, ledger) = (&*self.channel, &mut self.ledger);
        let header = pool::Header { length: bytes.len(), items, stamp };
        // SAFETY: the writer alone has the draft, and it has room for the value.
        unsafe {
            channel.pool.data(index).copy_from_nonoverlapping(bytes.as_ptr(), bytes.len());
            channel.pool.slot(index).header.write(|place| place.write(header));
        }
        ledger.cell = ((sequence - 1) % channel.ring.len() as u64) as usize;
        let old = channel.ring[ledger.cell].word.swap(pool::word(index), order::PUBLISH);
        channel.ring[0].tail.store(sequence, order::RELEASE);
        ledger.remove(&channel.pool, old);
        ledger.entry(&channel.pool, usize::from(index)).in_ring = true;
        ledger.cell = (ledger.cell + 1) % channel.ring.len();
        ledger.draft = NO_SLOT;
        ledger.last = stamp;
    }

    /// Continues without the values written so far.
    pub(super) fn clear(&mut self) {
        self.channel.ring[0].tail.store(0, order::RELEASE);
        (self.ledger.cell, self.ledger.last) = (0, Stamp::default());
    }

    /// Continues as another one of the channel's writers.
    pub(super) fn set_generation(&mut self, generation: u64) {
        self.generation = generation;
        self.channel.writer.store(generation << 1 | 1, Ordering::Release);
    }

    /// Returns the memory layout of a value.
    pub(super) fn shape(&self) -> Shape {
        self.channel.shape
    }

    /// Returns the number of kept values.
    pub(super) fn depth(&self) -> usize {
        self.channel.ring.len()
    }

    /// Copies a value and publishes it at the host's `time` in nanoseconds.
    /// It has `bytes` with `items` tail items; excess bytes are cut, and missing ones are zero.
    ///
    /// # Errors
    /// As [`publish`](Writer::publish).
    #[inline(always)] // So that a copy of known size is no call either.
    pub fn write(&mut self, bytes: &[u8], items: usize, time: u64) -> Result<Stamp, Blocked> {
        let items = items.min(self.capacity);
        let size = self.bytes(items);
        let length = bytes.len().min(size);
        let data = self.draft_ptr();
        // SAFETY: the draft has room for that many items, and is not shared.
        unsafe {
            data.copy_from_nonoverlapping(bytes.as_ptr(), length);
            if length < size {
                data.add(length).write_bytes(0, size - length);
            }
        }
        self.commit(items, size, time, 0)
    }

    /// Publishes lent bytes as a value without a copy.
    /// The value has `items` tail items, at most as many as fit; readers see the lent bytes. The content of the draft
    /// is not published, and a pointer to it becomes useless.
    ///
    /// The bytes are given back when a newer value has taken the place of this one and no reader holds it any more: at
    /// the next `adopt` or [`give_back`](Writer::give_back), when this writer is dropped, and at the latest when the
    /// channel is gone. So a channel has as many as it keeps, and as its readers held at that time. This may allocate,
    /// which [`write`](Writer::write) does not.
    ///
    /// # Errors
    /// When the bytes are too few or not aligned, the channel's values have to be in memory that was given, or as
    /// [`publish`](Writer::publish). They are given back then.
    pub fn adopt(&mut self, bytes: Box<dyn LentBytes>, items: usize, time: u64) -> Result<Stamp, AdoptError> {
        let shape = self.channel.shape;
        let items = items.min(shape.capacity);
        let (lent, needed) = (bytes.bytes(), shape.bytes(items));
        if lent.len() < needed {
            return Err(AdoptError::TooShort { length: lent.len(), needed });
        }
        if !lent.cast::<u8>().addr().get().is_multiple_of(shape.align.max(1)) {
            return Err(AdoptError::Misaligned { align: shape.align });
        }
        if self.channel.pool.is_given() {
            return Err(AdoptError::Given);
        }
        self.give_back();
        let slot = self.draft_index();
        // As the value's bytes would be, this is changed while the slot is the draft, which is not pinned, and
        // published by the exchange of the cell to the readers that pin it: see `Pool::set_data`.
        // SAFETY: the slot is the draft, and shows the bytes until they are given back.
        unsafe { self.channel.pool.set_data(slot, lent.cast()) };
        // The writer pins it, too: so it takes the slot for no draft, however it looks for one, before it has given the
        // bytes back, and other channels pay nothing for it.
        match self.commit(items, needed, time, 1) {
            Ok(stamp) => {
                self.ledger.lent.push(Lent { slot, _bytes: bytes });
                self.give_back();
                Ok(stamp)
            }
            Err(blocked) => {
                // SAFETY: it is still the draft.
                unsafe { self.channel.pool.set_data(slot, self.channel.pool.own_data(slot)) };
                Err(blocked.into())
            }
        }
    }

    /// Gives back adopted values that no reader sees any more.
    /// A writer that may not adopt again for long calls this now and then.
    pub fn give_back(&mut self) {
        self.ledger.give_back(&self.channel.pool);
    }

    /// Counts missed values, so that later numbers follow them.
    /// Every reader sees that it has missed them. A reader that must see every value is not overtaken by it: then fewer
    /// are counted.
    pub fn skip(&mut self, count: u64) {
        let (channel, ledger) = (&*self.channel, &mut self.ledger);
        let depth = channel.ring.len() as u64;
        let cursors = channel.cursors.iter().map(|cursor| cursor.load(order::ACQUIRE));
        let room = cursors
            .filter(|next| *next != IDLE_CURSOR)
            .map(|next| (next + depth).saturating_sub(ledger.last.sequence + 2))
            .fold(u64::MAX, |least, room| if room < least { room } else { least });
        let count = count.min(room).min(MAX_SKIPPED);
        ledger.last.sequence += count;
        ledger.cell = ((ledger.cell as u64 + count) % depth) as usize;
        if let Some(deeper) = &mut self.deeper {
            deeper.skip(count);
        }
    }

    /// Sets the draft aside for a late step, and continues in another slot.
    /// Nothing is allocated, as one slot is kept for this: a second draft stays in place until the first is given back,
    /// and `None` is returned.
    pub fn set_aside(&mut self) -> Option<SetAside> {
        if self.channel.aside.load(order::ACQUIRE) != 0 {
            return None;
        }
        let index = self.draft_index();
        // To the search for a free slot it is one that a reader has pinned.
        let entry = self.ledger.entry(&self.channel.pool, usize::from(index));
        entry.pins = entry.pins.wrapping_add(1);
        self.ledger.draft = NO_SLOT;
        let held = SlotPin::new(self.channel.pool.pointers(index));
        Some(SetAside::new(Arc::clone(&self.channel), held))
    }

    /// Switches turns on or off with readers that use them; initially off.
    /// These readers [say so](super::Latest::refresh_in_turn), and then need no pin.
    ///
    /// # Safety
    /// From the time at which it does to that at which it does not any more, or is dropped, it writes only while no such
    /// reader has its turn; to the draft, too. Each turn happens before the next one, and both these calls are in none.
    pub unsafe fn set_in_turn(&self, in_turn: bool) {
        self.channel.ring[0].in_turn.store(in_turn.into(), Ordering::Relaxed);
    }

    /// Returns the generation of this writer among the channel's writers, from 1.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// Returns the stamp of the last value that this or an earlier writer published.
    pub fn last(&self) -> Stamp {
        self.ledger.last
    }
}

/// Shows a just published value to a tap.
#[cold]
#[inline(never)]
fn show(tap: &dyn Tap, data: *const u8, length: usize, items: usize, stamp: Stamp) {
    // SAFETY: the value is in the ring, so its writer, which calls this, does not touch it.
    let bytes = unsafe { std::slice::from_raw_parts(data, length) };
    tap.wrote(bytes, items, stamp);
}

/// Returns true if a value of that number would replace one that a reader must see.
#[cold]
fn would_overtake(channel: &Channel, sequence: u64) -> bool {
    let depth = channel.ring.len() as u64;
    let mut cursors = channel.cursors.iter().map(|cursor| cursor.load(order::ACQUIRE));
    cursors.any(|next| next != IDLE_CURSOR && sequence >= next + depth)
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.give_back();
        self.channel.ring[0].in_turn.store(0, Ordering::Relaxed);
        // First, as the next writer takes both.
        drop(self.deeper.take());
        let mut handles = self.channel.handles();
        handles.ledger = Some(std::mem::replace(&mut self.ledger, Ledger::new(0)));
        self.channel.writer.store(self.generation << 1, Ordering::Release);
        drop(handles);
        self.channel.hook.call(HandleChange::WriterLeft(self.generation));
    }
}
