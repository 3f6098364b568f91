//! Shared memory of two agents: regions of slots, one region per size.
//! The end that fills a region creates it.
//!
//! A slot's word is 0 while the slot is free, else the number of its value. The end that fills the region finds a free
//! slot and sets the number. The other end sets 0 when it has taken the value, or when its last reader has released it;
//! until then it may lend the value, which the word indicates. The memory has no name, and each link has its own. So
//! when a process dies, only the other end still holds it, until it drops the link and the values that it reads.
//!
//! A region uses memory only for slots that have been in use at once, as untouched pages use none. These are the first
//! slots: two or three per property with a reader that keeps up.
#![allow(
    unsafe_code,
    reason = "memory that another process sees too is mapped here and nowhere else in this crate"
)]

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::ptr::NonNull;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, fcntl_get_seals, fstat, ftruncate, memfd_create};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use slate_blackboard::channel::LentBytes;
use slate_sorted::MapEntry;
use slate_sorted::SortedMap;

/// Slots of a region, for all properties of that size.
/// Enough for a few properties with a few readers each.
const SLOT_COUNT: usize = 32;

/// Largest number of lent slots.
/// The others always return at once, so a reader that never releases a value does not block the other end.
const MAX_LENT_SLOTS: usize = 24;

/// Word of a slot whose value is lent, which is not a number of a value.
const LENT_WORD: u32 = u32::MAX;

/// Largest alignment of values, bytes.
const MAX_ALIGNMENT: usize = 64;

/// Size of the header, bytes: a cache line per slot's word, padded to a page.
const HEADER_SIZE: usize = 4096;

const CACHE_LINE: usize = 64;

/// Binary logarithms of the slot sizes, bytes.
const SIZE_CLASSES: std::ops::RangeInclusive<u8> = 14..=26;

/// Region of slots of one size.
#[derive(Debug)]
pub(super) struct Region {
    class: u8,
    base: NonNull<u8>,
    /// Number of the last stored value.
    number: u32,
    /// Number of lent values.
    lent: AtomicUsize,
}

// SAFETY: the mapping belongs to the region, and stays at its address until that is dropped.
unsafe impl Send for Region {}
// SAFETY: a slot's word decides which end may write to it; the rest is atomic.
unsafe impl Sync for Region {}

impl Region {
    fn length(class: u8) -> usize {
        HEADER_SIZE + SLOT_COUNT * (1 << class)
    }

    fn map(class: u8, file: BorrowedFd<'_>) -> Option<Self> {
        let protection = ProtFlags::READ | ProtFlags::WRITE;
        // SAFETY: the system chooses the place, so nothing that is there already is touched.
        let base = unsafe {
            mmap(std::ptr::null_mut(), Self::length(class), protection, MapFlags::SHARED, file, 0).ok()?
        };
        let base = NonNull::new(base.cast())?;
        Some(Self { class, base, number: 0, lent: AtomicUsize::new(0) })
    }

    /// Creates memory that this process fills, and its file for the other one.
    fn create(class: u8) -> Option<(Self, OwnedFd)> {
        let file = memfd_create("slate-share", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING).ok()?;
        ftruncate(&file, Self::length(class) as u64).ok()?;
        fcntl_add_seals(&file, SealFlags::SHRINK | SealFlags::GROW | SealFlags::SEAL).ok()?;
        Some((Self::map(class, file.as_fd())?, file))
    }

    /// Maps memory that the other process fills; `None` if it is invalid.
    pub fn map_received(class: u8, file: OwnedFd) -> Option<Self> {
        if !SIZE_CLASSES.contains(&class) {
            return None;
        }
        // If it could be cut off, reading it would end this process.
        let sealed = fcntl_get_seals(&file).is_ok_and(|seals| seals.contains(SealFlags::SHRINK));
        let long = fstat(&file).is_ok_and(|found| found.st_size == Self::length(class) as i64);
        if sealed && long { Self::map(class, file.as_fd()) } else { None }
    }

    fn word(&self, slot: usize) -> &AtomicU32 {
        // SAFETY: inside the mapping, aligned, and used as an atomic only.
        unsafe { AtomicU32::from_ptr(self.base.add(slot * CACHE_LINE).as_ptr().cast()) }
    }

    fn slot(&self, slot: usize) -> *mut u8 {
        // SAFETY: inside the mapping.
        unsafe { self.base.add(HEADER_SIZE + slot * (1 << self.class)).as_ptr() }
    }

    /// Stores a value in a free slot; returns the slot and the value's number.
    fn put(&mut self, bytes: &[u8]) -> Option<(u8, u32)> {
        let slot = (0..SLOT_COUNT).find(|slot| self.word(*slot).load(Ordering::Acquire) == 0)?;
        self.number = self.number % (LENT_WORD - 1) + 1;
        // SAFETY: the slot has room for it, and the other process leaves free slots alone. If it did not, it would
        // spoil what it reads itself.
        unsafe { self.slot(slot).copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        self.word(slot).store(self.number, Ordering::Release);
        Some((slot as u8, self.number))
    }

    /// Takes the value out of the slot while the returned loan exists.
    fn lend(self: &Arc<Self>, slot: u8, number: u32, length: usize) -> Option<LentMemory> {
        let slot = usize::from(slot);
        let size = 1 << self.class;
        if slot >= SLOT_COUNT || length > size || number == 0 || number == LENT_WORD {
            return None;
        }
        // The caller has locked the regions, so the count does not rise meanwhile.
        if self.lent.load(Ordering::Relaxed) >= MAX_LENT_SLOTS {
            return None;
        }
        let word = self.word(slot);
        // A reference that comes again must not lend it again.
        word.compare_exchange(number, LENT_WORD, Ordering::Acquire, Ordering::Relaxed).ok()?;
        self.lent.fetch_add(1, Ordering::Relaxed);
        let whole = length.next_multiple_of(MAX_ALIGNMENT).min(size);
        // SAFETY: inside the slot, which belongs to this end until it is given back.
        unsafe { self.slot(slot).add(length).write_bytes(0, whole - length) };
        Some(LentMemory { region: Arc::clone(self), slot, length: whole })
    }

    fn take(&self, slot: u8, number: u32, length: usize, take: &mut dyn FnMut(&[u8])) -> bool {
        let slot = usize::from(slot);
        if slot >= SLOT_COUNT || length > 1 << self.class || number == 0 || number == LENT_WORD {
            return false;
        }
        if self.word(slot).load(Ordering::Acquire) != number {
            return false;
        }
        // SAFETY: inside the mapping, whose length is sealed. The other process leaves a slot alone that it has filled;
        // if it did not, it would spoil a value, in which all bits are valid, and which is copied and nothing else.
        take(unsafe { std::slice::from_raw_parts(self.slot(slot), length) });
        self.word(slot).store(0, Ordering::Release);
        true
    }
}

impl Drop for Region {
    fn drop(&mut self) {
        // SAFETY: mapped with that length; references into it have ended.
        let _ = unsafe { munmap(self.base.as_ptr().cast(), Self::length(self.class)) };
    }
}

/// Lent value, read in place.
#[derive(Debug)]
struct LentMemory {
    region: Arc<Region>,
    slot: usize,
    length: usize,
}

// SAFETY: the region stays mapped while this has it, also when the other process is gone, and its length is sealed. The
// other process leaves a slot alone that is lent; if it did not, it would spoil a value in which all bits are valid.
unsafe impl LentBytes for LentMemory {
    fn bytes(&self) -> NonNull<[u8]> {
        // SAFETY: inside the mapping.
        let first = unsafe { self.region.base.add(HEADER_SIZE + self.slot * (1 << self.region.class)) };
        NonNull::slice_from_raw_parts(first, self.length)
    }
}

impl Drop for LentMemory {
    fn drop(&mut self) {
        self.region.word(self.slot).store(0, Ordering::Release);
        self.region.lent.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Regions of one end of a link.
#[derive(Debug, Default)]
pub(super) struct Regions(SortedMap<u8, Arc<Region>>);

impl Regions {
    pub fn add(&mut self, region: Region) {
        // The first one stays, so that a process that hands over more and more gets nothing by it.
        self.0.entry(region.class).or_insert_with(|| Arc::new(region));
    }

    /// Stores a value in a slot; hands a new region over first if needed.
    pub fn place(
        &mut self,
        bytes: &[u8],
        reference: &mut Vec<u8>,
        send_file: impl FnOnce(u8, BorrowedFd<'_>) -> bool,
    ) -> bool {
        let class = (bytes.len().next_power_of_two().trailing_zeros() as u8).max(*SIZE_CLASSES.start());
        if class > *SIZE_CLASSES.end() {
            return false;
        }
        let region = match self.0.entry(class) {
            MapEntry::Occupied(known) => known.into_mut(),
            MapEntry::Vacant(place) => {
                let Some((region, file)) = Region::create(class) else { return false };
                if !send_file(class, file.as_fd()) {
                    return false;
                }
                place.insert(Arc::new(region))
            }
        };
        // A slot that this end fills is lent to the other end, and not shared here.
        let Some((slot, number)) = Arc::get_mut(region).and_then(|region| region.put(bytes)) else {
            return false;
        };
        reference.extend([class, slot]);
        reference.extend(number.to_le_bytes());
        true
    }

    pub fn read(&self, reference: &[u8], length: usize, take: &mut dyn FnMut(&[u8])) -> bool {
        let Some((region, slot, number)) = self.find(reference) else { return false };
        region.take(slot, number, length, take)
    }

    pub fn lend(&self, reference: &[u8], length: usize) -> Option<Box<dyn LentBytes>> {
        let (region, slot, number) = self.find(reference)?;
        region.lend(slot, number, length).map(|lent| Box::new(lent) as _)
    }

    fn find(&self, reference: &[u8]) -> Option<(&Arc<Region>, u8, u32)> {
        let [class, slot, number @ ..] = reference else { return None };
        let number = number.try_into().map(u32::from_le_bytes).ok()?;
        Some((self.0.get(class)?, *slot, number))
    }
}
