use std::alloc::Layout;
use std::fmt;
use std::ptr::NonNull;
use std::sync::Arc;

/// Allocator of values outside of the heap: an arena that another process maps too.
///
/// Only bytes are taken from here. What the protocol trusts stays in private memory, so another process that can write to
/// this memory spoils values and nothing more. It is called when handles are linked and when the channel is gone, never
/// while a value is written.
///
/// # Safety
/// Memory that was allocated is aligned, as large as its layout, stays at its address until it is freed or `self` is
/// dropped, can be read and written there, and belongs to nothing else in this process.
pub unsafe trait ValueMemory: Send + Sync {
    /// Allocates memory of that layout, whose size is never 0; `None` if none is left.
    /// The content is arbitrary.
    fn allocate(&self, layout: Layout) -> Option<NonNull<u8>>;

    /// Frees memory.
    ///
    /// # Safety
    /// It was allocated here with this layout, and is unused.
    unsafe fn free(&self, memory: NonNull<u8>, layout: Layout);
}

/// Memory of the bytes of a channel's values.
pub(super) enum SlotMemory {
    /// Memory behind each slot.
    Heap,
    Given(Arc<dyn ValueMemory>),
}

impl fmt::Debug for SlotMemory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Heap => "Heap",
            Self::Given(_) => "Given",
        })
    }
}
