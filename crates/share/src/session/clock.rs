use std::collections::VecDeque;

use super::wire::Beat;

/// Window of the estimate, number of exchanges.
const WINDOW_SIZE: usize = 16;

/// Estimator of the other agent's clock.
/// It uses the four times of each exchange of heartbeats; that with the shortest round trip has the smallest error.
#[derive(Debug, Default)]
pub(super) struct PeerClock {
    /// Offset and round trip of the last exchanges.
    exchanges: VecDeque<Estimate>,
    /// Last received heartbeat: time of sending, and time of arrival.
    last_beat: Option<(u64, u64)>,
}

/// Estimate of another agent's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Estimate {
    /// Offset of the other clock to this one, ns; error of half the round trip at most.
    pub offset: i64,
    /// Round-trip time of a packet, ns.
    pub round_trip: u64,
}

impl Estimate {
    /// Converts a time of the other clock to this clock.
    pub fn here(&self, time: u64) -> u64 {
        if self.offset >= 0 {
            time.saturating_sub(self.offset.unsigned_abs())
        } else {
            time.saturating_add(self.offset.unsigned_abs())
        }
    }
}

impl PeerClock {
    /// Returns the heartbeat to send.
    pub fn beat(&self, now: u64) -> Beat {
        Beat { sent: now, heard: self.last_beat }
    }

    pub fn receive(&mut self, now: u64, beat: Beat) {
        // One that was overtaken would only make the way longer.
        if self.last_beat.is_some_and(|(sent, _)| beat.sent <= sent) {
            return;
        }
        self.last_beat = Some((beat.sent, now));
        let Some((sent, received)) = beat.heard else { return };
        let (elapsed, turnaround) = (now.checked_sub(sent), beat.sent.checked_sub(received));
        let (Some(elapsed), Some(turnaround)) = (elapsed, turnaround) else { return };
        let Some(round_trip) = elapsed.checked_sub(turnaround) else { return };
        let outbound = i128::from(received) - i128::from(sent);
        let inbound = i128::from(beat.sent) - i128::from(now);
        let Ok(offset) = i64::try_from((outbound + inbound) / 2) else { return };
        if self.exchanges.len() == WINDOW_SIZE {
            self.exchanges.pop_front();
        }
        self.exchanges.push_back(Estimate { offset, round_trip });
    }

    /// Returns whether a heartbeat was received.
    pub fn has_received(&self) -> bool {
        self.last_beat.is_some()
    }

    /// Returns the best estimate; `None` before the first exchange.
    pub fn estimate(&self) -> Option<Estimate> {
        self.exchanges.iter().min_by_key(|estimate| estimate.round_trip).copied()
    }

    /// Returns whether there are enough exchanges to slow down the heartbeats.
    pub fn is_settled(&self) -> bool {
        self.exchanges.len() >= WINDOW_SIZE / 2
    }
}
