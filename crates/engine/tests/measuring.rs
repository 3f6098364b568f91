//! To emit a synchronisation point, to count a duration and to record a span allocate nothing.
#![cfg(not(feature = "shuttle"))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::hint::black_box;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use slate_engine::synchronization::{Count, Synchronization};
use slate_engine::timing::{Histogram, Span, Trace};

/// Counts what this thread allocates.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // A thread that ends may allocate when its counter is gone.
    let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
}

#[allow(unsafe_code, reason = "an allocator that counts")]
// SAFETY: everything is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: passed on.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: passed on.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn the_allocator_counts() {
    let before = ALLOCATIONS.get();
    drop(black_box(Box::new(7)));
    assert_eq!(ALLOCATIONS.get(), before + 1);
}

#[test]
fn durations_and_spans_allocate_nothing() {
    let trace = Trace::new(100);
    let label = trace.label("step").unwrap();
    let track = trace.track("loop").unwrap();
    let mut histogram = Histogram::default();
    let before = ALLOCATIONS.get();
    for cycle in 0..1000 {
        track.record(Span { label, start: cycle * 10, duration: cycle, cycle });
        histogram.record(cycle);
    }
    black_box(histogram.summary());
    assert_eq!(ALLOCATIONS.get(), before);
}

#[test]
fn to_emit_allocates_nothing_also_when_somebody_waits() {
    const EMITS: u64 = 10_000;
    let synchronization = Synchronization::default();
    let emitter = synchronization.emitter("/stage/act/start", "loop").unwrap();
    let point = Arc::clone(emitter.point());
    let waiter = thread::spawn(move || {
        let mut seen = Count::ZERO;
        while seen.get() < EMITS {
            seen = point.wait(seen, Duration::from_secs(60)).unwrap();
        }
    });
    let before = ALLOCATIONS.get();
    (0..EMITS).for_each(|_| emitter.emit());
    assert_eq!(ALLOCATIONS.get(), before);
    waiter.join().unwrap();
}
