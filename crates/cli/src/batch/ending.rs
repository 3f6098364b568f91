//! Early end of a batch.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use slate::runtime::Stopper;
use slate_sorted::SortedMap;

use crate::clock::now;
use crate::interrupt::DEBOUNCE;

/// Stops the runs that are under way, and lets none begin.
#[derive(Default)]
pub struct BatchEnding {
    interrupted: AtomicBool,
    runs: Mutex<Runs>,
}

#[derive(Default)]
struct Runs {
    ended: bool,
    /// Stoppers of the runs, by seed.
    stoppers: SortedMap<u64, Stopper>,
}

impl BatchEnding {
    /// Creates the end on request.
    /// The first Ctrl-C requests it; the second one ends the process.
    pub fn on_interrupt() -> Arc<Self> {
        let ending = Arc::new(Self::default());
        let handler = Arc::clone(&ending);
        let mut first: Option<Instant> = None;
        let handled = ctrlc::set_handler(move || match first {
            Some(first) if first.elapsed() < DEBOUNCE => {}
            Some(_) => std::process::exit(130),
            None => {
                first = Some(now());
                handler.interrupted.store(true, Ordering::Release);
                handler.end();
            }
        });
        if let Err(error) = handled {
            eprintln!("Ctrl-C will end the batch without its figures: {error}");
        }
        ending
    }

    /// Returns whether a person requested the end.
    pub fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Acquire)
    }

    /// Returns whether no more runs may begin.
    pub fn is_ended(&self) -> bool {
        self.runs().ended
    }

    /// Stops the runs in progress.
    pub fn end(&self) {
        let mut runs = self.runs();
        runs.ended = true;
        runs.stoppers.values().for_each(Stopper::stop);
    }

    /// Stops this run too when the end comes, or at once when it has come.
    pub fn add(&self, seed: u64, stopper: Stopper) {
        let mut runs = self.runs();
        if runs.ended {
            stopper.stop();
        }
        runs.stoppers.insert(seed, stopper);
    }

    /// Forgets a run that is over by itself.
    pub fn remove(&self, seed: u64) {
        self.runs().stoppers.remove(&seed);
    }

    fn runs(&self) -> MutexGuard<'_, Runs> {
        // A thread that panicked leaves the list as it was.
        self.runs.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
