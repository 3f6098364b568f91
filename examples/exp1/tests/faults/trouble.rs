//! A module that stands between simulator and robot, and what it does wrong.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use slate::interfaces::{Echo, Orientation, Position, SonarScan};
use slate::prelude::*;

/// What stands between the simulator and the robot.
#[ports]
pub struct TroubleIo {
    position_in: Input<Position>,
    orientation_in: Input<Orientation>,
    sonar_in: Input<SonarScan>,
    position: Output<Position>,
    orientation: Output<Orientation>,
    sonar: Output<SonarScan>,
}

/// What goes wrong, and when.
#[params]
pub struct TroubleParams {
    #[param(default = 0, doc = "what goes wrong: see `Trouble`")]
    kind: u64,
    #[param(default = 2.0, unit = "s", doc = "when it begins")]
    from: f64,
    #[param(default = 4.0, unit = "s", doc = "when it ends")]
    until: f64,
    #[param(default = 0, doc = "hangs until the robot has stood in so many cycles")]
    stands: u64,
}

pub const NAN_POSITION: u64 = 1;
pub const NAN_ORIENTATION: u64 = 2;
pub const NAN_SONAR: u64 = 3;
pub const SILENT: u64 = 4;
pub const PANICKING: u64 = 5;
pub const HANGING: u64 = 6;
pub const SILENT_SONAR: u64 = 7;
pub const SILENT_POSITION: u64 = 8;
pub const SILENT_ORIENTATION: u64 = 9;

/// Passes on what the sensors say, until something goes wrong.
pub struct Trouble;

#[module(stage = SensorAcquire)]
impl Module for Trouble {
    type Io = TroubleIo;
    type Params = TroubleParams;
    type State = bool;

    fn tick(happened: &mut bool, io: &TroubleIo, params: &TroubleParams, now: &Tick) -> Outcome {
        let (mut position, mut orientation, mut scan) = (
            io.position_in.get().copied().unwrap_or_default(),
            io.orientation_in.get().copied().unwrap_or_default(),
            io.sonar_in.get().copied().unwrap_or_default(),
        );
        let kind = if (params.from..params.until).contains(&now.seconds()) { params.kind } else { 0 };
        match kind {
            NAN_POSITION => position.x = f64::NAN,
            NAN_ORIENTATION => orientation.theta = f64::NAN,
            NAN_SONAR => {
                let echo = Echo { range: f64::NAN, heard: true.into() };
                scan.echoes = Sequence::new(&[echo; 16]);
            }
            SILENT => return Outcome::Ok,
            PANICKING if now.number().is_multiple_of(40) => panic!("as the test wants"),
            PANICKING => return Outcome::Ok,
            HANGING if !std::mem::replace(happened, true) => hang(params.stands),
            _ => {}
        }
        if kind != SILENT_POSITION {
            io.position.set(position);
        }
        if kind != SILENT_ORIENTATION {
            io.orientation.set(orientation);
        }
        if kind != SILENT_SONAR {
            io.sonar.set(scan);
        }
        Outcome::Ok
    }
}

/// Cycles in which the robot has stood, in the run whose sensors hang on threads.
pub static STOOD: AtomicU64 = AtomicU64::new(0);

/// Cycles of that run.
pub static CYCLES: AtomicU64 = AtomicU64::new(0);

/// Cycles of that run while the sensors hung.
pub static HUNG: AtomicU64 = AtomicU64::new(0);

/// Hangs for 600 ms, and on until the robot has stood in so many cycles: a busy machine makes fewer of them in that time.
fn hang(stands: u64) {
    let begin = CYCLES.load(Ordering::Relaxed);
    std::thread::sleep(Duration::from_millis(600));
    for _ in 0..3000 {
        if STOOD.load(Ordering::Relaxed) >= stands {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    if stands > 0 {
        HUNG.store(CYCLES.load(Ordering::Relaxed) - begin, Ordering::Relaxed);
    }
}
