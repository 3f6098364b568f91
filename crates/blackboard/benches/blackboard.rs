//! What the blackboard costs: `cargo bench -p slate-blackboard`.
//!
//! Every figure is nanoseconds per operation over many bursts. Between cores nothing is faster than a cache line
//! travels, and where the host put the cores decides that, so this run's transfer is measured beside the rest.
#![allow(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
#![allow(clippy::unwrap_used, reason = "a benchmark ends at the first surprise")]
#![allow(unsafe_code, reason = "threads are bound to cores")]

use std::hint::{black_box, spin_loop};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Barrier, RwLock};
use std::thread;
use std::time::{Duration, Instant};

use slate_blackboard::channel::{Budget, Channel, Latest, Policy, Start};
use slate_blackboard::message::Mailbox;
use slate_blackboard::wake::Wake;
use slate_blackboard::{Shape, Stamp};

const SIZES: [usize; 3] = [64, 4096, 65_536];

/// Channels that are read one after the other, so that one look at the clock is spread over many fresh reads.
const FRESH: usize = 16;

fn main() {
    bind(0);
    println!("{:<58} {:>9} {:>9} {:>9}", "ns per operation", "p50", "p99", "max");
    for size in SIZES {
        for readers in [1, 8] {
            one_core(size, readers);
        }
        lock(size);
    }
    queue(1);
    queue(8);
    mailbox();
    wake();
    if thread::available_parallelism().is_ok_and(|cores| cores.get() > 1) {
        two_cores();
    } else {
        println!("one core only: nothing is contended");
    }
}

/// Runs the thread on that core from now on.
fn bind(core: usize) {
    // SAFETY: a zeroed set is empty, and the set outlives the call.
    let failed = unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        libc::CPU_SET(core, &mut set);
        libc::sched_setaffinity(0, size_of_val(&set), &set) != 0
    };
    if failed {
        println!("could not bind a thread to core {core}: figures between cores mean little");
    }
}

/// Nanoseconds per operation of many bursts.
struct Bursts(Vec<f64>);

impl Bursts {
    /// Times `count` bursts of `operations` each; `prepare` is not timed.
    fn prepared(count: usize, operations: usize, mut prepare: impl FnMut(), mut burst: impl FnMut()) -> Self {
        let mut times = Vec::with_capacity(count);
        for _ in 0..count + count / 10 {
            prepare();
            let start = Instant::now();
            burst();
            times.push(start.elapsed().as_nanos() as f64 / operations as f64);
        }
        // The first ones warm up.
        Self(times.split_off(count / 10))
    }

    /// Times `count` bursts of `operations` calls.
    fn of(count: usize, operations: usize, mut operation: impl FnMut()) -> Self {
        Self::prepared(count, operations, || {}, || (0..operations).for_each(|_| operation()))
    }

    fn quantile(&mut self, share: f64) -> f64 {
        self.0.sort_by(f64::total_cmp);
        self.0[((self.0.len() - 1) as f64 * share) as usize]
    }

    /// Prints a line, and gives the median.
    fn print(mut self, name: &str) -> f64 {
        let [median, late, last] = [0.5, 0.99, 1.0].map(|share| self.quantile(share));
        println!("{name:<58} {median:>9.1} {late:>9.1} {last:>9.0}");
        median
    }
}

/// Looks at the first and the last byte, as far as a reader does who copies nothing.
fn look(reader: &Latest) {
    let loan = reader.value().unwrap();
    let bytes = loan.bytes();
    black_box((bytes[0], bytes[bytes.len() - 1]));
}

fn budget(latest: u16) -> Budget {
    Budget { latest, queues: 0, window: 0 }
}

fn one_core(size: usize, readers: u16) {
    let bytes = vec![7_u8; size];
    let operations = if size > 4096 { 50 } else { 1000 };
    let name = |what: &str| format!("{size} B, {readers} readers: {what}");

    let channel = Channel::new(Shape::fixed(size, 8), 1, budget(readers));
    let mut writer = channel.writer().unwrap();
    let mut handles: Vec<_> = (0..readers).map(|_| channel.latest().unwrap()).collect();
    Bursts::prepared(
        500,
        operations,
        // Each reader holds another value, so the writer has to look further for a free slot.
        || (),
        || (0..operations).for_each(|_| drop(black_box(writer.write(black_box(&bytes), 0, 1)))),
    )
    .print(&name("write"));
    for reader in &mut handles {
        writer.write(&bytes, 0, 1).unwrap();
        reader.refresh();
    }
    Bursts::of(500, operations, || drop(black_box(writer.write(black_box(&bytes), 0, 1))))
        .print(&name("write while each holds another value"));
    handles.iter_mut().for_each(|reader| drop(reader.refresh()));
    let reader = &mut handles[0];
    Bursts::of(500, 1000, || {
        black_box(reader.refresh());
        look(reader);
    })
    .print(&name("read, nothing new"));

    let mut fresh: Vec<_> = (0..FRESH)
        .map(|_| {
            let channel = Channel::new(Shape::fixed(size, 8), 1, budget(readers));
            let handles: Vec<_> = (0..readers).map(|_| channel.latest().unwrap()).collect();
            (channel.writer().unwrap(), handles)
        })
        .collect();
    let fresh = std::cell::RefCell::new(&mut fresh);
    Bursts::prepared(
        2000,
        FRESH * usize::from(readers),
        || fresh.borrow_mut().iter_mut().for_each(|(writer, _)| drop(writer.write(&bytes, 0, 1))),
        || {
            for reader in fresh.borrow_mut().iter_mut().flat_map(|(_, handles)| handles) {
                assert!(reader.refresh());
                look(reader);
            }
        },
    )
    .print(&name("read, something new"));
}

/// The scheme of Fawkes: both sides copy under a readers-writer lock.
fn lock(size: usize) {
    let shared = RwLock::new(vec![0_u8; size]);
    let mut own = vec![7_u8; size];
    let operations = if size > 4096 { 50 } else { 1000 };
    Bursts::of(500, operations, || shared.write().unwrap().copy_from_slice(black_box(&own)))
        .print(&format!("{size} B, lock and copy: write"));
    Bursts::of(500, operations, || black_box(&mut own).copy_from_slice(&shared.read().unwrap()))
        .print(&format!("{size} B, lock and copy: read"));
}

fn queue(readers: u16) {
    const WINDOW: usize = 16;
    let budget = Budget { latest: 0, queues: readers, window: WINDOW as u16 };
    let channel = Channel::new(Shape::fixed(64, 8), 2 * WINDOW, budget);
    let mut writer = channel.writer().unwrap();
    let handles: Vec<_> = (0..readers).map(|_| channel.queue(Policy::Skip, Start::Oldest).unwrap()).collect();
    let handles = std::cell::RefCell::new(handles);
    let bytes = [7; 64];
    Bursts::prepared(
        2000,
        WINDOW,
        || {
            for reader in handles.borrow_mut().iter_mut() {
                reader.pull().unwrap();
            }
        },
        || (0..WINDOW).for_each(|_| drop(black_box(writer.write(black_box(&bytes), 0, 1)))),
    )
    .print(&format!("queue, 64 B, {readers} readers: push"));
    Bursts::prepared(
        2000,
        WINDOW * usize::from(readers),
        || (0..WINDOW).for_each(|_| drop(writer.write(&bytes, 0, 1))),
        || {
            for reader in handles.borrow_mut().iter_mut() {
                assert_eq!(reader.pull(), Ok(WINDOW));
                reader.window().for_each(|loan| drop(black_box(loan.bytes()[0])));
            }
        },
    )
    .print(&format!("queue, 64 B, {readers} readers: pull in windows of {WINDOW}"));
}

fn mailbox() {
    let mailbox = Mailbox::new(Shape::fixed(64, 8), 1, 16);
    let mut sender = mailbox.sender().unwrap();
    let mut receiver = mailbox.receiver().unwrap();
    let bytes = [7; 64];
    Bursts::of(1000, 1000, || {
        black_box(sender.send(black_box(&bytes), 0, 1)).unwrap();
        assert_eq!(receiver.collect(), 1);
        receiver.messages().for_each(|message| drop(black_box(message.bytes()[0])));
        receiver.release();
    })
    .print("message, 64 B: send and collect one");
    Bursts::of(1000, 100, || {
        (0..16).for_each(|_| drop(black_box(sender.send(black_box(&bytes), 0, 1))));
        assert_eq!(receiver.collect(), 16);
        receiver.release();
    })
    .print("message, 64 B: send and collect sixteen");
}

fn wake() {
    let wake = Wake::new();
    Bursts::of(1000, 1000, || wake.notify(black_box(1))).print("wake: notify, nobody sleeps");
    Bursts::of(1000, 1000, || {
        wake.notify(black_box(1));
        black_box(wake.wait());
    })
    .print("wake: notify and wait, nobody sleeps");
}

/// One value that goes back and forth between two cores.
fn transfer() -> Bursts {
    const ROUNDS: u64 = 2000;
    const BURSTS: usize = 220;
    let line = Arc::new(Line::default());
    let other = {
        let line = Arc::clone(&line);
        thread::spawn(move || {
            bind(1);
            for turn in (1..=BURSTS as u64 * ROUNDS).map(|round| 2 * round - 1) {
                while line.0.load(Ordering::Acquire) != turn {
                    spin_loop();
                }
                line.0.store(turn + 1, Ordering::Release);
            }
        })
    };
    let mut turn = 0;
    let bursts = Bursts::of(BURSTS - BURSTS / 11, 2 * ROUNDS as usize, {
        let line = Arc::clone(&line);
        let mut half = false;
        move || {
            // Two transfers make one round.
            half = !half;
            if half {
                line.0.store(turn + 1, Ordering::Release);
                turn += 2;
                while line.0.load(Ordering::Acquire) != turn {
                    spin_loop();
                }
            }
        }
    });
    other.join().unwrap();
    bursts
}

#[derive(Default)]
#[repr(align(128))]
struct Line(AtomicU64);

/// What two threads got done that write and read as fast as they can, and how long batches of writes took.
struct Contended {
    writes: f64,
    fresh: f64,
    bursts: Bursts,
}

/// Operations between two looks at the clock.
const BATCH: usize = 100;

/// `write` and `read` on two cores for a while; `read` gives the number of the value that it saw.
fn contend(mut write: impl FnMut(u64), mut read: impl FnMut() -> u64 + Send) -> Contended {
    let stop = AtomicBool::new(false);
    let ready = Barrier::new(2);
    let mut times = Vec::with_capacity(1 << 20);
    thread::scope(|scope| {
        let reader = scope.spawn(|| {
            bind(1);
            ready.wait();
            let (mut fresh, mut last) = (0_u64, 0);
            while !stop.load(Ordering::Relaxed) {
                let now = read();
                assert!(now >= last, "a value older than the one before");
                fresh += u64::from(now > last);
                last = now;
            }
            fresh
        });
        ready.wait();
        let start = Instant::now();
        let (mut number, mut before) = (0, start);
        while before - start < Duration::from_millis(50) {
            for _ in 0..BATCH {
                number += 1;
                write(number);
            }
            let now = Instant::now();
            times.push((now - before).as_nanos() as f64 / BATCH as f64);
            before = now;
        }
        stop.store(true, Ordering::Relaxed);
        let seconds = (before - start).as_secs_f64();
        let fresh = reader.join().unwrap() as f64;
        Contended { writes: number as f64 / seconds, fresh: fresh / seconds, bursts: Bursts(times) }
    })
}

fn register_contended(size: usize) -> Contended {
    let channel = Channel::new(Shape::fixed(size, 8), 1, budget(1));
    let mut writer = channel.writer().unwrap();
    let mut reader = channel.latest().unwrap();
    let mut bytes = vec![7; size];
    contend(
        |number| {
            bytes[..8].copy_from_slice(&number.to_ne_bytes());
            writer.write(&bytes, 0, number).map(|_: Stamp| ()).unwrap();
        },
        move || {
            reader.refresh();
            reader.value().map_or(0, |loan| number(loan.bytes()))
        },
    )
}

fn lock_contended(size: usize) -> Contended {
    let shared = Arc::new(RwLock::new(vec![0; size]));
    let mut bytes = vec![7; size];
    let mut own = vec![7; size];
    let writer = Arc::clone(&shared);
    contend(
        |number| {
            bytes[..8].copy_from_slice(&number.to_ne_bytes());
            writer.write().unwrap().copy_from_slice(&bytes);
        },
        move || {
            own.copy_from_slice(&shared.read().unwrap());
            number(&own)
        },
    )
}

fn number(bytes: &[u8]) -> u64 {
    u64::from_ne_bytes(bytes[..8].try_into().unwrap())
}

fn two_cores() {
    println!();
    wake_up();
    let mut measure = |name: &str, run: &dyn Fn() -> Contended| {
        // The transfer belongs to the moment: the host may move the cores.
        let mut runs: Vec<_> = (0..20)
            .map(|_| {
                let line = transfer().quantile(0.5);
                (line, run())
            })
            .collect();
        let mut median =
            |value: &dyn Fn(&(f64, Contended)) -> f64| Bursts(runs.iter().map(value).collect()).quantile(0.5);
        let line = median(&|(line, _)| *line);
        let writes = median(&|(_, run)| run.writes);
        let fresh = median(&|(_, run)| run.fresh);
        let per_line = median(&|(line, run)| run.fresh * line * 1e-9);
        let mut all =
            Bursts(runs.iter_mut().flat_map(|(_, run)| std::mem::take(&mut run.bursts.0)).collect());
        let [median, late, last] = [0.5, 0.99, 1.0].map(|share| all.quantile(share));
        println!(
            "{name:<26} {line:>9.1} {:>9.2} {:>9.2} {per_line:>9.3} {median:>9.1} {late:>9.1} {last:>9.0}",
            writes * 1e-6,
            fresh * 1e-6
        );
        fresh
    };
    println!(
        "\n{:<26} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}",
        "two cores, as fast as", "line", "writes", "fresh", "fresh", "write", "write", "write"
    );
    println!(
        "{:<26} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}",
        "both sides can", "ns", "10^6/s", "10^6/s", "per line", "p50 ns", "p99 ns", "max ns"
    );
    for size in SIZES {
        let own = measure(&format!("{size} B"), &|| register_contended(size));
        let lock = measure(&format!("{size} B, lock and copy"), &|| lock_contended(size));
        println!("{:<26} {:>29.1} times", "  fresh reads, ratio", own / lock);
    }
}

/// Threads that wake each other in turn, beside the same with the standard library's parking alone.
fn wake_up() {
    let words = [Arc::new(Wake::new()), Arc::new(Wake::new())];
    let [here, there] = words;
    let other = {
        let (here, there) = (Arc::clone(&here), Arc::clone(&there));
        thread::spawn(move || {
            bind(1);
            while there.wait() & 2 == 0 {
                here.notify(1);
            }
        })
    };
    Bursts::of(50, 100, || {
        there.notify(1);
        here.wait();
    })
    .print("wake: there and back, both asleep");
    there.notify(2);
    other.join().unwrap();

    let turn = Arc::new(AtomicU64::new(0));
    let main = thread::current();
    let other = {
        let turn = Arc::clone(&turn);
        thread::spawn(move || {
            bind(1);
            loop {
                match turn.load(Ordering::Acquire) {
                    1 => {
                        turn.store(0, Ordering::Release);
                        main.unpark();
                    }
                    2 => break,
                    _ => thread::park(),
                }
            }
        })
    };
    Bursts::of(50, 100, || {
        turn.store(1, Ordering::Release);
        other.thread().unpark();
        while turn.load(Ordering::Acquire) == 1 {
            thread::park();
        }
    })
    .print("park and unpark alone: there and back, both asleep");
    turn.store(2, Ordering::Release);
    other.thread().unpark();
    other.join().unwrap();
}
