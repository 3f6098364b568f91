//! Ctrl-C and the other signals that end a command.

use std::sync::atomic::{AtomicBool, Ordering};

pub use slate_run::DEBOUNCE;

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
