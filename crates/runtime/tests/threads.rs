//! The aspect `Threads`: what a module's threads are promised, and what others are promised of them.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and threads are a matter of the wall clock"
)]

mod scripted;

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
fn values_go_both_ways_in_order_and_none_is_lost() {
    const COUNT: u64 = 20_000;
    let (mut sent, mut received) = (0, 0);
    script("echo", move |io, _| {
        if io.threads.state("doubler") == ThreadState::Absent {
            let doubler = |stop: &Stop| {
                while stop.wait(Duration::from_secs(3600)) {
                    while let Some(number) = stop.receive::<Number>().unwrap() {
                        while !stop.send(&Number { value: 2 * number.value }).unwrap() {
                            std::thread::yield_now();
                        }
                    }
                }
            };
            io.threads.spawn("doubler", doubler).unwrap();
        }
        for _ in 0..500 {
            if sent < COUNT && io.threads.send("doubler", &Number { value: sent }).unwrap() {
                sent += 1;
            }
        }
        while let Some(number) = io.threads.receive::<Number>("doubler").unwrap() {
            assert_eq!(number.value, 2 * received);
            received += 1;
        }
        io.number.set(Number { value: received });
        Outcome::Ok
    });
    Stage::new(&["echo"]).until("echo", COUNT);
}

#[test]
fn a_tick_sees_what_was_sent_before_it_and_its_own_goes_out_after_it() {
    let (to_test, from_thread) = channel();
    let (to_thread, from_test) = channel::<()>();
    let from_test = std::sync::Mutex::new(from_test);
    let mut parts = Some((to_test, from_test));
    let arrived = Arc::new(AtomicBool::new(false));
    let has_arrived = Arc::clone(&arrived);
    script("snapshot", move |io, now| {
        if let Some((to_test, from_test)) = parts.take() {
            let thread = move |stop: &Stop| {
                while stop.receive::<Number>().unwrap().is_none() && stop.wait(Duration::from_millis(1)) {}
                to_test.send(()).unwrap();
                from_test.lock().unwrap().recv().unwrap();
                stop.send(&Number { value: 1 }).unwrap();
                to_test.send(()).unwrap();
                patient(stop);
            };
            io.threads.spawn("thread", thread).unwrap();
            io.threads.send("thread", &Number { value: 1 }).unwrap();
            // It has not even begun.
            assert!(from_thread.try_recv().is_err());
        } else if now.number() == 2 {
            from_thread.recv().unwrap();
            to_thread.send(()).unwrap();
            from_thread.recv().unwrap();
            // It is there by now, but was not when the tick began.
            assert_eq!(io.threads.receive::<Number>("thread").unwrap(), None);
        } else {
            let number = io.threads.receive::<Number>("thread").unwrap();
            has_arrived.store(number == Some(Number { value: 1 }), Ordering::SeqCst);
        }
        Outcome::Ok
    });
    let mut stage = Stage::new(&["snapshot"]);
    (0..3).for_each(|_| stage.step());
    assert!(arrived.load(Ordering::SeqCst), "{:?}", stage.lines());
}

#[test]
fn a_full_ring_refuses_and_another_interface_is_dropped() {
    script("full", |io, now| {
        let threads = &io.threads;
        match now.number() {
            1 => threads.spawn_with_room("idle", 60, patient).unwrap(),
            2 => {
                let send = || threads.send("idle", &Number { value: 1 }).unwrap();
                // 20 bytes each.
                assert_eq!((send(), send(), send(), send()), (true, true, true, false));
                let reason = threads.send("idle", &[0_u64; 7].map(|value| Number { value })[0]);
                assert_eq!(reason, Ok(false));
                threads.spawn_with_room("tiny", 19, patient).unwrap();
                let reason = threads.send("tiny", &Number { value: 1 }).unwrap_err().0;
                assert!(reason.contains("needs 20 in the ring, which has 19"), "{reason}");
            }
            3 => {
                let sender = |stop: &Stop| {
                    stop.send(&Other { value: 1 }).unwrap();
                    stop.send(&Number { value: 2 }).unwrap();
                };
                threads.spawn("sender", sender).unwrap();
            }
            _ if threads.state("sender") == ThreadState::Ended => match threads.receive::<Number>("sender") {
                Err(refusal) => assert!(refusal.0.contains("another interface"), "{refusal}"),
                Ok(Some(number)) => io.number.set(number),
                Ok(None) => {}
            },
            _ => {}
        }
        Outcome::Ok
    });
    let mut stage = Stage::new(&["full"]);
    stage.until("full", 2);
    assert_eq!(stage.agent.counts("full").unwrap().2, 0, "{:?}", stage.lines());
}

#[test]
fn wrong_names_double_names_and_too_many_threads_are_refused() {
    script("names", |io, now| {
        let spawn = |name: &str| io.threads.spawn(name, patient).map_err(|refusal| refusal.0);
        if now.number() == 1 {
            for wrong in ["", "a/b", "ä", "a b", &"a".repeat(65)] {
                assert!(spawn(wrong).unwrap_err().contains("is no name of a thread"));
            }
            spawn("one").unwrap();
            assert!(spawn("one").unwrap_err().contains("`one` runs already"));
            (2..=16).for_each(|number| spawn(&format!("thread-{number}")).unwrap());
            assert!(spawn("one-more").unwrap_err().contains("there are 16, which is the limit"));
            assert!(
                io.threads.send("none", &Number { value: 1 }).unwrap_err().0.contains("no thread `none`")
            );
            assert!(io.threads.receive::<Number>("none").unwrap_err().0.contains("no thread `none`"));
            assert_eq!(io.threads.state("none"), ThreadState::Absent);
        }
        io.number.set(Number { value: now.number() });
        Outcome::Ok
    });
    let mut stage = Stage::new(&["names"]);
    stage.step();
    assert_eq!(stage.number("names"), Some(1), "{:?}", stage.lines());
}

#[test]
fn what_a_failed_tick_asks_for_does_not_happen() {
    let (begun, dropped) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
    let (seen, guard) = (Arc::clone(&begun), Arc::clone(&dropped));
    script("failing", move |io, now| {
        let threads = &io.threads;
        match now.number() {
            1 => {
                let (begun, guard) = (Arc::clone(&seen), Dropped(Arc::clone(&guard)));
                let body = move |_: &Stop| {
                    begun.fetch_add(1, Ordering::SeqCst);
                    drop(guard);
                };
                threads.spawn("thread", body).unwrap();
                assert!(threads.is_running("thread"));
                Outcome::Failed
            }
            2 => {
                assert_eq!(threads.state("thread"), ThreadState::Absent);
                let first = |stop: &Stop| {
                    while stop.wait(Duration::from_secs(3600)) {
                        if let Some(number) = stop.receive::<Number>().unwrap() {
                            stop.send(&number).unwrap();
                        }
                    }
                };
                threads.spawn("echo", first).unwrap();
                Outcome::Ok
            }
            3 => {
                threads.send("echo", &Number { value: 3 }).unwrap();
                threads.stop("echo");
                Outcome::Failed
            }
            4 => {
                threads.send("echo", &Number { value: 4 }).unwrap();
                Outcome::Ok
            }
            _ => {
                if let Some(number) = threads.receive::<Number>("echo").unwrap() {
                    io.number.set(number);
                }
                Outcome::Ok
            }
        }
    });
    let mut stage = Stage::new(&["failing"]);
    stage.until_true("an echo", |stage| stage.number("failing").is_some_and(|number| number > 0));
    assert_eq!(stage.number("failing"), Some(4));
    assert_eq!((load(&begun), load(&dropped)), (0, 1));
}

#[test]
fn a_failed_tick_leaves_what_is_known_of_a_thread_as_it_was() {
    script("keeping", |io, now| {
        let threads = &io.threads;
        if now.number() == 1 {
            threads
                .spawn("bull", |stop| {
                    stop.send(&Number { value: 7 }).unwrap();
                    panic!("seeing red");
                })
                .unwrap();
        } else if threads.state("bull") == ThreadState::Panicked {
            if now.number() % 2 == 0 {
                threads.spawn("bull", patient).unwrap();
                assert!(threads.is_running("bull"));
                return Outcome::Failed;
            }
            if let Some(number) = threads.receive::<Number>("bull").unwrap() {
                io.number.set(number);
            }
        }
        Outcome::Ok
    });
    Stage::new(&["keeping"]).until("keeping", 7);
}

#[test]
fn a_module_on_a_thread_of_its_own_may_own_more() {
    script("periodic", |io, now| {
        if !io.threads.is_running("echo") {
            let echo = |stop: &Stop| {
                while stop.wait(Duration::from_secs(3600)) {
                    while let Some(number) = stop.receive::<Number>().unwrap() {
                        stop.send(&number).unwrap();
                    }
                }
            };
            io.threads.spawn("echo", echo).unwrap();
        }
        io.threads.send("echo", &Number { value: now.number() }).unwrap();
        while let Some(number) = io.threads.receive::<Number>("echo").unwrap() {
            io.number.set(number);
        }
        Outcome::Ok
    });
    let mut stage = Stage::threaded("[modules.periodic]\nplugin = \"scripted\"\nevery = \"1ms\"\n");
    let composer = stage.agent.composer();
    let (told, unload) = channel();
    let unloader = std::thread::spawn(move || {
        unload.recv().unwrap();
        composer.unload("scripted")
    });
    let mut told = Some(told);
    let until_gone = Box::new(move |cycle: &slate_runtime::Cycle<'_>| {
        let heard = cycle.board.read("periodic/number/value");
        let heard = heard.ok().flatten().is_some_and(|(value, _)| value.as_f64() > Some(10.0));
        if heard && let Some(told) = told.take() {
            told.send(()).unwrap();
        }
        if unloader.is_finished() { Control::Stop } else { Control::Continue }
    });
    stage.agent.run(until_gone).unwrap();
    assert!(stage.agent.modules().is_empty());
}

#[test]
fn unloading_ends_the_threads_first() {
    let ended = Arc::new(AtomicU64::new(0));
    let guard = Arc::clone(&ended);
    script("leaving", move |io, _| {
        if !io.threads.is_running("waiter") {
            let guard = Dropped(Arc::clone(&guard));
            let waiter = move |stop: &Stop| {
                let _guard = guard;
                patient(stop);
                // It has some time to clear up.
                std::thread::sleep(Duration::from_millis(30));
            };
            io.threads.spawn("waiter", waiter).unwrap();
        }
        Outcome::Ok
    });
    let mut stage = Stage::new(&["leaving"]);
    stage.step();
    let start = Instant::now();
    stage.agent.composer().unload("scripted").unwrap();
    assert_eq!(load(&ended), 1);
    assert!(start.elapsed() >= Duration::from_millis(30));
    assert!(stage.agent.modules().iter().all(|module| module != "leaving"));
}

#[test]
fn a_thread_that_does_not_stop_keeps_its_module_and_others_go_on() {
    let released = Arc::new(AtomicBool::new(false));
    let (begun, release) = (Arc::new(AtomicU64::new(0)), Arc::clone(&released));
    let count = Arc::clone(&begun);
    script("stubborn", move |io, _| {
        if io.threads.state("mule") == ThreadState::Absent {
            io.threads.spawn("mule", stubborn(&release)).unwrap();
        }
        Outcome::Ok
    });
    script("docile", move |io, _| {
        if !io.threads.is_running("sheep") {
            let count = Arc::clone(&count);
            let sheep = move |stop: &Stop| {
                count.fetch_add(1, Ordering::SeqCst);
                patient(stop);
            };
            io.threads.spawn("sheep", sheep).unwrap();
        }
        Outcome::Ok
    });
    let mut stage = Stage::new(&["stubborn", "docile"]);
    stage.step();
    eventually("the thread begins", || load(&begun) == 1);
    let composer = stage.agent.composer();
    let unloader = std::thread::spawn(move || composer.unload("scripted"));
    // The loop goes on meanwhile, and asks for a thread that must not begin now.
    let start = Instant::now();
    while !unloader.is_finished() {
        stage.step();
        if start.elapsed() < HANG / 2 {
            assert_eq!(load(&begun), 1);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    let error = unloader.join().unwrap().unwrap_err();
    assert!(
        matches!(&error, PluginError::Thread { module, thread, .. } if module == "stubborn" && thread == "mule"),
        "{error}"
    );
    assert_eq!(
        error.to_string(),
        "thread `mule` of module `stubborn` has not ended within 300ms of being told to stop"
    );
    // The module stays, and so the thread that was told to stop in vain begins again.
    stage.until_true("a new thread", |_| load(&begun) == 2);
    released.store(true, Ordering::SeqCst);
    stage.agent.composer().unload("scripted").unwrap();
}

#[test]
fn a_panic_in_a_thread_is_caught_logged_and_seen() {
    script("wild", |io, _| {
        match io.threads.state("bull") {
            ThreadState::Absent => io.threads.spawn("bull", |_| panic!("seeing red")).unwrap(),
            state => io.number.set(Number { value: state as u64 }),
        }
        Outcome::Ok
    });
    let mut stage = Stage::new(&["wild"]);
    stage.until("wild", ThreadState::Panicked as u64);
    let lines = stage.lines();
    assert!(lines.contains(&"Error wild its thread panicked: seeing red".into()), "{lines:#?}");
    stage.agent.composer().unload("scripted").unwrap();
}

#[test]
fn after_a_panic_of_the_tick_its_threads_begin_anew() {
    let (begun, ended) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
    let counts = (Arc::clone(&begun), Arc::clone(&ended));
    script("clumsy", move |io, now| {
        if !io.threads.is_running("helper") {
            let (begun, guard) = (Arc::clone(&counts.0), Dropped(Arc::clone(&counts.1)));
            let helper = move |stop: &Stop| {
                begun.fetch_add(1, Ordering::SeqCst);
                // An old one's word must not reach the new instance.
                stop.send(&Number { value: load(&begun) }).unwrap();
                patient(stop);
                drop(guard);
            };
            io.threads.spawn("helper", helper).unwrap();
        }
        if now.number() == 3 {
            panic!("as the test wants");
        }
        if let Ok(Some(number)) = io.threads.receive::<Number>("helper")
            && now.number() > 3
        {
            io.number.set(number);
        }
        Outcome::Ok
    });
    let mut stage = Stage::new(&["clumsy"]);
    (0..3).for_each(|_| stage.step());
    eventually("the first one ends", || load(&ended) == 1);
    stage.until("clumsy", 2);
    assert_eq!((load(&begun), load(&ended)), (2, 1));
}

#[test]
fn a_module_that_is_off_for_good_loses_its_threads_and_a_stubborn_one_is_named() {
    let released = Arc::new(AtomicBool::new(false));
    let release = Arc::clone(&released);
    script("hopeless", move |io, _| {
        if !io.threads.is_running("mule") {
            io.threads.spawn("mule", stubborn(&release)).unwrap();
            return Outcome::Ok;
        }
        panic!("again and again");
    });
    let mut stage = Stage::new(&["hopeless"]);
    for _ in 0..10 {
        stage.step();
    }
    let named = "Error agent the thread `mule` of hopeless has not ended within 300ms of being told to stop; it is \
                 left behind, and its code stays in memory";
    eventually("it is named", || stage.lines().iter().any(|line| line == named));
    released.store(true, Ordering::SeqCst);
    eventually("the module can go", || stage.agent.composer().unload("scripted").is_ok());
}

#[test]
fn the_end_of_the_agent_ends_all_threads_and_names_one_that_stays() {
    let released = Arc::new(AtomicBool::new(false));
    let ended = Arc::new(AtomicU64::new(0));
    let (release, guard) = (Arc::clone(&released), Arc::clone(&ended));
    script("last", move |io, now| {
        if now.number() == 1 {
            let guard = Dropped(Arc::clone(&guard));
            let sheep = move |stop: &Stop| {
                patient(stop);
                drop(guard);
            };
            io.threads.spawn("sheep", sheep).unwrap();
            io.threads.spawn("mule", stubborn(&release)).unwrap();
        }
        Outcome::Ok
    });
    let mut stage = Stage::new(&["last"]);
    stage.step();
    let log = stage.log();
    let start = Instant::now();
    drop(stage);
    let took = start.elapsed();
    assert!(took >= HANG && took < HANG * 10, "{took:?}");
    assert_eq!(load(&ended), 1);
    let named: Vec<_> = lines(&log).into_iter().filter(|line| line.contains("has not ended")).collect();
    assert_eq!(named.len(), 1, "{named:?}");
    assert!(named[0].contains("the thread `mule` of last"), "{named:?}");
    released.store(true, Ordering::SeqCst);
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
fn threads_and_ticks_meet_at_synchronisation_points() {
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
