//! Synchronization points, used by threads.
#![cfg(not(feature = "shuttle"))]
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use slate_engine::synchronization::{Count, PointError, Synchronization};

/// Longer than anything here takes, so that a lost wake-up is seen as a timeout.
const LONG: Duration = Duration::from_secs(60);
const SHORT: Duration = Duration::from_millis(2);

#[test]
fn an_emit_before_the_wait_is_found() {
    let synchronization = Synchronization::default();
    let start = synchronization.emitter("/stage/act/start", "loop").unwrap();
    start.emit();
    start.emit();
    let seen = start.point().wait(Count::ZERO, SHORT).unwrap();
    assert_eq!(seen.get(), 2);
    let error = start.point().wait(seen, SHORT).unwrap_err();
    assert_eq!(error.to_string(), "nothing was emitted at `/stage/act/start` within 2ms");
    start.emit();
    assert_eq!(start.point().wait(seen, SHORT).unwrap().get(), 3);
}

#[test]
fn an_emit_reaches_the_points_above_and_no_others() {
    let synchronization = Synchronization::default();
    let beside = synchronization.point("/stage/think").unwrap();
    let below = synchronization.point("/stage/act/start/late").unwrap();
    let start = synchronization.emitter("/stage/act/start", "loop").unwrap();
    start.emit();
    for name in ["/stage/act/start", "/stage/act", "/stage", "/"] {
        assert_eq!(synchronization.point(name).unwrap().count().get(), 1, "{name}");
    }
    assert_eq!((beside.count(), below.count()), (Count::ZERO, Count::ZERO));
    let names = synchronization.names();
    let expected = ["/", "/stage", "/stage/act", "/stage/act/start", "/stage/act/start/late", "/stage/think"];
    assert!(names.iter().map(|name| &**name).eq(expected), "{names:?}");
}

#[test]
fn names_are_checked() {
    let synchronization = Synchronization::default();
    let long = format!("/{}", "x".repeat(128));
    for name in
        ["", "stage", "stage/act", "//", "/stage/", "/stage//act", "/a b", "/1/2/3/4/5/6/7/8/9", &long]
    {
        let error = synchronization.point(name).unwrap_err();
        assert_eq!(error, PointError::Name { name: name.into() });
        assert_eq!(synchronization.emitter(name, "loop").unwrap_err(), error);
    }
    assert!(synchronization.names().is_empty(), "what is refused leaves nothing behind");
    assert!(synchronization.point("/1/2/3/4/5/6/7/8").is_ok());
    let full = (0..5000).find_map(|number| synchronization.point(&format!("/{number}")).err());
    assert!(matches!(full, Some(PointError::TooMany { .. })));
    assert!(synchronization.point("/1/2").is_ok(), "those that there are go on");
}

#[test]
fn all_emitters_are_waited_for_and_the_late_are_named() {
    let synchronization = Synchronization::default();
    let emitters = ["camera", "laser", "grabber"]
        .map(|who| synchronization.emitter(&format!("/sensors/{who}/end"), who).unwrap());
    let sensors = synchronization.point("/sensors").unwrap();
    let mark = sensors.mark();
    emitters[1].emit();
    emitters[1].emit();
    let error = sensors.wait_all(&mark, SHORT).unwrap_err();
    assert_eq!(error.to_string(), "`/sensors` was not emitted within 2ms by `camera`, `grabber`");
    emitters[0].emit();
    emitters[2].emit();
    let next = sensors.wait_all(&mark, SHORT).unwrap();
    // Each is counted from the mark on, so those emits do not count again.
    assert_eq!(sensors.wait_all(&next, SHORT).unwrap_err().late.len(), 3);
    // Only those are waited for that were there at the mark.
    let late = synchronization.emitter("/sensors/compass/end", "compass").unwrap();
    emitters.iter().for_each(|emitter| emitter.emit());
    let next = sensors.wait_all(&next, SHORT).unwrap();
    emitters.iter().for_each(|emitter| emitter.emit());
    assert_eq!(&*sensors.wait_all(&next, SHORT).unwrap_err().late[0], "compass");
    late.emit();
    assert!(sensors.wait_all(&next, SHORT).is_ok());
}

#[test]
fn removed_emitter_blocks_no_waiter() {
    let synchronization = Synchronization::default();
    let stays = synchronization.emitter("/sensors/laser", "laser").unwrap();
    let leaves = synchronization.emitter("/sensors/camera", "camera").unwrap();
    let sensors = synchronization.point("/sensors").unwrap();
    let mark = sensors.mark();
    stays.emit();
    let waiter = {
        let sensors = Arc::clone(&sensors);
        thread::spawn(move || sensors.wait_all(&mark, LONG))
    };
    drop(leaves);
    assert!(waiter.join().unwrap().is_ok());
    drop(stays);
    assert!(sensors.wait_all(&sensors.mark(), SHORT).is_ok(), "nobody is left");
    assert_eq!(sensors.count().get(), 1, "leaving is no emit");
}

#[test]
fn a_waiter_sleeps_until_its_time_is_up() {
    let synchronization = Synchronization::default();
    let point = synchronization.point("/never").unwrap();
    let limit = Duration::from_millis(30);
    let start = Instant::now();
    assert_eq!(point.wait(Count::ZERO, limit).unwrap_err().limit, limit);
    assert!(start.elapsed() >= limit);
}

/// Two threads call each other by turns. Were one wake-up lost, both would sleep for ever.
#[test]
fn no_wake_up_is_lost_between_two() {
    const ROUNDS: u64 = 50_000;
    let synchronization = Synchronization::default();
    let ping = synchronization.emitter("/ping/go", "a").unwrap();
    let pong = synchronization.emitter("/pong/go", "b").unwrap();
    let (above_ping, above_pong) =
        (synchronization.point("/ping").unwrap(), synchronization.point("/pong").unwrap());
    let other = thread::spawn(move || {
        let mut seen = Count::ZERO;
        for _ in 0..ROUNDS {
            seen = above_ping.wait(seen, LONG).unwrap();
            pong.emit();
        }
        seen
    });
    let mut seen = Count::ZERO;
    for round in 1..=ROUNDS {
        ping.emit();
        seen = above_pong.wait(seen, LONG).unwrap();
        assert_eq!(seen.get(), round);
    }
    assert_eq!(other.join().unwrap().get(), ROUNDS);
}

/// A loop as Fawkes's: it starts many short threads and waits for the end of all.
#[test]
fn no_wake_up_is_lost_between_a_loop_and_its_threads() {
    const CYCLES: u64 = 3000;
    const THREADS: usize = 4;
    let synchronization = Synchronization::default();
    let start = synchronization.emitter("/act/start", "loop").unwrap();
    let end = synchronization.point("/act/end").unwrap();
    let cycles: Arc<[AtomicU64]> = (0..THREADS).map(|_| AtomicU64::new(0)).collect();
    let threads: Vec<_> = (0..THREADS)
        .map(|index| {
            let emitter = synchronization.emitter("/act/end", &format!("thread {index}")).unwrap();
            let (start, cycles) = (Arc::clone(start.point()), Arc::clone(&cycles));
            thread::spawn(move || {
                let mut seen = Count::ZERO;
                while seen.get() < CYCLES {
                    seen = start.wait(seen, LONG).unwrap();
                    cycles[index].fetch_add(1, Ordering::Relaxed);
                    emitter.emit();
                }
                // The last may leave before the loop has looked.
            })
        })
        .collect();
    let mut mark = end.mark();
    for cycle in 1..=CYCLES {
        start.emit();
        mark = end.wait_all(&mark, LONG).unwrap();
        assert!(cycles.iter().all(|count| count.load(Ordering::Relaxed) == cycle), "cycle {cycle}");
    }
    threads.into_iter().for_each(|thread| thread.join().unwrap());
}

/// Many waiters come and go while the emitters never look back; each sees every count rise, and the last one.
#[test]
fn waiters_that_come_and_go_miss_nothing() {
    const EMITS: u64 = 20_000;
    let synchronization = Arc::new(Synchronization::default());
    let emitters = ["/a/b", "/a/c"].map(|name| synchronization.emitter(name, name).unwrap());
    let above = synchronization.point("/a").unwrap();
    let waiters: Vec<_> = (0..4)
        .map(|_| {
            let above = Arc::clone(&above);
            thread::spawn(move || {
                let mut seen = Count::ZERO;
                while seen.get() < 2 * EMITS {
                    let next = above.wait(seen, LONG).unwrap();
                    assert!(next > seen);
                    seen = next;
                }
            })
        })
        .collect();
    let threads = emitters.map(|emitter| {
        thread::spawn(move || {
            (0..EMITS).for_each(|_| emitter.emit());
            emitter
        })
    });
    let emitters = threads.map(|thread| thread.join().unwrap());
    for waiter in waiters {
        waiter.join().unwrap();
    }
    assert_eq!(above.count().get(), 2 * EMITS);
    drop(emitters);
}
