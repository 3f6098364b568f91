//! How threads end, and what becomes of a module with one that does not.

use super::*;

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
    let mut stage = Stage::threaded("[modules.periodic]\nkind = \"scripted\"\nevery = \"1ms\"\n");
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
fn a_thread_that_does_not_stop_keeps_only_its_own_module() {
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
    // The loop continues meanwhile, and requests a thread that must not begin now.
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
        "thread `mule` of module `stubborn` has not ended within 300ms after the stop request"
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
fn a_module_off_for_good_loses_its_threads_and_names_stuck_ones() {
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
    let named = "Error agent the thread `mule` of hopeless has not ended within 300ms after the stop request; it \
                 is abandoned, and its code stays in memory";
    eventually("it is named", || stage.lines().iter().any(|line| line == named));
    released.store(true, Ordering::SeqCst);
    eventually("the module can go", || stage.agent.composer().unload("scripted").is_ok());
}

#[test]
fn the_end_of_the_agent_ends_all_threads_and_names_stuck_ones() {
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
