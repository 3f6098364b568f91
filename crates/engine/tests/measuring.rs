//! To emit a synchronization point, to count a duration and to record a span allocate nothing.
#![cfg(not(feature = "shuttle"))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::hint::black_box;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use allocation_counter::measure;
use slate_engine::synchronization::{Count, Synchronization};
use slate_engine::timing::{Histogram, Span, Trace};

#[test]
fn the_allocator_counts() {
    assert_eq!(measure(|| drop(black_box(Box::new(7)))).count_total, 1);
}

#[test]
fn durations_and_spans_allocate_nothing() {
    let trace = Trace::new(100);
    let label = trace.label("step").unwrap();
    let track = trace.track("loop").unwrap();
    let mut histogram = Histogram::default();
    let allocated = measure(|| {
        for cycle in 0..1000 {
            track.record(Span { label, start: cycle * 10, duration: cycle, cycle });
            histogram.record(cycle);
        }
        black_box(histogram.summary());
    });
    assert_eq!(allocated.count_total, 0);
}

#[test]
fn emit_allocates_nothing_with_waiters() {
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
    let allocated = measure(|| (0..EMITS).for_each(|_| emitter.emit()));
    assert_eq!(allocated.count_total, 0);
    waiter.join().unwrap();
}
