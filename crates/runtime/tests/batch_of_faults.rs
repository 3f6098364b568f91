//! Many faults for a long time. It is alone in its process, whose memory and threads it measures.
#![cfg(not(feature = "shuttle"))]
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what it is about"
)]

#[path = "common/batch.rs"]
mod batch;

use slate_runtime::End;

#[test]
fn faults_of_a_hundred_modules_cost_the_others_no_cycle() {
    let batch = batch::run(303);
    assert_eq!(batch.end, End::Stopped);
    assert_eq!(batch.missed, 0, "{batch:?}");
    assert!(batch.panics >= 60 && batch.late >= 60 && batch.alive, "{batch:?}");
    assert!(batch.threads <= 0, "no thread is left over: {batch:?}");
    assert!(batch.memory < 8 << 20, "{batch:?}");
}
