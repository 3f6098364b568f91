use std::collections::VecDeque;

use super::wire::Beat;

/// How many beats the estimate looks back.
const WINDOW: usize = 16;

/// What is known of the other agent's clock: from four times of each exchange of beats, of which the one with the
/// shortest way there and back errs least.
#[derive(Debug, Default)]
pub(super) struct PeerClock {
    /// Offset and round trip of the last exchanges.
    exchanges: VecDeque<Estimate>,
    /// The last beat that came: when it was sent, and when it came.
    heard: Option<(u64, u64)>,
}

/// How the clock of another agent differs from this one's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Estimate {
    /// What the other clock shows more than this one, nanoseconds. Off by half of the round trip at most.
    pub offset: i64,
    /// How long a packet takes there and back, nanoseconds.
    pub round_trip: u64,
}

impl Estimate {
    /// The time of this clock at which the other one showed `time`.
    pub fn here(&self, time: u64) -> u64 {
        if self.offset >= 0 {
            time.saturating_sub(self.offset.unsigned_abs())
        } else {
            time.saturating_add(self.offset.unsigned_abs())
        }
    }
}

impl PeerClock {
    /// The beat to be sent.
    pub fn beat(&self, now: u64) -> Beat {
        Beat { sent: now, heard: self.heard }
    }

    pub fn receive(&mut self, now: u64, beat: Beat) {
        // One that was overtaken would only make the way longer.
        if self.heard.is_some_and(|(sent, _)| beat.sent <= sent) {
            return;
        }
        self.heard = Some((beat.sent, now));
        let Some((sent, came)) = beat.heard else { return };
        let (way, rest) = (now.checked_sub(sent), beat.sent.checked_sub(came));
        let (Some(way), Some(rest)) = (way, rest) else { return };
        let Some(round_trip) = way.checked_sub(rest) else { return };
        let there = i128::from(came) - i128::from(sent);
        let back = i128::from(beat.sent) - i128::from(now);
        let Ok(offset) = i64::try_from((there + back) / 2) else { return };
        if self.exchanges.len() == WINDOW {
            self.exchanges.pop_front();
        }
        self.exchanges.push_back(Estimate { offset, round_trip });
    }

    /// Whether a beat came.
    pub fn is_heard(&self) -> bool {
        self.heard.is_some()
    }

    /// The best estimate; nothing before the first exchange.
    pub fn estimate(&self) -> Option<Estimate> {
        self.exchanges.iter().min_by_key(|estimate| estimate.round_trip).copied()
    }

    /// Whether so many exchanges were made that beats need not come quickly.
    pub fn is_settled(&self) -> bool {
        self.exchanges.len() >= WINDOW / 2
    }
}
