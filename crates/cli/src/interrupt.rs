//! Ctrl-C and the other signals that end a command.

use std::sync::atomic::{AtomicBool, Ordering};

pub use slate_run::DEBOUNCE;

/// Ctrl-C flag.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Installs the Ctrl-C handler.
/// The first Ctrl-C sets [`is_interrupted`], the second one ends the process.
pub fn catch() {
    // Without a handler, Ctrl-C ends the process at once.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
}

/// Returns whether Ctrl-C was pressed since [`catch`].
pub fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}
