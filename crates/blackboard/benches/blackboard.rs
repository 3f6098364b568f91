//! Benchmarks of the blackboard, in nanoseconds per operation unless noted.
//!
//! Each line is the distribution over bursts of the mean of a burst. What two cores do together depends on how long a
//! cache line takes from one to the other, which is measured right before: a virtual machine may move its cores further
//! apart at any time. Values are written from memory that does not change, so no copy waits for stores of its source.
#![allow(clippy::disallowed_methods, reason = "a bench measures real time")]
#![allow(clippy::unwrap_used, reason = "a bench that can't go on ends")]
#![allow(unsafe_code, reason = "pinning a thread to a core is a call of the system")]

use std::hint::black_box;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Barrier};
use std::thread;
use std::time::{Duration, Instant};

use slate_blackboard::Shape;
use slate_blackboard::channel::{Budget, Channel, Latest, Policy, Start};
use slate_blackboard::message::Mailbox;
use slate_blackboard::wake::Wake;

const BURSTS: usize = 200;
const BURST: Duration = Duration::from_millis(5);

fn main() {
    pin_to(0);
    println!("{:<52}{:>10}{:>10}{:>10}{:>10}", "", "least", "p50", "p99", "most");
    one_core(64);
    one_core(4096);
    queue(1);
    queue(8);
    messages();
    waking();
    contended(64);
    contended(4096);
}

/// Keeps this thread on a core, if there is such a core.
fn pin_to(core: usize) {
    // SAFETY: an empty set is all zeros, and the calls get valid pointers to one of that size.
    unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        libc::CPU_SET(core, &mut set);
        libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &set);
    }
}

fn report(name: &str, mut bursts: Vec<f64>) -> f64 {
    bursts.sort_by(f64::total_cmp);
    let at = |share: f64| bursts[((bursts.len() - 1) as f64 * share) as usize];
    println!("{name:<52}{:>10.2}{:>10.2}{:>10.2}{:>10.2}", at(0.0), at(0.5), at(0.99), at(1.0));
    at(0.5)
}

/// Measures an operation in a burst of `count`; nanoseconds per operation.
fn time(count: usize, mut operation: impl FnMut(u64)) -> f64 {
    let start = Instant::now();
    for i in 0..count as u64 {
        operation(black_box(i));
    }
    start.elapsed().as_secs_f64() * 1e9 / count as f64
}

fn bursts(count: usize, mut operation: impl FnMut(u64)) -> Vec<f64> {
    time(count, &mut operation);
    (0..BURSTS).map(|_| time(count, &mut operation)).collect()
}

/// Runs `here` on core 0 and `there` on core 1.
fn together<T: Send + 'static>(there: impl FnOnce() -> T + Send + 'static, here: impl FnOnce()) -> T {
    let barrier = Arc::new(Barrier::new(2));
    let other = {
        let barrier = Arc::clone(&barrier);
        thread::spawn(move || {
            pin_to(1);
            barrier.wait();
            there()
        })
    };
    barrier.wait();
    here();
    other.join().unwrap()
}

fn line_transfer() -> f64 {
    const ROUNDS: u64 = 1000;
    #[repr(align(128))]
    struct Line(AtomicU64);
    let line = Arc::new(Line(AtomicU64::new(0)));
    let mut bursts = Vec::new();
    let rounds = ROUNDS * (BURSTS as u64 + 1);
    let other = Arc::clone(&line);
    let echo = move || {
        for round in 0..rounds {
            while other.0.load(Ordering::Acquire) != 2 * round + 1 {}
            other.0.store(2 * round + 2, Ordering::Release);
        }
    };
    together(echo, || {
        let mut round = 0;
        for _ in 0..=BURSTS {
            bursts.push(
                time(ROUNDS as usize, |_| {
                    line.0.store(2 * round + 1, Ordering::Release);
                    while line.0.load(Ordering::Acquire) != 2 * round + 2 {}
                    round += 1;
                }) / 2.0,
            );
        }
    });
    report("  a cache line from one core to the other", bursts.split_off(1))
}

/// Looks at the first and the last word.
#[inline]
fn touch(reader: &Latest) -> u64 {
    let Some(loan) = reader.value() else { return 0 };
    let bytes = loan.bytes();
    let word = |bytes: &[u8]| bytes.try_into().map_or(0, u64::from_ne_bytes);
    word(&bytes[..8]) ^ word(&bytes[bytes.len() - 8..])
}

fn one_core(size: usize) {
    let channel = Channel::new(Shape::fixed(size, 8), 1, Budget { latest: 4, queues: 0, window: 0 });
    let mut writer = channel.writer().unwrap();
    let value = vec![1; size];
    let mut write = |i: u64| {
        let _ = black_box(writer.write(black_box(&value), 0, i));
    };
    report(&format!("write {size} B, no reader"), bursts(10_000, &mut write));
    let mut readers = [(); 4].map(|()| channel.latest().unwrap());
    readers.iter_mut().for_each(|reader| assert!(reader.refresh()));
    report(&format!("write {size} B, 4 readers that hold a value"), bursts(10_000, &mut write));
    let reader = &mut readers[0];
    reader.refresh();
    let read = |reader: &mut Latest| {
        black_box(reader.refresh());
        black_box(touch(reader));
    };
    report(&format!("read {size} B, nothing new"), bursts(10_000, |_| read(reader)));
    let pair = bursts(10_000, |i| {
        write(i);
        read(reader);
    });
    report(&format!("write and read {size} B, always new"), pair);
}

fn queue(count: u16) {
    const BATCH: u16 = 64;
    let channel = Channel::new(
        Shape::fixed(64, 8),
        2 * usize::from(BATCH),
        Budget { latest: 0, queues: count, window: BATCH },
    );
    let mut writer = channel.writer().unwrap();
    let mut readers: Vec<_> = (0..count).map(|_| channel.queue(Policy::Skip, Start::Next).unwrap()).collect();
    let (mut pushes, mut pulls) = (Vec::new(), Vec::new());
    let value = [1; 64];
    for _ in 0..BURSTS {
        let (mut push, mut pull) = (0.0, 0.0);
        for _ in 0..20 {
            push += time(BATCH.into(), |i| {
                let _ = black_box(writer.write(black_box(&value), 0, i));
            }) / 20.0;
            let once = time(1, |_| {
                for reader in &mut readers {
                    assert_eq!(reader.pull(), Ok(BATCH.into()));
                    reader.window().for_each(|loan| {
                        black_box(loan.bytes()[0]);
                    });
                    reader.release();
                }
            });
            pull += once / (20.0 * f64::from(BATCH) * f64::from(count));
        }
        pushes.push(push);
        pulls.push(pull);
    }
    report(&format!("queue, {count} readers: push 64 B"), pushes);
    report(&format!("queue, {count} readers: pull, each value and reader"), pulls);
}

fn messages() {
    let mailbox = Mailbox::new(Shape::fixed(64, 8), 1, 4);
    let mut sender = mailbox.sender().unwrap();
    let mut receiver = mailbox.receiver().unwrap();
    let message = [1; 64];
    let both = bursts(10_000, |i| {
        let _ = black_box(sender.send(black_box(&message), 0, i));
        assert_eq!(receiver.collect(), 1);
        receiver.messages().for_each(|message| {
            black_box(message.bytes()[0]);
        });
    });
    report("message of 64 B, sent and collected", both);
    report("collect, no message", bursts(10_000, |_| assert_eq!(receiver.collect(), 0)));
}

fn waking() {
    let wake = Wake::new();
    report("notify, nobody sleeps", bursts(10_000, |_| wake.notify(1)));
}

/// Throughput of a writer and a reader on a core each, at full speed.
fn contended(size: usize) {
    println!("contended on two cores, {size} B:");
    let transfer = line_transfer();
    let channel = Channel::new(Shape::fixed(size, 8), 1, Budget { latest: 1, queues: 0, window: 0 });
    let (mut writes, mut fresh, mut calls) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..BURSTS / 2 {
        let mut writer = channel.writer().unwrap();
        let mut reader = channel.latest().unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let read = {
            let stop = Arc::clone(&stop);
            move || {
                let (mut fresh, mut calls) = (0_u32, 0_u32);
                let start = Instant::now();
                while !stop.load(Ordering::Relaxed) {
                    for _ in 0..16 {
                        fresh += u32::from(reader.refresh());
                        black_box(touch(&reader));
                        calls += 1;
                    }
                }
                let seconds = start.elapsed().as_secs_f64();
                (f64::from(fresh) / seconds, f64::from(calls) / seconds)
            }
        };
        let value = vec![1; size];
        let rates = together(read, || {
            let (start, mut count) = (Instant::now(), 0_u32);
            while start.elapsed() < BURST {
                for i in 0..64 {
                    let _ = black_box(writer.write(&value, 0, i));
                    count += 1;
                }
            }
            writes.push(f64::from(count) / start.elapsed().as_secs_f64());
            stop.store(true, Ordering::Relaxed);
        });
        fresh.push(rates.0);
        calls.push(rates.1);
    }
    let millions = |rates: &[f64]| rates.iter().map(|rate| rate / 1e6).collect();
    report("  writes, million per second", millions(&writes));
    report("  reads, million per second", millions(&calls));
    report("  fresh reads, million per second", millions(&fresh));
    let per_transfer = |rates: Vec<f64>| rates.into_iter().map(|rate| rate * transfer / 1e9).collect();
    report("  writes per line transfer", per_transfer(writes));
    report("  fresh reads per line transfer (0.4 is the target)", per_transfer(fresh));
}
