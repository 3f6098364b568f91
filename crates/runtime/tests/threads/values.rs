//! Values on their way between a tick and the threads of its module.

use super::*;

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
fn a_tick_sees_earlier_messages_and_its_own_go_out_after_it() {
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
                assert!(spawn(wrong).unwrap_err().contains("is not a name of a thread"));
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
fn requests_of_failed_tick_have_no_effect() {
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
