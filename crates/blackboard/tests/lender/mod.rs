//! Memory that is lent, and spoilt as soon as it is given back.
#![allow(unsafe_code, reason = "memory that is lent")]
#![allow(clippy::unwrap_used, reason = "all of it is a test")]
#![allow(dead_code, reason = "not every test uses all of it")]

use std::cell::UnsafeCell;
use std::collections::{BTreeMap, BTreeSet};
use std::ptr::NonNull;
use std::sync::{Arc, Mutex};

use slate_blackboard::channel::LentBytes;

/// What stands where a value was.
pub const SPOILT: u8 = 0xaa;

#[derive(Debug)]
struct Memory {
    words: Box<[UnsafeCell<u128>]>,
    /// Bytes between its beginning and the value.
    offset: usize,
    length: usize,
}

// SAFETY: written before it is lent, and after it was returned.
unsafe impl Send for Memory {}
// SAFETY: as above.
unsafe impl Sync for Memory {}

impl Memory {
    fn bytes(&self) -> NonNull<[u8]> {
        // SAFETY: it has room for the offset.
        let first = unsafe { self.words.as_ptr().cast::<u8>().cast_mut().add(self.offset) };
        NonNull::slice_from_raw_parts(NonNull::new(first).unwrap(), self.length)
    }
}

/// Lender with the list of its loans. Returned memory stays allocated, so that a later use is detected.
#[derive(Clone, Debug, Default)]
pub struct Lender {
    lent: Arc<Mutex<BTreeMap<u64, Arc<Memory>>>>,
    returned: Arc<Mutex<Vec<Arc<Memory>>>>,
}

#[derive(Debug)]
struct Loan {
    number: u64,
    memory: Arc<Memory>,
    lender: Lender,
}

// SAFETY: allocated and filled, and neither moved nor changed until this is dropped.
unsafe impl LentBytes for Loan {
    fn bytes(&self) -> NonNull<[u8]> {
        self.memory.bytes()
    }
}

impl Drop for Loan {
    fn drop(&mut self) {
        // SAFETY: no reader is left, which the tests check.
        unsafe { self.memory.bytes().cast::<u8>().write_bytes(SPOILT, self.memory.length) };
        let memory = self.lender.lent.lock().unwrap().remove(&self.number).unwrap();
        self.lender.returned.lock().unwrap().push(memory);
    }
}

impl Lender {
    pub fn lend(&self, number: u64, bytes: &[u8]) -> Box<dyn LentBytes> {
        self.lend_at(number, bytes, 0)
    }

    /// As many bytes behind an address that is a multiple of 16.
    pub fn lend_at(&self, number: u64, bytes: &[u8], offset: usize) -> Box<dyn LentBytes> {
        let words = (0..(offset + bytes.len()).div_ceil(16).max(1)).map(|_| UnsafeCell::new(0)).collect();
        let memory = Memory { words, offset, length: bytes.len() };
        // SAFETY: just made, with room for them.
        unsafe {
            memory.bytes().cast::<u8>().copy_from_nonoverlapping(NonNull::from(bytes).cast(), bytes.len())
        };
        let memory = Arc::new(memory);
        assert!(self.lent.lock().unwrap().insert(number, Arc::clone(&memory)).is_none());
        Box::new(Loan { number, memory, lender: self.clone() })
    }

    /// What is lent now.
    pub fn lent(&self) -> BTreeSet<u64> {
        self.lent.lock().unwrap().keys().copied().collect()
    }

    /// Whether it is in memory that is or was lent.
    pub fn contains(&self, pointer: *const u8) -> bool {
        let inside = |memory: &Arc<Memory>| {
            let first = memory.bytes().cast::<u8>().as_ptr().cast_const();
            (first..first.wrapping_add(memory.length)).contains(&pointer)
        };
        self.lent.lock().unwrap().values().any(inside) || self.returned.lock().unwrap().iter().any(inside)
    }
}
