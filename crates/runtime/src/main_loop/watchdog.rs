use std::sync::Arc;
use std::time::{Duration, Instant};

use slate_module::Level;

use super::{End, Seat, Shared, drive};

/// With so many threads lost at a time the run stops in order.
const LOST_LIMIT: usize = 4;

/// Sees steps that do not return, and moves the loop past them.
pub(crate) struct Watchdog {
    shared: Arc<Shared>,
    hang: Duration,
}

/// Modules, and whether they are on the loop.
pub(crate) type Watched = Arc<[(Arc<Seat>, bool)]>;

impl Watchdog {
    pub fn new(shared: Arc<Shared>, hang: Duration) -> Self {
        Self { shared, hang }
    }

    /// Watches until the run is over and no thread is in a step any more.
    #[allow(clippy::disallowed_methods, reason = "a hang is a matter of wall-clock time")]
    pub fn watch(self) {
        let mut seats = self.shared.watched();
        let mut since: Vec<Option<(u64, Instant)>> = vec![None; seats.len()];
        let interval = (self.hang / 4).clamp(Duration::from_millis(1), Duration::from_millis(50));
        while !self.shared.is_over_within(interval) {
            let now = self.shared.watched();
            if !Arc::ptr_eq(&now, &seats) {
                seats = now;
                since = vec![None; seats.len()];
            }
            for ((seat, on_loop), seen) in seats.iter().zip(&mut since) {
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
                self.give_up(seat, *on_loop);
            }
        }
    }

    fn give_up(&self, seat: &Seat, on_loop: bool) {
        let shared = &self.shared;
        let now = shared.clock.now();
        if !seat.give_up(now) {
            return;
        }
        let text = format!(
            "{} has not returned from its tick within {:?}; its outputs are safe values until it does",
            seat.name, self.hang
        );
        shared.logger.log(now, Level::Error, &text);
        if shared.lockstep {
            shared.finish(End::Hung { module: seat.name.to_string() });
        }
        let seats = shared.watched();
        let late = seats.iter().filter(|(seat, _)| seat.is_late());
        let modules: Vec<String> = late.map(|(seat, _)| seat.name.to_string()).collect();
        if modules.len() >= LOST_LIMIT {
            shared.finish(End::TooManyHung { modules });
        }
        // The token is with the late thread, unless a worker made the step for the loop.
        if on_loop && !seat.is_helped() {
            self.move_token();
        }
    }

    fn move_token(&self) {
        let shared = Arc::clone(&self.shared);
        let next = std::thread::Builder::new().name("main loop".into());
        if !self.shared.is_running() || next.spawn(move || drive(&shared)).is_err() {
            self.shared.finish(End::Stopped);
            self.shared.put_token_down();
        }
    }
}
