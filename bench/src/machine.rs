//! Machine of this run and its present speed, beside which figures are read.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::measure::{Contest, Effort, Samples, consume};
use crate::table::{Role, Table};

/// Describes the machine, as the first lines of a report.
pub fn describe() -> Vec<String> {
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let system = read("/proc/sys/kernel/osrelease");
    vec![
        format!("Measured on {}.", date()),
        format!("Processor: {}, {cores} cores for this run; Linux {system}; {}.", processor(), compiler()),
        format!("Load average at the start: {}.", read("/proc/loadavg")),
    ]
}

/// Returns date and load, as the provenance of a figure.
pub fn provenance() -> String {
    let load = read("/proc/loadavg");
    format!("measured here, {}, load {}", date(), load.split(' ').next().unwrap_or_default())
}

fn read(path: &str) -> String {
    std::fs::read_to_string(path).unwrap_or_default().trim().to_owned()
}

fn processor() -> String {
    let text = read("/proc/cpuinfo");
    let model = text.lines().find_map(|line| line.strip_prefix("model name")?.split(": ").nth(1));
    model.unwrap_or("unknown").to_owned()
}

/// The compiler that this was built with.
fn compiler() -> &'static str {
    env!("RUSTC_VERSION")
}

/// The time of day in UTC, to the minute.
fn date() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs() as libc::time_t;
    // SAFETY: both live during the call, and a time of zeros is one.
    let time = unsafe {
        let mut time: libc::tm = std::mem::zeroed();
        libc::gmtime_r(&raw const seconds, &raw mut time);
        time
    };
    let (year, month) = (time.tm_year + 1900, time.tm_mon + 1);
    format!("{year}-{month:02}-{:02} {:02}:{:02} UTC", time.tm_mday, time.tm_hour, time.tm_min)
}

/// Keeps this thread on a core, if there is such a core.
pub fn pin(core: usize) {
    cores(&[core]);
}

/// Lets this thread run anywhere.
pub fn unpin() {
    cores(&(0..64).collect::<Vec<_>>());
}

fn cores(chosen: &[usize]) {
    // SAFETY: an empty set is all zeros, and the calls get valid pointers to one of that size.
    unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        chosen.iter().for_each(|core| libc::CPU_SET(*core, &mut set));
        libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set);
    }
}

/// Sets or clears real-time priority of this thread and its children.
/// Returns false if the system does not allow it.
pub fn set_real_time(priority: i32) -> bool {
    let parameters = libc::sched_param { sched_priority: priority };
    let policy = if priority > 0 { libc::SCHED_FIFO } else { libc::SCHED_OTHER };
    // SAFETY: the parameters live during the call.
    unsafe { libc::sched_setscheduler(0, policy, &raw const parameters) == 0 }
}

/// Nanoseconds of a clock that all processes see.
pub fn now() -> u64 {
    // SAFETY: the time lives during the call.
    unsafe {
        let mut time: libc::timespec = std::mem::zeroed();
        libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut time);
        time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
    }
}

/// Seconds of the processor that a process has used.
pub fn processor_time(process: u32) -> f64 {
    // SAFETY: the clock's number and the time live during the calls.
    unsafe {
        let mut clock: libc::clockid_t = 0;
        let mut time: libc::timespec = std::mem::zeroed();
        if libc::clock_getcpuclockid(process as libc::pid_t, &raw mut clock) == 0 {
            libc::clock_gettime(clock, &raw mut time);
        }
        time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
    }
}

/// Sleeps while the word is that number.
pub fn futex_wait(word: &AtomicU32, expected: u32) {
    let none = std::ptr::null::<libc::timespec>();
    let operation = libc::FUTEX_WAIT | libc::FUTEX_PRIVATE_FLAG;
    // SAFETY: the word lives during the call.
    unsafe { libc::syscall(libc::SYS_futex, word.as_ptr(), operation, expected, none) };
}

/// Wakes the thread that sleeps there.
pub fn futex_wake(word: &AtomicU32) {
    let operation = libc::FUTEX_WAKE | libc::FUTEX_PRIVATE_FLAG;
    // SAFETY: the word lives during the call.
    unsafe { libc::syscall(libc::SYS_futex, word.as_ptr(), operation, 1) };
}

/// Measures what the machine can do now.
pub fn measure(effort: Effort, table: &mut Table) {
    const WORK: &str = "machine";
    let mut single = |line: &str, round: &mut dyn FnMut(&mut Samples)| {
        let mut contest = Contest::new(WORK, line);
        contest.with("this machine", Role::Floor, round);
        contest.run(effort, table);
    };
    pin(0);
    let bursts = effort.count(1000);
    single("reading the clock", &mut |samples| {
        (0..bursts).for_each(|_| samples.burst(100, |_| consume(Instant::now())));
    });
    for size in [64, 4096, 1 << 20] {
        let (source, mut target) = (vec![1_u8; size], vec![0_u8; size]);
        let count = (1 << 16 >> size.ilog2()).max(1);
        single(&format!("memcpy of {size} B"), &mut |samples| {
            for _ in 0..bursts {
                samples.burst(count, |_| target.copy_from_slice(std::hint::black_box(&source)));
                std::hint::black_box(&mut target);
            }
        });
    }
    single("a cache line from one core to the other", &mut |samples| line_transfer(bursts, samples));
    single("a thread on another core, woken by a futex", &mut |samples| futex(effort.count(1000), samples));
    unpin();
}

#[repr(align(128))]
struct Line(AtomicU64);

fn line_transfer(bursts: usize, samples: &mut Samples) {
    const BURST: u64 = 100;
    let line = Arc::new(Line(AtomicU64::new(0)));
    let other = Arc::clone(&line);
    let rounds = BURST * bursts as u64;
    let echo = thread::spawn(move || {
        pin(1);
        for round in 0..rounds {
            while other.0.load(Ordering::Acquire) != 2 * round + 1 {}
            other.0.store(2 * round + 2, Ordering::Release);
        }
    });
    let mut round = 0;
    for _ in 0..bursts {
        let start = Instant::now();
        for _ in 0..BURST {
            line.0.store(2 * round + 1, Ordering::Release);
            while line.0.load(Ordering::Acquire) != 2 * round + 2 {}
            round += 1;
        }
        // There and back.
        samples.add_mean(start.elapsed(), 2 * BURST as u32);
    }
    let _ = echo.join();
}

fn futex(rounds: usize, samples: &mut Samples) {
    let (word, woken) = (Arc::new(AtomicU32::new(0)), Arc::new(AtomicU64::new(0)));
    let (slept, noted) = (Arc::clone(&word), Arc::clone(&woken));
    let sleeper = thread::spawn(move || {
        pin(1);
        for round in 0..rounds as u32 {
            while slept.load(Ordering::Acquire) == round {
                futex_wait(&slept, round);
            }
            noted.store(now(), Ordering::Release);
        }
    });
    for _ in 0..rounds {
        thread::sleep(Duration::from_micros(300));
        woken.store(0, Ordering::Release);
        let start = now();
        word.fetch_add(1, Ordering::Release);
        futex_wake(&word);
        while woken.load(Ordering::Acquire) == 0 {
            std::hint::spin_loop();
        }
        samples.add(woken.load(Ordering::Acquire).saturating_sub(start));
    }
    let _ = sleeper.join();
}
