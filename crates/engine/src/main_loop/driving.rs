//! Threads that drive the loop: one at a time, and spare ones for a late step.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::{End, Flow, SharedLoop, cycle};

/// Drives the loop until the run ends.
/// When a step of this thread was given up, another thread has the loop, and this one waits as a spare until that is
/// lost in turn.
pub fn drive(shared: &SharedLoop) {
    let cycles = || {
        while shared.run.is_running() {
            match cycle(shared) {
                Flow::Next => shared.apply_changes_with_token(),
                Flow::Stop => break,
                Flow::Lost => return false,
            }
        }
        true
    };
    loop {
        match catch_unwind(AssertUnwindSafe(cycles)) {
            Ok(true) => break,
            Ok(false) if shared.run.wait_for_token() => {}
            Ok(false) => return,
            // The application's observer; modules don't let a panic out.
            Err(panic) => {
                shared.run.store_panic(panic);
                break;
            }
        }
    }
    shared.run.finish(End::Stopped);
    shared.release_token_at_end();
}
