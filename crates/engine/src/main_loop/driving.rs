//! The threads that have the loop: one at a time, and spare ones for when a step does not return.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::{End, Flow, SharedLoop, cycle};

/// Drives the loop until the run ends. When a step that this thread made was given up, another thread has the loop, and
/// this one waits for it to be lost in turn.
pub fn drive(shared: &SharedLoop) {
    let cycles = || {
        while shared.run.is_running() {
            match cycle(shared) {
                Flow::Next => shared.change_here(),
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
                shared.run.keep_panic(panic);
                break;
            }
        }
    }
    shared.run.finish(End::Stopped);
    shared.put_token_down();
}
