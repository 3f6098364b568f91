//! The gate allocates nothing while it works. Alone in its file, as it counts for the whole process.
#![allow(unsafe_code, reason = "an allocator that counts")]

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use common::*;
use slate_module::Priority::{Plan, Reflex};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: as promised by the caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as promised by the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn offers_and_outputs_allocate_nothing() {
    let configuration = configuration().limit("left", -1.0, 1.0).unwrap().rate_limit("right", 1.0).unwrap();
    let latch = slate_safety::StopLatch::in_memory();
    let mut gate = armed(configuration.stop_latch(&latch));
    let before = ALLOCATIONS.get();
    for cycle in 0..100 {
        let now = cycle * 70 * MILLISECOND;
        gate.offer(PLANNER, Plan, bytes(&wheels(2.0, 2.0)), now);
        gate.offer(BUMPER, Reflex, bytes(&wheels(f64::NAN, 2.0)), now);
        gate.offer(PLANNER, Plan, &[], now);
        gate.output(now);
        gate.withdraw(BUMPER, now);
        gate.offer(PLANNER, Plan, bytes(&wheels(2.0, 2.0)), now);
        gate.output(now);
        gate.output(now + TIME_TO_LIVE);
        if cycle == 50 {
            gate.disarm();
        }
    }
    assert_eq!(ALLOCATIONS.get(), before);
    drop(std::hint::black_box(Box::new(1)));
    assert_eq!(ALLOCATIONS.get(), before + 1, "the allocator counts");
}
