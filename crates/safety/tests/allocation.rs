//! The gate allocates nothing while it works.

mod common;

use allocation_counter::measure;
use common::*;
use slate_module::Priority::{Plan, Reflex};

#[test]
fn offers_and_outputs_allocate_nothing() {
    let configuration = configuration().limit("left", -1.0, 1.0).unwrap().rate_limit("right", 1.0).unwrap();
    let latch = slate_safety::StopLatch::in_memory();
    let mut gate = armed(configuration.stop_latch(&latch));
    let [fast, invalid] = [wheels(2.0, 2.0), wheels(f64::NAN, 2.0)].map(|wheels| bytes(&wheels));
    let allocated = measure(|| {
        for cycle in 0..100 {
            let now = cycle * 70 * MILLISECOND;
            gate.offer(PLANNER, Plan, fast, now);
            gate.offer(BUMPER, Reflex, invalid, now);
            gate.offer(PLANNER, Plan, &[], now);
            gate.output(now);
            gate.withdraw(BUMPER, now);
            gate.offer(PLANNER, Plan, fast, now);
            gate.output(now);
            gate.output(now + TIME_TO_LIVE);
            if cycle == 50 {
                gate.disarm();
            }
        }
    });
    assert_eq!(allocated.count_total, 0);
    assert_eq!(measure(|| drop(std::hint::black_box(Box::new(1)))).count_total, 1, "the allocator counts");
}
