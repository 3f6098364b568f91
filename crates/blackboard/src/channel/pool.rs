use std::alloc::{Layout, alloc_zeroed, dealloc, handle_alloc_error};
use std::marker::PhantomData;
use std::ptr::NonNull;

use crate::sync::{AtomicPtr, AtomicU32, AtomicU64, Guarded, Ordering, Reading, order};
use crate::{Shape, Stamp};

/// The index of no slot.
pub(super) const NO_SLOT: u16 = u16::MAX;

const INDEX_SHIFT: u32 = 48;

/// A cell's word that holds that slot, pinned by nobody.
pub(super) const fn word(slot: u16) -> u64 {
    (slot as u64) << INDEX_SHIFT
}

/// The slot of a cell's word.
#[inline]
pub(super) const fn slot_of(word: u64) -> u16 {
    (word >> INDEX_SHIFT) as u16
}

/// How many readers pinned the slot of a cell's word.
#[inline]
pub(super) const fn pins_of(word: u64) -> u64 {
    word & ((1 << INDEX_SHIFT) - 1)
}

/// A place for one value; its bytes follow in the same allocation.
#[derive(Debug)]
#[repr(C, align(64))]
pub(super) struct Slot {
    /// Pins given back since the slot was made.
    pub returned: AtomicU64,
    /// Guards the bytes too, so a checker that watches it watches the value.
    pub header: Guarded<Header>,
}

/// What goes with a value.
#[derive(Debug)]
pub(super) struct Header {
    pub items: usize,
    pub stamp: Stamp,
}

/// The bytes of a slot's value.
#[inline]
pub(super) fn data(slot: NonNull<Slot>) -> *mut u8 {
    slot.as_ptr().wrapping_add(1).cast()
}

/// Slots, made when handles are linked and never while a value is written.
#[derive(Debug)]
pub(super) struct Pool {
    layout: Layout,
    table: Box<[AtomicPtr<Slot>]>,
    ready: AtomicU32,
}

impl Pool {
    pub fn new(shape: Shape, limit: usize) -> Self {
        let bytes = shape.bytes(shape.capacity).saturating_add(size_of::<Slot>());
        // Neighbouring lines are fetched in pairs, so a value of one line comes with its header.
        let align = if shape.bytes(0) > 0 { 128 } else { 64 };
        // What exceeds the address space fails when it is allocated.
        let layout = Layout::from_size_align(bytes, align).unwrap_or(IMPOSSIBLE);
        let table = (0..limit).map(|_| AtomicPtr::new(std::ptr::null_mut())).collect();
        Self { layout, table, ready: AtomicU32::new(0) }
    }

    /// How many slots there can be.
    pub fn limit(&self) -> usize {
        self.table.len()
    }

    /// Makes slots until there are `count`. Called under the channel's lock.
    pub fn provide(&self, count: usize) {
        for index in self.ready()..count {
            // What the slot holds is published with the count, and to readers with the cell that names it.
            self.table[index].store(self.make(0).as_ptr(), Ordering::Relaxed);
            self.ready.store(index as u32 + 1, Ordering::Release);
        }
    }

    fn make(&self, returned: u64) -> NonNull<Slot> {
        // SAFETY: the layout is that of a slot and more, so not empty.
        let memory = unsafe { alloc_zeroed(self.layout) }.cast::<Slot>();
        let Some(slot) = NonNull::new(memory) else { handle_alloc_error(self.layout) };
        let header = Guarded::new(Header { items: 0, stamp: Stamp::default() });
        // SAFETY: fresh memory of this layout.
        unsafe { slot.write(Slot { returned: AtomicU64::new(returned), header }) };
        slot
    }

    #[inline]
    pub fn ready(&self) -> usize {
        self.ready.load(Ordering::Acquire) as usize
    }

    /// The slot of an index below the number of those that are ready.
    #[inline]
    pub fn slot(&self, index: u16) -> NonNull<Slot> {
        let slot = self.table[usize::from(index)].load(Ordering::Relaxed);
        debug_assert!(!slot.is_null(), "slot {index} is not ready");
        // SAFETY: set before the index became ready, and whoever has the index learned it after that.
        unsafe { NonNull::new_unchecked(slot) }
    }

    /// Puts a fresh slot in the place of a draft, which nobody has pinned, and returns the draft.
    pub fn replace(&self, index: u16) -> NonNull<Slot> {
        let old = self.slot(index);
        // SAFETY: the slot lives; the writer sees every pin of it given back.
        let returned = unsafe { old.as_ref() }.returned.load(Ordering::Relaxed);
        self.table[usize::from(index)].store(self.make(returned).as_ptr(), Ordering::Relaxed);
        old
    }

    /// Frees a slot.
    ///
    /// # Safety
    /// It was made by this pool, is in its table no more, and nobody uses it.
    pub unsafe fn free(&self, slot: NonNull<Slot>) {
        // SAFETY: made with this layout, and passed on to the caller.
        unsafe {
            slot.drop_in_place();
            dealloc(slot.as_ptr().cast(), self.layout);
        }
    }

    /// Pins the slot that is in the cell, whichever that is.
    #[inline]
    pub fn pin(&self, cell: &AtomicU64) -> Held {
        Held(self.slot(slot_of(cell.fetch_add(1, order::PUBLISH))))
    }
}

/// More than can be allocated.
const IMPOSSIBLE: Layout = match Layout::from_size_align(isize::MAX as usize, 1) {
    Ok(layout) => layout,
    Err(_) => Layout::new::<Slot>(),
};

impl Drop for Pool {
    fn drop(&mut self) {
        for index in 0..self.ready() {
            // SAFETY: no handle is left, as each keeps the channel alive.
            unsafe { self.free(self.slot(index as u16)) };
        }
    }
}

/// A reader's pin: the slot stays as it is until this is given back, which happens once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held(NonNull<Slot>);

// SAFETY: a slot's value is written by the one writer while nobody has it pinned, and only read by those who have;
// the count of returned pins is atomic.
unsafe impl Send for Held {}
// SAFETY: as above.
unsafe impl Sync for Held {}

impl Held {
    /// Gives the pin back.
    #[inline]
    pub fn give_back(self) {
        // SAFETY: a pinned slot lives.
        unsafe { self.0.as_ref() }.returned.fetch_add(1, order::RELEASE);
    }

    /// Lends the value.
    ///
    /// # Safety
    /// The pin is not given back while the loan lives.
    #[inline]
    pub unsafe fn lend<'a>(self, shape: Shape) -> Loan<'a> {
        // SAFETY: a pinned slot lives.
        let header = unsafe { self.0.as_ref() }.header.read();
        Loan { slot: self.0, shape, header, life: PhantomData }
    }

    /// The sequence number of the value.
    #[inline]
    pub fn sequence(self) -> u64 {
        // SAFETY: the slot is pinned, so it lives and the writer leaves it alone.
        unsafe { self.0.as_ref().header.read().get().stamp.sequence }
    }
}

/// A value that is lent: it stays as it is while this lives.
#[derive(Debug)]
pub struct Loan<'a> {
    slot: NonNull<Slot>,
    shape: Shape,
    header: Reading<Header>,
    life: PhantomData<&'a [u8]>,
}

impl<'a> Loan<'a> {
    #[inline]
    fn header(&self) -> &Header {
        // SAFETY: the slot is pinned, so the writer leaves it alone.
        unsafe { self.header.get() }
    }

    /// The beginning of the value.
    #[inline]
    pub fn as_ptr(&self) -> *const u8 {
        data(self.slot)
    }

    /// The value.
    #[inline]
    pub fn bytes(&self) -> &'a [u8] {
        // SAFETY: a slot has room for every value of the shape, its bytes are initialised, and it is pinned.
        unsafe { std::slice::from_raw_parts(self.as_ptr(), self.shape.bytes(self.items())) }
    }

    /// How many items its tail has.
    #[inline]
    pub fn items(&self) -> usize {
        self.header().items
    }

    /// When it was written, and by whom.
    #[inline]
    pub fn stamp(&self) -> Stamp {
        self.header().stamp
    }
}
