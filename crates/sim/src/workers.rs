//! Work on many robots in several threads, with the same result in any number of them.

use std::sync::Mutex;

/// Items per batch of a thread; fewer take less time than a thread's start.
const PART: usize = 64;

/// Does work on each item, which has its number and memory that no other thread uses meanwhile. There are at most as many
/// threads as memories, this one among them.
pub(crate) fn each<T: Send, M: Send>(
    items: &mut [T],
    memories: &mut [M],
    work: impl Fn(usize, &mut T, &mut M) + Sync,
) {
    let workers = memories.len().min(items.len() / PART).max(1);
    let mut memories = memories.iter_mut().take(workers);
    let Some(own) = memories.next() else { return };
    if workers == 1 {
        for (i, item) in items.iter_mut().enumerate() {
            work(i, item, own);
        }
        return;
    }
    // An idle thread takes the next part, so that a late one delays no other.
    let parts = Mutex::new(items.chunks_mut(PART).enumerate());
    let next = || parts.lock().ok()?.next();
    let do_parts = |memory: &mut M| {
        while let Some((part, items)) = next() {
            for (i, item) in items.iter_mut().enumerate() {
                work(part * PART + i, item, memory);
            }
        }
    };
    let do_parts = &do_parts;
    std::thread::scope(|scope| {
        for memory in memories {
            scope.spawn(move || do_parts(memory));
        }
        do_parts(own);
    });
}
