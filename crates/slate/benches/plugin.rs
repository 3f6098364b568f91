//! Benchmark of a tick's overhead when its module is in a shared library.
//! `cargo bench -p slate-robotics --bench plugin`
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    unsafe_code,
    clippy::let_unit_value,
    reason = "a benchmark makes the host's calls by hand and reads the clock"
)]

use std::cell::Cell;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use slate::interfaces::Position;
use slate::mapek::MonitorBlock;
use slate::module::blackboard::Stamp;
use slate::module::{
    Direction, Frame, Host, Interface, Module, ModuleKind, PortCursor, PortSlot, Random, Setup, Tick,
};
use slate_wheeled::monitors::PositionMonitor;

/// Called module: it reads a position and writes it.
type Called = MonitorBlock<PositionMonitor>;

const CALLS: u32 = 1000;
const ROUNDS: usize = 5000;

fn main() {
    // Under `cargo test` benches are only built and started.
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let built = Command::new(env!("CARGO"))
        .args(["build", "--release", "-p", "slate-wheeled"])
        .current_dir(&root)
        .status();
    assert!(built.unwrap().success(), "the library is built");
    let library = root.join("target/release/libslate_wheeled.so");
    let (plugin, ..) = slate::runtime::plugin::load(&library).unwrap();
    let loaded = plugin.kinds().iter().find(|kind| kind.name() == Called::NAME).unwrap();
    let linked = ModuleKind::linked::<Called>();

    let (mut read, mut written) = (Position::default(), Position::default());
    let slots =
        [slot(Direction::Input, (&raw mut read).cast()), slot(Direction::Output, (&raw mut written).cast())];
    let random = Cell::new(Random::new(0, "bench"));
    let host = Host { context: std::ptr::null(), log: silent };
    let params = [0_u8; 16];
    let frame = Frame {
        ports: slots.as_ptr(),
        port_count: slots.len(),
        params: params.as_ptr(),
        params_size: 0,
        params_version: 0,
        now: 0,
        elapsed: 0,
        number: 1,
        random: &raw const random,
        host: &raw const host,
    };

    let setup = Setup { name: "monitor", seed: 0, period: 20_000_000, section: None, params: None };
    let mut state = Called::create(&setup, &()).unwrap();
    // SAFETY: the frame was filled for this module.
    let fixed = measured(|| unsafe {
        let tick = Tick::new(&frame);
        PortCursor::new(&frame).with(|io| Called::tick(&mut state, io, &(), &tick)) as i32
    });
    let by_table = |kind: &ModuleKind| {
        let instance = kind.create(&setup, &[]).unwrap();
        let call = kind.table().tick;
        // SAFETY: as above, and the instance is of this kind.
        let time = measured(|| unsafe { call(instance, &raw const frame) });
        // SAFETY: it is unused.
        unsafe { kind.destroy(instance) }.unwrap();
        time
    };
    let (linked, loaded) = (by_table(&linked), by_table(loaded));
    println!("a tick, called in place          {fixed:6.2} ns");
    println!("by the table, linked in          {linked:6.2} ns  ({:+.2})", linked - fixed);
    println!("by the table, in a library       {loaded:6.2} ns  ({:+.2})", loaded - fixed);
}

/// Returns the median of a call's time, ns.
fn measured(mut call: impl FnMut() -> i32) -> f64 {
    let mut times: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let start = Instant::now();
            for _ in 0..CALLS {
                black_box(call());
            }
            start.elapsed().as_nanos() as f64 / f64::from(CALLS)
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[ROUNDS / 2]
}

fn slot(direction: Direction, data: *mut u8) -> PortSlot {
    PortSlot {
        schema: Position::DESCRIPTOR.hash,
        data,
        items: Cell::new(0),
        capacity: 0,
        stamp: Stamp { sequence: 1, time: 0, generation: 1 },
        flags: Cell::new(0),
        direction: direction as u32,
        priority: Cell::new(0),
        entries: std::ptr::null(),
        count: Cell::new(0),
        missed: 0,
    }
}

unsafe extern "C" fn silent(_: *const (), _: u32, _: *const u8, _: usize) {}
