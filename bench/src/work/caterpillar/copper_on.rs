//! Copper's caterpillar with everything recorded, by its macro.

use std::path::Path;

use cu29::prelude::*;

use super::tasks::{First, Last, Segment};

#[copper_runtime(config = "copper/on.ron")]
struct Caterpillar {}

/// Starts the application; the result runs a cycle.
pub fn start(folder: &Path) -> CuResult<impl FnMut()> {
    let builder = Caterpillar::builder().with_log_path(folder.join(FILE), Some(LOG))?;
    let mut app = builder.build()?.start()?;
    Ok(move || app.run_one_iteration().expect("its tasks make no mistakes"))
}

/// Entry of a cycle in Copper's log.
pub type Cycle = default::CuList;

/// Its log.
pub const FILE: &str = "on.copper";

/// Bytes that the log grows by.
const LOG: usize = 64 << 20;
