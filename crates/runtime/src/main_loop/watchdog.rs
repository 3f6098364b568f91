use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use slate_module::Level;

use super::{End, Seat, Shared, drive};

/// After that many lost threads the run stops in order.
const LOST_LIMIT: usize = 4;

/// Sees steps that do not return, and moves the loop past them.
pub(crate) struct Watchdog {
    shared: Arc<Shared>,
    /// Modules on the loop, and whether losing one loses the loop's thread.
    seats: Vec<(Arc<Seat>, bool)>,
    hang: Duration,
}

impl Watchdog {
    pub fn new(shared: Arc<Shared>, seats: Vec<(Arc<Seat>, bool)>, hang: Duration) -> Self {
        Self { shared, seats, hang }
    }

    /// Watches until the run ends.
    #[allow(clippy::disallowed_methods, reason = "a hang is a matter of wall-clock time")]
    pub fn watch(self) {
        let mut since: Vec<Option<(u64, Instant)>> = vec![None; self.seats.len()];
        let mut lost: Vec<String> = Vec::new();
        let interval = (self.hang / 4).clamp(Duration::from_millis(1), Duration::from_millis(50));
        while !self.shared.stop.load(Ordering::Acquire) {
            std::thread::sleep(interval);
            for ((seat, on_loop), seen) in self.seats.iter().zip(&mut since) {
                let Some(step) = seat.running() else {
                    *seen = None;
                    continue;
                };
                match seen {
                    Some((number, start)) if *number == step => {
                        if start.elapsed() < self.hang {
                            continue;
                        }
                    }
                    _ => {
                        *seen = Some((step, Instant::now()));
                        continue;
                    }
                }
                *seen = None;
                let now = self.shared.clock.now();
                if !seat.give_up(now) {
                    continue;
                }
                let text = format!(
                    "{} has not returned from its tick within {:?}; its outputs are safe values until it does",
                    seat.name, self.hang
                );
                self.shared.logger.log(now, Level::Error, &text);
                lost.push(seat.name.to_string());
                if self.shared.lockstep {
                    return self.shared.finish(End::Hung { module: seat.name.to_string() });
                }
                if lost.len() >= LOST_LIMIT {
                    return self.shared.finish(End::TooManyHung { modules: lost });
                }
                if *on_loop {
                    self.move_token();
                }
            }
        }
    }

    fn move_token(&self) {
        let shared = Arc::clone(&self.shared);
        let started = std::thread::Builder::new().name("main loop".into()).spawn(move || drive(&shared));
        if started.is_err() {
            self.shared.finish(End::Stopped);
        }
    }
}
