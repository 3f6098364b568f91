//! Random schedules of the synchronization points.
//!
//! `cargo test -p slate-engine --release --features shuttle --test synchronization_schedules`
#![cfg(feature = "shuttle")]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::sync::Arc;
use std::time::Duration;

use shuttle::{check_random, thread};
use slate_engine::synchronization::{Count, Synchronization};

const SCHEDULES: usize = 20_000;
/// A wake-up that is lost is seen as a deadlock, or as a schedule without an end.
const LONG: Duration = Duration::from_secs(3600);

#[test]
fn no_emit_is_missed() {
    check_random(
        || {
            let synchronization = Synchronization::default();
            let emitter = synchronization.emitter("/a/b", "b").unwrap();
            let above = synchronization.point("/a").unwrap();
            let waiters = [(); 2].map(|()| {
                let above = Arc::clone(&above);
                thread::spawn(move || {
                    let mut seen = Count::ZERO;
                    while seen.get() < 3 {
                        let next = above.wait(seen, LONG).unwrap();
                        assert!(next > seen);
                        seen = next;
                    }
                })
            });
            (0..3).for_each(|_| emitter.emit());
            waiters.into_iter().for_each(|thread| thread.join().unwrap());
        },
        SCHEDULES,
    );
}

#[test]
fn emitters_block_no_waiter() {
    check_random(
        || {
            let synchronization = Synchronization::default();
            let first = synchronization.emitter("/end/first", "first").unwrap();
            let second = synchronization.emitter("/end/second", "second").unwrap();
            let end = synchronization.point("/end").unwrap();
            let mark = end.mark();
            let threads = [
                thread::spawn(move || {
                    first.emit();
                    // It stays, so it must have been counted.
                    std::mem::forget(first);
                }),
                thread::spawn(move || drop(second)),
            ];
            let next = end.wait_all(&mark, LONG).unwrap();
            assert_ne!(next, mark);
            threads.into_iter().for_each(|thread| thread.join().unwrap());
        },
        SCHEDULES,
    );
}
