//! Parallel work on many robots.
//! Results do not depend on the number of threads.

use std::sync::Mutex;

/// Batch size of a thread; fewer items take less time than a thread's start.
const PART: usize = 64;

/// Applies `work` to each item, with its number and a thread's own memory.
/// At most as many threads run as there are memories, including the calling one.
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
