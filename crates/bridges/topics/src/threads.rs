//! End and the wake-up of a bridge's threads.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_blackboard::wake::Wake;

/// Time that the end of a bridge waits for its threads and for the other ends.
pub const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(2);

/// Waits for threads that were told to end.
/// A thread that waits for a cycle which does not end is left alone.
#[allow(clippy::disallowed_methods, reason = "threads end by the machine's clock")]
pub fn join_threads(threads: &mut Vec<JoinHandle<()>>) {
    let began = Instant::now();
    for thread in threads.drain(..) {
        while !thread.is_finished() && began.elapsed() < SHUTDOWN_TIMEOUT {
            std::thread::sleep(Duration::from_millis(2));
        }
        if thread.is_finished() {
            // One that panicked has ended, too.
            let _ = thread.join();
        }
    }
}

/// Wakes the thread that receives.
#[derive(Debug)]
pub struct ReaderWaker(pub Arc<Wake>);

impl std::task::Wake for ReaderWaker {
    fn wake(self: Arc<Self>) {
        self.0.notify(1);
    }
}
