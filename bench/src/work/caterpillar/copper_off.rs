//! Copper's caterpillar with nothing recorded: its macro makes the run time of it.

use std::path::Path;

use cu29::prelude::*;

use super::tasks::{First, Last, Segment};

#[copper_runtime(config = "copper/off.ron")]
struct Caterpillar {}

/// Starts the application; the result runs a cycle.
pub fn start(folder: &Path) -> CuResult<impl FnMut()> {
    let builder = Caterpillar::builder().with_log_path(folder.join("off.copper"), Some(LOG))?;
    let mut app = builder.build()?.start()?;
    Ok(move || app.run_one_iteration().expect("its tasks make no mistakes"))
}

/// Bytes that the log grows by.
const LOG: usize = 64 << 20;
