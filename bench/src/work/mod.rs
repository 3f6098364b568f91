//! Measured works, a file for each row of the table.

pub mod agents;
pub mod caterpillar;
pub mod iceoryx;
pub mod latest_value;
pub mod least;
pub mod modules;
pub mod network;
pub mod process;
pub mod queue;
pub mod record;
pub mod replay;
pub mod routes;
pub mod scale;
pub mod scripts;
pub mod sessions;
pub mod simulator;
pub mod wakeup;

use std::path::Path;
use std::thread;

use crate::measure::Effort;
use crate::table::Table;

/// Work with its name.
pub type Work = (&'static str, fn(Effort, &mut Table));

/// All that is measured, in the order of the report.
pub const ALL: [Work; 12] = [
    ("latest", latest_value::run),
    ("queue", queue::run),
    ("caterpillar", caterpillar::run),
    ("wakeup", wakeup::run),
    ("routes", routes::run),
    ("modules", modules::run),
    ("process", process::run),
    ("network", network::run),
    ("record", record::run),
    ("replay", replay::run),
    ("simulator", simulator::run),
    ("scale", scale::run),
];

/// A folder for what is written, in memory if the machine has a file system there.
fn folder() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    folder.expect("a folder for temporary files can be made")
}

fn large_stack() -> thread::Builder {
    thread::Builder::new().stack_size(64 << 20)
}

/// Does something in a thread whose stack has room for values of a megabyte.
fn with_large_stack(work: impl FnOnce() + Send) {
    thread::scope(|scope| {
        let thread = large_stack().spawn_scoped(scope, work).expect("a thread can be started");
        if let Err(panic) = thread.join() {
            std::panic::resume_unwind(panic);
        }
    });
}
