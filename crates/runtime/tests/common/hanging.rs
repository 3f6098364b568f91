//! A loop that hangs again and again, and how long others see what its actuator was commanded before.
//!
//! A command says at which moment it was made, by the machine's clock, which is the same in every process. `SLATE_HANGS` sets
//! how many hangs are looked at and `SLATE_BUSY` how many threads are busy beside; `--nocapture` shows what was measured.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_blackboard::Board;
use slate_module::prelude::*;
use slate_runtime::{Composer, Control, Mode, Options, Stopper};

use super::{Number, Pair, load};

/// How long a command holds, milliseconds.
pub const TIME_TO_LIVE: f64 = 40.0;

/// How much longer it may be seen, milliseconds.
pub const LATENESS: f64 = 20.0;

/// A loop that hangs for 150 ms in every tenth cycle.
pub const LOOP: &str = r#"
loop = { period = "5ms", hang = "3s" }
[modules.stumbler]
params = { every = 10, hang_ms = 150 }
[modules.driver]
[links]
"driver/input" = "stumbler/moment"
[actuators.wheel]
command = "driver/wheel"
time_to_live = "40ms"
"#;

/// The machine's clock, nanoseconds.
pub fn monotonic() -> u64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

#[ports]
pub struct StumblerIo {
    moment: Output<Number>,
}

#[params]
pub struct StumblerParams {
    #[param(default = 10, range = 1..=1000, doc = "hangs in every such tick")]
    every: u64,
    #[param(default = 0, doc = "milliseconds")]
    hang_ms: u64,
}

/// Says at which moment its tick ended, and hangs in some of them.
pub struct Stumbler;

#[module(stage = SensorAcquire)]
impl Module for Stumbler {
    type Io = StumblerIo;
    type Params = StumblerParams;
    type State = ();

    fn tick(_: &mut (), io: &StumblerIo, params: &StumblerParams, now: &Tick) -> Outcome {
        if now.number().is_multiple_of(params.every) {
            std::thread::sleep(Duration::from_millis(params.hang_ms));
        }
        io.moment.set(Number { value: monotonic() as f64 });
        Outcome::Ok
    }
}

#[ports]
pub struct WheelWitnessIo {
    wheel: Input<Number>,
    seen: Output<Pair>,
}

/// Reads an actuator on a thread of its own, and says how many commands ended and how old the oldest was that it saw,
/// milliseconds.
pub struct WheelWitness;

#[module(stage = ActExec, every = "1ms")]
impl Module for WheelWitness {
    type Io = WheelWitnessIo;
    type Params = ();
    type State = (bool, f64, f64);

    fn tick(state: &mut (bool, f64, f64), io: &WheelWitnessIo, _: &(), now: &Tick) -> Outcome {
        let (drove, ends, oldest) = state;
        let drives = io.wheel.get().is_some_and(|number| number.value != 0.0);
        if drives {
            *oldest = oldest.max(now.now().saturating_sub(io.wheel.stamp().time) as f64 / 1e6);
        } else if *drove {
            *ends += 1.0;
        }
        *drove = drives;
        io.seen.set(Pair { first: *ends, second: *oldest });
        Outcome::Ok
    }
}

/// How much longer than its time to live each command was seen that was not renewed, milliseconds; below zero when it was
/// seen last before its end.
#[derive(Default)]
pub struct Lags {
    command: f64,
    seen: u64,
    found: Vec<f64>,
}

impl Lags {
    /// Notes what was read, at that moment or later.
    pub fn see(&mut self, at: u64, command: f64) {
        if command != 0.0 {
            (self.command, self.seen) = (command, at);
        } else if self.command != 0.0 {
            self.found.push((self.seen as f64 - self.command) / 1e6 - TIME_TO_LIVE);
            self.command = 0.0;
        }
    }

    pub fn count(&self) -> usize {
        self.found.len()
    }

    /// Fails when half of them or more were seen for too long: a busy machine may delay some.
    pub fn check(mut self, who: &str) {
        self.found.sort_by(f64::total_cmp);
        let at = |part: f64| self.found[((self.found.len() - 1) as f64 * part) as usize];
        let (count, p50, p99, max) = (self.found.len(), at(0.5), at(0.99), at(1.0));
        println!(
            "{who}: safe after {p50:.1} ms (p50), {p99:.1} ms (p99), {max:.1} ms (max) of {count} hangs"
        );
        assert!(p50 < LATENESS, "{who}: {:?}", self.found);
    }
}

fn setting(name: &str, default: usize) -> usize {
    std::env::var(name).map_or(default, |text| text.parse().unwrap())
}

/// How many hangs are to be looked at.
pub fn hangs() -> usize {
    setting("SLATE_HANGS", 9)
}

/// An agent that runs until this is dropped, and what is busy beside it.
pub struct Hanging {
    pub board: Arc<Board>,
    pub composer: Composer,
    stopper: Stopper,
    ended: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Hanging {
    /// With modules and links beside those of the loop.
    pub fn start(modules: &str, links: &str, mode: Mode) -> Self {
        let options = Options { mode, armed: true, ..Options::default() };
        let text = LOOP.replace("[links]\n", &format!("{modules}\n[links]\n{links}\n"));
        let mut agent = load(&text, &[], options).unwrap();
        let (board, composer, stopper) = (Arc::clone(agent.board()), agent.composer(), agent.stopper());
        let ended = Arc::new(AtomicBool::new(false));
        let mut threads: Vec<_> = (0..setting("SLATE_BUSY", 0))
            .map(|_| {
                let ended = Arc::clone(&ended);
                std::thread::spawn(move || {
                    while !ended.load(Ordering::Relaxed) {
                        std::hint::spin_loop();
                    }
                })
            })
            .collect();
        threads.push(std::thread::spawn(move || {
            agent.run(Box::new(|_| Control::Continue)).unwrap();
        }));
        Self { board, composer, stopper, ended, threads }
    }

    /// Looks at a number until it satisfies; false when that takes far too long.
    pub fn until(&self, path: &str, mut satisfies: impl FnMut(u64, f64) -> bool) -> bool {
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_secs(120) {
            let at = monotonic();
            let value = self.board.read(path).unwrap().and_then(|(value, _)| value.as_f64());
            if satisfies(at, value.unwrap_or(0.0)) {
                return true;
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        false
    }
}

impl Drop for Hanging {
    fn drop(&mut self) {
        self.stopper.stop();
        self.ended.store(true, Ordering::Relaxed);
        self.threads.drain(..).for_each(|thread| drop(thread.join()));
    }
}

/// A module that reads the actuator on a thread of its own, here or in a process of its own, sees no command that has ended.
pub fn read_by_a_module(settings: &str, who: &str) {
    let modules = format!("[modules.wheel_witness]\n{settings}");
    let hanging = Hanging::start(&modules, "\"wheel_witness/wheel\" = \"wheel/command\"", Mode::Threaded);
    let enough = hanging.until("wheel_witness/seen/first", |_, ends| ends >= hangs() as f64);
    assert!(enough, "{who} did not see so many ends");
    let oldest = hanging.board.read("wheel_witness/seen/second").unwrap().unwrap().0.as_f64().unwrap();
    println!("{who}: the oldest command it saw was {oldest:.1} ms old");
    // By the reader's own time, so no load changes it.
    assert!(oldest <= TIME_TO_LIVE + LATENESS, "{who} saw a command that was {oldest} ms old");
    assert!(oldest > 0.0, "{who} saw commands");
}
