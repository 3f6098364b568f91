//! The modules of these tests, beside the common ones.

use std::hint::black_box;
use std::time::Duration;

use slate_module::Plugin;
use slate_module::prelude::*;

use crate::common::{self, Number};

/// Something that a module can do to its process; see [`VillainParams`].
pub const FAULTS: [&str; 8] =
    ["", "segfault", "abort", "stack overflow", "exit", "endless loop", "out of memory", "panic"];

/// The number of a fault.
pub fn fault(name: &str) -> usize {
    FAULTS.iter().position(|fault| *fault == name).unwrap()
}

#[ports]
pub struct VillainIo {
    input: Input<Number>,
    #[safe(Number { value: -1.0 })]
    number: Output<Number>,
    wheel: Command<Number>,
}

#[params]
pub struct VillainParams {
    #[param(default = 0, doc = "what it does; 0 for nothing")]
    fault: u64,
    #[param(default = 0, doc = "in that tick of its life; 0 for never")]
    at: u64,
}

/// Counts its ticks, commands a wheel, and then misbehaves.
pub struct Villain;

#[module(stage = Think)]
impl Module for Villain {
    type Io = VillainIo;
    type Params = VillainParams;
    type State = f64;

    fn tick(state: &mut f64, io: &VillainIo, params: &VillainParams, now: &Tick) -> Outcome {
        *state += 1.0;
        now.info(format_args!("tick {} of this life", *state));
        if *state as u64 == params.at {
            commit(params.fault as usize);
        }
        io.number.set(Number { value: *state });
        io.wheel.send(
            Number { value: 1.0 + io.input.get().copied().unwrap_or_default().value * 0.0 },
            Priority::Plan,
        );
        Outcome::Ok
    }
}

/// Does it.
fn commit(fault: usize) {
    match FAULTS[fault] {
        "segfault" => {
            let nowhere = black_box(16) as *mut u64;
            // SAFETY: none; that is the point.
            unsafe { nowhere.write_volatile(1) }
        }
        "abort" => std::process::abort(),
        "stack overflow" => {
            black_box(deeper(black_box(1)));
        }
        "exit" => std::process::exit(0),
        "endless loop" => loop {
            std::thread::sleep(Duration::ZERO);
        },
        "out of memory" => {
            let mut all = Vec::new();
            loop {
                all.push(black_box(Vec::<u8>::with_capacity(1 << 20)));
            }
        }
        "panic" => panic!("as the test wants"),
        _ => {}
    }
}

#[allow(unconditional_recursion, reason = "it is to overflow")]
fn deeper(depth: u64) -> u64 {
    let frame = black_box([depth; 512]);
    deeper(depth + 1) + frame[depth as usize % 512]
}

#[ports]
pub struct PulseIo {
    beat: Output<Number>,
}

/// Counts its ticks.
pub struct Pulse;

#[module(stage = SensorAcquire)]
impl Module for Pulse {
    type Io = PulseIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &PulseIo, _: &(), _: &Tick) -> Outcome {
        *state += 1.0;
        io.beat.set(Number { value: *state });
        Outcome::Ok
    }
}

/// Numbers, as many as there are.
#[interface]
pub struct Series {
    /// The first one.
    pub first: f64,
    /// The others.
    pub rest: [f64],
}

#[ports]
pub struct PlotterIo {
    series: Output<Series>,
    traced: Debug<Number>,
}

/// Writes series of different lengths.
pub struct Plotter;

#[module(stage = SensorPrepare)]
impl Module for Plotter {
    type Io = PlotterIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &PlotterIo, _: &(), now: &Tick) -> Outcome {
        *state += 1.0;
        let length = now.random(|random| random.unit() * 700.0) as usize;
        let fits = io.series.write(length, |series| {
            series.first = *state;
            series.rest.iter_mut().enumerate().for_each(|(i, value)| *value = *state * i as f64);
        });
        io.traced.set(|| Number { value: length as f64 });
        if fits { Outcome::Ok } else { Outcome::Failed }
    }
}

#[ports]
pub struct AdderIo {
    series: Required<Series>,
    all: Queue<Series>,
    note: Outbox<Number>,
    sum: Output<Number>,
}

#[params]
pub struct AdderParams {
    #[param(default = 1.0, doc = "what the sum is multiplied by")]
    gain: f64,
}

/// Adds series up, and says in a message how long they were.
pub struct Adder;

#[module(stage = Think)]
impl Module for Adder {
    type Io = AdderIo;
    type Params = AdderParams;
    type State = f64;

    fn tick(state: &mut f64, io: &AdderIo, params: &AdderParams, _: &Tick) -> Outcome {
        let sum = |series: &Series| series.first + series.rest.iter().sum::<f64>();
        *state += sum(&io.series) * params.gain;
        for series in io.all.iter() {
            *state -= sum(&series) / 3.0;
            io.note.send(Number { value: series.rest.len() as f64 });
        }
        io.sum.set(Number { value: *state });
        if io.series.is_stale() { Outcome::Degraded } else { Outcome::Ok }
    }
}

#[ports]
pub struct ClerkIo {
    notes: Inbox<Number>,
    total: Output<Number>,
}

/// Adds messages up and refuses those that are odd.
pub struct Clerk;

#[module(stage = Act)]
impl Module for Clerk {
    type Io = ClerkIo;
    type Params = ();
    type State = f64;

    fn tick(state: &mut f64, io: &ClerkIo, _: &(), _: &Tick) -> Outcome {
        for note in io.notes.iter() {
            if note.value % 2.0 == 1.0 {
                note.refuse(7);
            } else {
                *state += note.value * note.stamp().sequence as f64;
            }
        }
        io.total.set(Number { value: *state });
        Outcome::Ok
    }
}

/// The state of [`Crasher`].
#[derive(serde::Serialize, serde::Deserialize)]
pub struct Never(u8);

impl Default for Never {
    fn default() -> Self {
        std::process::abort()
    }
}

/// Ends its process while it is set up.
pub struct Crasher;

#[module(stage = Think)]
impl Module for Crasher {
    type Io = ();
    type Params = ();
    type State = Never;

    fn tick(_: &mut Never, _: &(), _: &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

/// All of them.
pub fn plugins() -> Vec<Plugin> {
    let mut plugins = common::plugins();
    plugins.extend([
        Plugin::linked::<Villain>(),
        Plugin::linked::<Pulse>(),
        Plugin::linked::<Plotter>(),
        Plugin::linked::<Adder>(),
        Plugin::linked::<Clerk>(),
        Plugin::linked::<Crasher>(),
    ]);
    plugins
}
