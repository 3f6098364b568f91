use std::alloc::Layout;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::ptr::NonNull;
use std::sync::{Arc, Mutex, PoisonError};

use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, ftruncate, memfd_create};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use slate_blackboard::channel::ValueMemory;

use super::spans::Spans;

/// Address space of an arena, bytes.
/// Memory is allocated page by page at the first write.
const LENGTH: usize = 16 << 30;

/// Shared memory for values and for the frames of isolated modules.
/// It has no name in the file system, so nothing is left of it when the last process that maps it ends.
#[derive(Debug)]
pub struct Arena {
    file: OwnedFd,
    base: NonNull<u8>,
    spans: Mutex<Spans>,
}

// SAFETY: the memory belongs to its owner alone, and the spans are locked.
unsafe impl Send for Arena {}
// SAFETY: as above.
unsafe impl Sync for Arena {}

impl Arena {
    /// Returns an empty arena.
    ///
    /// # Errors
    /// When the system has no address space left, or the process may not have that much of it.
    pub fn new() -> io::Result<Arc<Self>> {
        let file = memfd_create("slate", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING)?;
        ftruncate(&file, LENGTH as u64)?;
        // Another process with the file could truncate it, which would end this process.
        fcntl_add_seals(&file, SealFlags::SHRINK | SealFlags::GROW | SealFlags::SEAL)?;
        let base = map(file.as_fd(), LENGTH, true)?;
        Ok(Arc::new(Self { file, base, spans: Mutex::new(Spans::new(LENGTH)) }))
    }

    /// Returns the file that another process maps.
    pub fn file(&self) -> BorrowedFd<'_> {
        self.file.as_fd()
    }

    /// Returns the offset of an address from the beginning, bytes; `None` if outside.
    pub fn offset(&self, address: *const u8) -> Option<usize> {
        let offset = (address as usize).wrapping_sub(self.base.as_ptr() as usize);
        (offset < LENGTH).then_some(offset)
    }

    /// Allocates zeroed memory for a value of that many bytes.
    pub(super) fn block(self: &Arc<Self>, bytes: usize) -> Option<Block> {
        let layout = Layout::from_size_align(bytes.max(1), super::spans::GRANULARITY).ok()?;
        let memory = self.allocate(layout)?;
        // SAFETY: just allocated with that many bytes.
        unsafe { memory.write_bytes(0, layout.size()) };
        Some(Block { arena: Arc::clone(self), memory, layout })
    }
}

// SAFETY: the spans are apart from each other and inside the mapping, which stays until this is dropped.
unsafe impl ValueMemory for Arena {
    fn allocate(&self, layout: Layout) -> Option<NonNull<u8>> {
        let at = self
            .spans
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .allocate(layout.size(), layout.align())?;
        // SAFETY: the span is inside of the mapping.
        Some(unsafe { self.base.add(at) })
    }

    unsafe fn free(&self, memory: NonNull<u8>, layout: Layout) {
        if let Some(at) = self.offset(memory.as_ptr()) {
            self.spans.lock().unwrap_or_else(PoisonError::into_inner).free(at, layout.size());
        }
    }
}

impl Drop for Arena {
    fn drop(&mut self) {
        // SAFETY: mapped with that length, and each user of a part also owns the arena.
        let _ = unsafe { munmap(self.base.as_ptr().cast(), LENGTH) };
    }
}

/// Maps an arena, `writable` or only to be read.
pub(super) fn map(file: BorrowedFd<'_>, length: usize, writable: bool) -> io::Result<NonNull<u8>> {
    let protection = if writable { ProtFlags::READ | ProtFlags::WRITE } else { ProtFlags::READ };
    // SAFETY: the system chooses the place, so nothing that is there already is touched.
    let address = unsafe {
        mmap(std::ptr::null_mut(), length, protection, MapFlags::SHARED | MapFlags::NORESERVE, file, 0)?
    };
    NonNull::new(address.cast()).ok_or_else(|| io::Error::other("mapped at address 0"))
}

/// Returns the length of every arena.
pub(super) fn length() -> usize {
    LENGTH
}

/// Part of an arena.
#[derive(Debug)]
pub(super) struct Block {
    arena: Arc<Arena>,
    memory: NonNull<u8>,
    layout: Layout,
}

// SAFETY: the memory belongs to the block alone in this process.
unsafe impl Send for Block {}

impl Block {
    /// Returns the address in this process.
    pub fn as_ptr(&self) -> *mut u8 {
        self.memory.as_ptr()
    }

    /// Returns the size, bytes.
    pub fn size(&self) -> usize {
        self.layout.size()
    }
}

impl Drop for Block {
    fn drop(&mut self) {
        // SAFETY: allocated there with this layout.
        unsafe { self.arena.free(self.memory, self.layout) }
    }
}
