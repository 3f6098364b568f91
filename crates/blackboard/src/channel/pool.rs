use std::alloc::{Layout, alloc_zeroed, dealloc, handle_alloc_error};

use crate::sync::{AtomicBool, AtomicPtr, AtomicU32, AtomicU64, Guarded, Ordering, Reading, order};
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
    /// Whether a late step may still write here.
    pub aside: AtomicBool,
    pub header: Guarded<Header>,
}

/// What goes with a value.
#[derive(Debug)]
pub(super) struct Header {
    pub items: usize,
    pub stamp: Stamp,
}

impl Slot {
    /// The bytes of the value.
    #[inline]
    pub fn data(this: *const Self) -> *mut u8 {
        // The bytes follow the slot in its allocation.
        this.wrapping_add(1).cast_mut().cast()
    }
}

/// Slots, made when handles are linked and never while a value is written.
#[derive(Debug)]
pub(super) struct Pool {
    layout: Layout,
    table: Box<[AtomicPtr<Slot>]>,
    ready: AtomicU32,
}

// SAFETY: a slot's value is written by the one writer while nobody has it pinned, and read by those who have.
unsafe impl Send for Pool {}
// SAFETY: as above.
unsafe impl Sync for Pool {}

impl Pool {
    pub fn new(shape: Shape, limit: usize) -> Self {
        let bytes = size_of::<Slot>() + shape.bytes(shape.capacity).max(1);
        // Neighbouring lines are fetched in pairs, so a value of one line comes with its header.
        let align = if bytes > 64 { 128 } else { 64 };
        // A shape that exceeds the address space can't be allocated in any way.
        let layout = Layout::from_size_align(bytes, align).unwrap_or(Layout::new::<Slot>());
        let limit = limit.min(usize::from(NO_SLOT));
        let table = (0..limit).map(|_| AtomicPtr::new(std::ptr::null_mut())).collect();
        Self { layout, table, ready: AtomicU32::new(0) }
    }

    /// Makes slots until there are `count`. Called under the channel's lock.
    pub fn provide(&self, count: usize) {
        let count = count.min(self.table.len());
        for i in self.ready()..count {
            // SAFETY: the layout is that of a slot and more, so not empty.
            let slot = unsafe { alloc_zeroed(self.layout) }.cast::<Slot>();
            if slot.is_null() {
                handle_alloc_error(self.layout);
            }
            let header = Guarded::new(Header { items: 0, stamp: Stamp::default() });
            // SAFETY: fresh memory of this layout.
            unsafe {
                slot.write(Slot { returned: AtomicU64::new(0), aside: AtomicBool::new(false), header })
            };
            self.table[i].store(slot, Ordering::Release);
            self.ready.store(i as u32 + 1, Ordering::Release);
        }
    }

    #[inline]
    pub fn ready(&self) -> usize {
        self.ready.load(Ordering::Acquire) as usize
    }

    #[inline]
    pub fn slot(&self, index: u16) -> *const Slot {
        self.table[usize::from(index)].load(Ordering::Acquire)
    }

    /// A pin's slot.
    ///
    /// # Safety
    /// The slot is ready.
    #[inline]
    pub unsafe fn slot_ref(&self, index: u16) -> &Slot {
        // SAFETY: a ready slot is never moved or freed before the pool.
        unsafe { &*self.slot(index) }
    }

    /// Gives a pin back.
    #[inline]
    pub fn give_back(&self, index: u16) {
        // SAFETY: a slot that was pinned is ready.
        unsafe { self.slot_ref(index) }.returned.fetch_add(1, order::RELEASE);
    }

    /// Lends the value of a slot.
    ///
    /// # Safety
    /// The slot is pinned as long as the loan lives.
    #[inline]
    pub unsafe fn lend(&self, index: u16, shape: Shape) -> Loan<'_> {
        // SAFETY: a pinned slot is ready.
        let slot = unsafe { self.slot_ref(index) };
        Loan { slot, shape, header: slot.header.read() }
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        for i in 0..self.ready() {
            let slot = self.table[i].load(Ordering::Acquire);
            // SAFETY: made with this layout, and no handle is left, as each keeps the channel alive.
            unsafe {
                slot.drop_in_place();
                dealloc(slot.cast(), self.layout);
            }
        }
    }
}

/// A value that is lent: it stays as it is while this lives.
#[derive(Debug)]
pub struct Loan<'a> {
    slot: &'a Slot,
    shape: Shape,
    header: Reading<Header>,
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
        Slot::data(self.slot)
    }

    /// The value.
    #[inline]
    pub fn bytes(&self) -> &'a [u8] {
        // SAFETY: a slot has room for every value of the shape, and its bytes are initialised.
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
