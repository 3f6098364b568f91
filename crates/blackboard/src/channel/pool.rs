use std::alloc::{Layout, alloc_zeroed, dealloc};
use std::cell::UnsafeCell;
use std::marker::PhantomData;
use std::ptr::NonNull;
use std::sync::OnceLock;

use super::lines::FarLines;
use super::memory::SlotMemory;
use crate::sync::{AtomicPtr, AtomicU32, AtomicU64, GuardedCell, Ordering, ReadGuard, order};
use crate::{Shape, Stamp};

/// The index of no slot.
pub(super) const NO_SLOT: u16 = u16::MAX;

const INDEX_SHIFT: u32 = 48;

/// Returns the word of a cell that holds that slot, without pins.
pub(super) const fn word(slot: u16) -> u64 {
    (slot as u64) << INDEX_SHIFT
}

/// Returns the slot of a cell's word.
#[inline]
pub(super) const fn slot_of(word: u64) -> u16 {
    (word >> INDEX_SHIFT) as u16
}

/// Returns the number of pins on the slot of a cell's word.
#[inline]
pub(super) const fn pins_of(word: u64) -> u64 {
    word & ((1 << INDEX_SHIFT) - 1)
}

/// Slot of one value.
/// It is private to this process, wherever the bytes are.
#[derive(Debug)]
#[repr(C, align(64))]
pub(super) struct Slot {
    /// Pins given back since the slot was made.
    pub returned: AtomicU64,
    /// Guards the bytes too, so a checker that watches it watches the value.
    pub header: GuardedCell<Header>,
    /// Own bytes of the slot, which lent ones may replace.
    own: NonNull<u8>,
    /// The bytes of the value, if they fit here.
    /// Then a lone number, which is what modules write most, takes no line of its own.
    small: UnsafeCell<u64>,
}

/// Header of a value.
#[derive(Debug)]
pub(super) struct Header {
    /// Size of the value, bytes.
    /// Readers need it at every look, so the writer computes it once.
    pub length: usize,
    pub items: usize,
    pub stamp: Stamp,
}

/// Slots, made when handles are linked and never while a value is written.
#[derive(Debug)]
#[repr(C)]
pub(super) struct Pool {
    /// The first slots, which are all slots of most channels.
    /// They come first, because all else is needed only to create slots.
    near: Box<[SlotAddress]>,
    ready: AtomicU32,
    limit: usize,
    /// The other slots, once there are more.
    far: OnceLock<Box<Far>>,
    /// Memory of the bytes, if they don't follow their slots.
    memory: SlotMemory,
    /// Layout of a slot, and of the bytes that follow it.
    slot: Layout,
    /// Layout of the bytes that are elsewhere.
    bytes: Layout,
}

/// Address of a slot, and of the value in it.
/// Written once, so all cores keep it in their caches, and fetch a slot and its bytes at once. Only lent bytes are
/// elsewhere at times.
#[derive(Debug)]
struct SlotAddress {
    slot: AtomicPtr<Slot>,
    data: AtomicPtr<u8>,
}

/// State of the slots beyond the first ones.
#[derive(Debug)]
struct Far {
    table: Box<[SlotAddress]>,
    lines: FarLines,
}

impl SlotAddress {
    fn table(count: usize) -> Box<[Self]> {
        let entry = |_| Self {
            slot: AtomicPtr::new(std::ptr::null_mut()),
            data: AtomicPtr::new(std::ptr::null_mut()),
        };
        (0..count).map(entry).collect()
    }
}

/// A slot that is ready.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlotPointers {
    slot: NonNull<Slot>,
    data: NonNull<u8>,
}

impl SlotPointers {
    /// Returns the slot, with the header of the bytes.
    ///
    /// # Safety
    /// The pool lives as long as the reference.
    #[inline]
    unsafe fn slot<'a>(self) -> &'a Slot {
        // SAFETY: a slot lives as long as its pool, and is changed through its cells only.
        unsafe { self.slot.as_ref() }
    }
}

impl Pool {
    /// Creates a pool of at most `limit` slots, of which `near` are looked up at once.
    pub fn new(shape: Shape, near: usize, limit: usize, memory: SlotMemory) -> Self {
        let bytes = shape.bytes(shape.capacity);
        // A size beyond the address space fails at allocation.
        let layout = |size: usize, align| Layout::from_size_align(size, align).unwrap_or(OVERSIZED_LAYOUT);
        let slot = match memory {
            // Neighboring lines are fetched in pairs, so a value of one line comes with its header.
            SlotMemory::Heap if bytes <= size_of::<u64>() && shape.align <= align_of::<u64>() => {
                Layout::new::<Slot>()
            }
            SlotMemory::Heap => {
                let align = if shape.bytes(0) > 0 { 128 } else { 64 };
                layout(bytes.max(1).saturating_add(size_of::<Slot>()), align)
            }
            SlotMemory::Given(_) => Layout::new::<Slot>(),
        };
        // No line is shared by two values, as their writers may differ.
        let bytes = layout(bytes.max(1).saturating_add(63) & !63, 64);
        let (near, far) = (SlotAddress::table(near), OnceLock::new());
        Self { near, ready: AtomicU32::new(0), limit, far, memory, slot, bytes }
    }

    /// Returns the maximum number of slots.
    pub fn limit(&self) -> usize {
        self.limit
    }

    /// Returns the address of a slot that is ready.
    /// Its index is below the number of ready ones.
    #[inline(always)] // Part of every write and every read.
    fn entry(&self, index: usize) -> &SlotAddress {
        match self.near.get(index) {
            Some(entry) => entry,
            None => &self.far().table[index - self.near.len()],
        }
    }

    /// Returns the slots beyond the first ones.
    /// Created before an index of them is ready, under the channel's lock.
    #[cold]
    fn far(&self) -> &Far {
        self.far.get_or_init(|| {
            let count = self.limit - self.near.len();
            Box::new(Far { table: SlotAddress::table(count), lines: FarLines::new(count) })
        })
    }

    /// Returns the writer's entries of the slots beyond the first ones.
    pub fn far_lines(&self) -> &FarLines {
        &self.far().lines
    }

    /// Creates slots until there are `count`.
    /// If the memory is exhausted, it creates none and returns false. Called under the channel's lock.
    pub fn provide(&self, count: usize) -> bool {
        let first = self.ready();
        let made: Vec<_> = (first..count).map_while(|_| self.make()).collect();
        if first + made.len() < count {
            // SAFETY: just made, and in no table.
            made.into_iter().for_each(|pointers| unsafe { self.free(pointers) });
            return false;
        }
        for (index, pointers) in (first..).zip(made) {
            // The slot's content is published with the count, and to readers with the cell that names it.
            let entry = self.entry(index);
            entry.slot.store(pointers.slot.as_ptr(), Ordering::Relaxed);
            entry.data.store(pointers.data.as_ptr(), Ordering::Relaxed);
            self.ready.store(index as u32 + 1, Ordering::Release);
        }
        true
    }

    /// Returns the size of a slot, bytes.
    pub fn slot_size(&self) -> usize {
        match self.memory {
            SlotMemory::Heap => self.slot.size(),
            SlotMemory::Given(_) => self.bytes.size(),
        }
    }

    fn make(&self) -> Option<SlotPointers> {
        // SAFETY: the layout is that of a slot and more, so not empty.
        let slot = NonNull::new(unsafe { alloc_zeroed(self.slot) })?.cast::<Slot>();
        let data = match &self.memory {
            // SAFETY: what is allocated is a slot, without more than its small bytes or with as many behind it as are needed.
            SlotMemory::Heap => Some(unsafe {
                if self.slot.size() > size_of::<Slot>() {
                    slot.add(1).cast()
                } else {
                    NonNull::new_unchecked((&raw mut (*slot.as_ptr()).small).cast())
                }
            }),
            SlotMemory::Given(memory) => memory.allocate(self.bytes).inspect(|data| {
                // SAFETY: the memory promises that many bytes for exclusive use. Readers may look at all of them.
                unsafe { data.write_bytes(0, self.bytes.size()) };
            }),
        };
        let Some(data) = data else {
            // SAFETY: allocated above with this layout.
            unsafe { dealloc(slot.as_ptr().cast(), self.slot) };
            return None;
        };
        let header = GuardedCell::new(Header { length: 0, items: 0, stamp: Stamp::default() });
        // SAFETY: fresh memory of this layout.
        unsafe {
            slot.write(Slot { returned: AtomicU64::new(0), header, own: data, small: UnsafeCell::new(0) })
        };
        Some(SlotPointers { slot, data })
    }

    /// # Safety
    /// It was made by this pool, and is unused.
    unsafe fn free(&self, pointers: SlotPointers) {
        // SAFETY: allocated with these layouts, and passed on to the caller.
        unsafe {
            if let SlotMemory::Given(memory) = &self.memory {
                memory.free(pointers.slot.as_ref().own, self.bytes);
            }
            pointers.slot.drop_in_place();
            dealloc(pointers.slot.as_ptr().cast(), self.slot);
        }
    }

    #[inline]
    pub fn ready(&self) -> usize {
        self.ready.load(Ordering::Acquire) as usize
    }

    /// Returns the slot of an index below the number of those that are ready.
    #[inline]
    pub fn slot(&self, index: u16) -> &Slot {
        let slot = self.entry(index.into()).slot.load(Ordering::Relaxed);
        debug_assert!(!slot.is_null(), "slot {index} is not ready");
        // SAFETY: set before the index became ready, and the index is known only after that. A slot lives as
        // long as its pool, and is changed through its cells only.
        unsafe { &*slot }
    }

    /// Returns the bytes of that slot; their reader has it pinned.
    #[inline]
    pub fn data(&self, index: u16) -> *mut u8 {
        self.entry(index.into()).data.load(Ordering::Relaxed)
    }

    /// Returns the slot's own memory, even if lent bytes replace it.
    pub fn own_data(&self, index: u16) -> NonNull<u8> {
        self.slot(index).own
    }

    /// Returns true if the bytes are in given memory.
    pub fn is_given(&self) -> bool {
        matches!(self.memory, SlotMemory::Given(_))
    }

    /// Sets the address of the slot's bytes: lent ones, or its own again.
    ///
    /// The publication of a value carries this store too, though it is a relaxed one. Readers load `data` after they
    /// have pinned the slot, with an exchange of its cell that acquires everything done before the writer put it there:
    /// so they see no older address. And the writer has acquired everything that each reader did before it gave its pin
    /// back, when it found that all pins are back: so they see no newer one.
    ///
    /// # Safety
    /// The slot is in no cell and not pinned. The bytes are as many as its next value has, and stay until it
    /// has others.
    pub unsafe fn set_data(&self, index: u16, data: NonNull<u8>) {
        self.entry(index.into()).data.store(data.as_ptr(), Ordering::Relaxed);
    }

    /// Returns [`slot`](Pool::slot) and [`data`](Pool::data) together.
    #[inline]
    pub fn pointers(&self, index: u16) -> SlotPointers {
        let entry = self.entry(index.into());
        let (slot, data) = (entry.slot.load(Ordering::Relaxed), entry.data.load(Ordering::Relaxed));
        debug_assert!(!slot.is_null(), "slot {index} is not ready");
        // SAFETY: as for `slot`; the bytes were set with it.
        unsafe { SlotPointers { slot: NonNull::new_unchecked(slot), data: NonNull::new_unchecked(data) } }
    }

    /// Pins the slot that is in the cell, whichever that is.
    #[inline]
    pub fn pin(&self, cell: &AtomicU64) -> SlotPin {
        SlotPin(self.pointers(slot_of(cell.fetch_add(1, order::PUBLISH))))
    }
}

/// Layout that is too large to be allocated.
const OVERSIZED_LAYOUT: Layout = match Layout::from_size_align(isize::MAX as usize, 1) {
    Ok(layout) => layout,
    Err(_) => Layout::new::<Slot>(),
};

impl Drop for Pool {
    fn drop(&mut self) {
        for index in 0..self.ready() {
            // SAFETY: no handle is left, as each keeps the channel alive.
            unsafe { self.free(self.pointers(index as u16)) };
        }
    }
}

/// Pin of a reader on a slot.
/// The slot stays unchanged until this is given back, which happens once.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlotPin(SlotPointers);

// SAFETY: a slot's value is written by the one writer while it is not pinned, and only read by readers that pinned it;
// the count of returned pins is atomic.
unsafe impl Send for SlotPin {}
// SAFETY: as above.
unsafe impl Sync for SlotPin {}

impl SlotPin {
    /// Creates a pin that was counted already.
    pub fn new(pointers: SlotPointers) -> Self {
        Self(pointers)
    }

    /// Gives the pin back.
    #[inline]
    pub fn give_back(self) {
        // SAFETY: a pinned slot lives.
        unsafe { self.0.slot() }.returned.fetch_add(1, order::RELEASE);
    }

    /// Lends the value.
    ///
    /// # Safety
    /// The pin is not given back while the loan lives.
    #[inline]
    pub unsafe fn lend<'a>(self) -> Loan<'a> {
        // SAFETY: a pinned slot lives.
        let header = unsafe { self.0.slot() }.header.read();
        Loan { pointers: self.0, header, life: PhantomData }
    }

    /// Returns the sequence number of the value.
    #[inline]
    pub fn sequence(self) -> u64 {
        // SAFETY: the slot is pinned, so it lives and the writer leaves it alone.
        unsafe { self.0.slot().header.read().get().stamp.sequence }
    }
}

/// Lent value: it stays unchanged while this lives.
#[derive(Debug)]
pub struct Loan<'a> {
    pointers: SlotPointers,
    header: ReadGuard<Header>,
    life: PhantomData<&'a [u8]>,
}

impl<'a> Loan<'a> {
    #[inline]
    fn header(&self) -> &Header {
        // SAFETY: the slot is pinned, so the writer leaves it alone.
        unsafe { self.header.get() }
    }

    /// Returns the beginning of the value.
    #[inline]
    pub fn as_ptr(&self) -> *const u8 {
        self.pointers.data.as_ptr()
    }

    /// Returns the value.
    #[inline]
    pub fn bytes(&self) -> &'a [u8] {
        // SAFETY: the slot has room for that many bytes, its bytes are initialized, and it is pinned.
        unsafe { std::slice::from_raw_parts(self.as_ptr(), self.header().length) }
    }

    /// Returns the number of items in the tail.
    #[inline]
    pub fn items(&self) -> usize {
        self.header().items
    }

    /// Returns the time and the writer of the value.
    #[inline]
    pub fn stamp(&self) -> Stamp {
        self.header().stamp
    }
}
