//! The aspect `Threads`: what a module's threads are promised, and what others are promised of them.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and threads are a matter of the wall clock"
)]

mod ends;
use crate::scripted;
mod values;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use scripted::{HANG, Number, Other, Stage, eventually, lines, script};
use slate_module::aspect::{Stop, ThreadState};
use slate_module::prelude::*;
use slate_runtime::{Control, PluginError};

/// Tells when it is dropped.
struct Dropped(Arc<AtomicU64>);

impl Drop for Dropped {
    fn drop(&mut self) {
        self.0.fetch_add(1, Ordering::SeqCst);
    }
}

fn load(counter: &AtomicU64) -> u64 {
    counter.load(Ordering::SeqCst)
}

/// Waits for its end, however long that takes.
fn patient(stop: &Stop) {
    while stop.wait(Duration::from_secs(3600)) {}
}

/// Does not stop until that is true.
fn stubborn(released: &Arc<AtomicBool>) -> impl FnOnce(&Stop) + Send + 'static {
    let released = Arc::clone(released);
    move |_| {
        while !released.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}
#[test]
fn a_thread_has_its_modules_name_the_agents_time_and_its_log() {
    script("observatory", |io, now| {
        if now.number() == 1 {
            let watcher = |stop: &Stop| {
                let name = std::thread::current().name().unwrap().to_owned();
                assert!(!stop.is_set());
                stop.warn(format_args!("{name} at {}", stop.now()));
                patient(stop);
                assert!(stop.is_set());
                stop.info(format_args!("over"));
            };
            io.threads.spawn("watcher", watcher).unwrap();
        }
        if now.number() == 5 {
            io.threads.stop("watcher");
        }
        Outcome::Ok
    });
    let mut stage = Stage::new(&["observatory"]);
    stage.step();
    let line = "Warn observatory rvatory/watcher at 0";
    eventually("its line", || stage.lines().iter().any(|other| other == line));
    (0..5).for_each(|_| stage.step());
    eventually("its end", || stage.lines().iter().any(|line| line == "Info observatory over"));
}

#[test]
fn lockstep_says_once_that_threads_cannot_be_repeated() {
    script("said", |io, now| {
        let _ = io.threads.spawn(&format!("thread-{}", now.number()), |_| {});
        Outcome::Ok
    });
    let mut stage = Stage::new(&["said"]);
    (0..5).for_each(|_| stage.step());
    let lines = stage.lines();
    let said = lines.iter().filter(|line| line.contains("can't be repeated")).count();
    assert_eq!(said, 1, "{lines:#?}");

    script("unsaid", |io, now| {
        let _ = io.threads.spawn(&format!("thread-{}", now.number()), |_| {});
        Outcome::Ok
    });
    let mut stage = Stage::on_the_wall_clock(&["unsaid"]);
    let five = Box::new(
        |cycle: &slate_runtime::Cycle<'_>| {
            if cycle.number < 5 { Control::Continue } else { Control::Stop }
        },
    );
    stage.agent.run(five).unwrap();
    assert!(stage.lines().iter().all(|line| !line.contains("can't be repeated")));
}

#[test]
fn threads_and_ticks_meet_at_synchronization_points() {
    script("meeting", |io, now| {
        let synchronization = &io.synchronization;
        if now.number() == 1 {
            assert!(synchronization.emit("no name").is_err());
            assert!(synchronization.count("no name").is_err());
            assert_eq!(synchronization.count("/meeting/thread"), Ok(0));
            let thread = |stop: &Stop| {
                let mut seen = 0;
                assert!(stop.wait_for("no name", 0, Duration::ZERO).is_err());
                assert!(stop.emit("no name").is_err());
                assert_eq!(stop.wait_for("/never", 0, Duration::from_millis(1)), Ok(None));
                while let Some(count) =
                    stop.wait_for("/meeting/tick", seen, Duration::from_secs(3600)).unwrap()
                {
                    seen = count;
                    stop.emit("/meeting/thread").unwrap();
                }
                assert!(stop.is_set());
            };
            io.threads.spawn("thread", thread).unwrap();
        }
        synchronization.emit("/meeting/tick").unwrap();
        // What a tick that fails emits is not emitted.
        if now.number() % 2 == 0 {
            return Outcome::Failed;
        }
        io.number.set(Number { value: synchronization.count("/meeting/thread").unwrap() });
        Outcome::Ok
    });
    let mut stage = Stage::new(&["meeting"]);
    let point = stage.agent.synchronization().point("/meeting/tick").unwrap();
    (0..10).for_each(|_| stage.step());
    assert_eq!(point.count().get(), 5);
    stage.until_true("both met thrice", |stage| stage.number("meeting").is_some_and(|count| count >= 3));
    // It waits for an hour, and ends nevertheless.
    let start = Instant::now();
    stage.agent.composer().unload("scripted").unwrap();
    assert!(start.elapsed() < HANG);
}

#[test]
fn levels_are_changed_by_a_module_and_not_by_its_failed_tick() {
    use slate_module::Level;
    script("attentive", |io, now| {
        match now.number() {
            1 => {
                assert_eq!(io.logger.level("beat"), Level::Info);
                io.logger.set_level(Some("beat"), Level::Trace);
                assert_eq!(io.logger.level("beat"), Level::Info);
                return Outcome::Failed;
            }
            2 => {
                assert_eq!(io.logger.level("beat"), Level::Info);
                io.logger.set_level(Some("beat"), Level::Debug);
                io.logger.set_level(None, Level::Warn);
            }
            _ => {
                assert_eq!(io.logger.level("beat"), Level::Debug);
                assert_eq!(io.logger.level("attentive"), Level::Warn);
                assert_eq!(io.logger.dropped(), 0);
                io.number.set(Number { value: 1 });
            }
        }
        Outcome::Ok
    });
    let mut stage = Stage::new(&["attentive"]);
    (0..3).for_each(|_| stage.step());
    assert_eq!(stage.number("attentive"), Some(1), "{:?}", stage.lines());
}
