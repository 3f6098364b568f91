//! Ctrl-C in a run, and the stay after the mission's end.
//! The run stays while a browser shows it, or until it is interrupted.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use slate_runtime::Stopper;

use crate::clock::now;
use crate::console::RunConsole;

/// Signals that follow each other within this time count as one.
///
/// Programs such as `timeout` signal a process and its process group at the same time; a second Ctrl-C of a person comes later.
pub const DEBOUNCE: Duration = Duration::from_millis(300);

/// Polling period for browsers.
const CHECK_PERIOD: Duration = Duration::from_millis(200);

/// Time without a connected browser after which the run ends.
/// A page that is reloaded is away for less.
const DISCONNECT_TIMEOUT: Duration = Duration::from_secs(3);

/// Interrupt flag of a run, set by a person.
/// Clones are handles of the same flag.
#[derive(Clone, Default)]
pub struct Interrupt(Arc<(Mutex<bool>, Condvar)>);

impl Interrupt {
    /// Installs the handler of Ctrl-C.
    /// The first Ctrl-C ends the run with its report, the second one the process. `end_later` of a supervised run ends
    /// the process if it still runs some time later.
    pub fn handle(stopper: Stopper, end_later: Option<fn()>) -> Self {
        let interrupt = Self::default();
        let own = interrupt.clone();
        let mut requested_at: Option<Instant> = None;
        let handled = ctrlc::set_handler(move || {
            match requested_at {
                // The end of each thread of the supervisor may be another signal; its second Ctrl-C is not caught.
                Some(_) if end_later.is_some() => {}
                Some(first) if first.elapsed() < DEBOUNCE => {}
                Some(_) => std::process::exit(130),
                None => {
                    requested_at = Some(now());
                    own.set();
                    stopper.stop();
                    if let Some(end_later) = end_later {
                        // The supervisor may have ended, and then nothing else ends a hanging process.
                        end_later();
                    }
                }
            }
        });
        if let Err(error) = handled {
            eprintln!("Ctrl-C will end the run without a report: {error}");
        }
        interrupt
    }

    fn state(&self) -> MutexGuard<'_, bool> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set(&self) {
        *self.state() = true;
        self.0.1.notify_all();
    }

    /// Returns whether the run was interrupted.
    pub fn is_set(&self) -> bool {
        *self.state()
    }

    /// Waits for an interrupt, at most for a duration; returns whether it came.
    fn wait(&self, duration: Duration) -> bool {
        let waited = self.0.1.wait_timeout_while(self.state(), duration, |is_set| !*is_set);
        *waited.unwrap_or_else(PoisonError::into_inner).0
    }
}

/// Stays after the end of a mission while a browser is connected.
/// If the user `wishes` it, until an interrupt.
pub fn stay(interrupt: &Interrupt, console: Option<&RunConsole>, wishes: bool) {
    let has_browser = || console.is_some_and(RunConsole::has_browser);
    if interrupt.is_set() || !(wishes || has_browser()) {
        return;
    }
    let link = console.map(|console| format!(" at {}", console.link())).unwrap_or_default();
    let until = if wishes { "until Ctrl-C" } else { "while its browser is connected, or until Ctrl-C" };
    eprintln!("the run is over; the agent stays{link} {until}");
    let mut seen = now();
    while !interrupt.wait(CHECK_PERIOD) {
        if wishes || has_browser() {
            seen = now();
        } else if seen.elapsed() >= DISCONNECT_TIMEOUT {
            return;
        }
    }
}
