//! Memory for values, of a few equal blocks, that watches how it is used.
#![allow(unsafe_code, reason = "memory that is handed out")]
#![allow(clippy::unwrap_used, reason = "all of it is a test")]
#![allow(dead_code, reason = "not every test uses all of it")]

use std::alloc::Layout;
use std::cell::UnsafeCell;
use std::ops::Range;
use std::ptr::NonNull;
use std::sync::{Arc, Mutex};

use slate_blackboard::channel::ValueMemory;

pub const BLOCK: usize = 4096;

#[repr(align(4096))]
struct Block(UnsafeCell<[u8; BLOCK]>);

pub struct Arena {
    blocks: Box<[Block]>,
    /// The layout of what is in each block, if anything is.
    taken: Mutex<Vec<Option<Layout>>>,
}

// SAFETY: a block belongs to its receiver.
unsafe impl Send for Arena {}
// SAFETY: as above.
unsafe impl Sync for Arena {}

impl Arena {
    pub fn new(blocks: usize) -> Arc<Self> {
        // No value may rely on zeros.
        let dirty = || Block(UnsafeCell::new([0xaa; BLOCK]));
        let blocks: Box<[_]> = (0..blocks).map(|_| dirty()).collect();
        let taken = Mutex::new(vec![None; blocks.len()]);
        Arc::new(Self { blocks, taken })
    }

    pub fn memory(self: &Arc<Self>) -> Arc<dyn ValueMemory> {
        Arc::clone(self) as _
    }

    /// How many blocks are in use.
    pub fn taken(&self) -> usize {
        self.taken.lock().unwrap().iter().flatten().count()
    }

    pub fn contains(&self, pointer: *const u8) -> bool {
        let Range { start, end } = self.blocks.as_ptr_range();
        (start.cast()..end.cast()).contains(&pointer)
    }
}

// SAFETY: blocks are aligned, stay where they are, and are given to one at a time.
unsafe impl ValueMemory for Arena {
    fn allocate(&self, layout: Layout) -> Option<NonNull<u8>> {
        assert!(layout.size() > 0);
        if layout.size() > BLOCK || layout.align() > BLOCK {
            return None;
        }
        let mut taken = self.taken.lock().unwrap();
        let index = taken.iter().position(Option::is_none)?;
        taken[index] = Some(layout);
        NonNull::new(self.blocks[index].0.get().cast())
    }

    unsafe fn free(&self, memory: NonNull<u8>, layout: Layout) {
        let index = self.blocks.iter().position(|block| block.0.get().cast() == memory.as_ptr());
        let freed = self.taken.lock().unwrap()[index.unwrap()].take();
        assert_eq!(freed, Some(layout));
        // SAFETY: it is unused.
        unsafe { memory.as_ptr().write_bytes(0xaa, BLOCK) };
    }
}
