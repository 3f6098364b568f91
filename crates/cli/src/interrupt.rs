//! Ctrl-C and the other signals that end a command.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Signals that follow each other within this time count as one.
///
/// Programs such as `timeout` signal a process and its process group. A person who wants to kill has waited for longer.
pub const DEBOUNCE: Duration = Duration::from_millis(300);

/// Whether Ctrl-C was pressed.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Makes the first Ctrl-C set [`is_interrupted`], and the second one end the process.
pub fn catch() {
    // Without a handler, Ctrl-C ends the process at once.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
}

/// Whether Ctrl-C was pressed since [`catch`].
pub fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}
