//! Both ends of a subscription: the reading one, and the serving one.

use super::inbound::Inbound;
use super::outbound::Outbound;
use super::wire::{Announcement, Sample, Seen};
use super::{Content, Limits, Mode, Options};

/// Subscription of this agent, which outlives connections.
#[derive(Debug)]
pub(super) struct ReadStream {
    pub path: String,
    pub options: Options,
    pub stream: Inbound,
    /// Epoch of the current offer; 0 for none.
    pub epoch: u32,
    /// Newest shown value, with its origin.
    pub seen: Option<Seen>,
    pub lost: u64,
    /// Number of lost values of the same origin between the last value and the next.
    /// Values that the subscription's own rate leaves out do not count.
    pub skipped: u64,
    pub received: u64,
}

impl ReadStream {
    pub fn new(path: &str, options: Options, limits: &Limits) -> Self {
        Self {
            path: path.into(),
            options,
            stream: stream(&options, limits),
            epoch: 0,
            seen: None,
            lost: 0,
            skipped: 0,
            received: 0,
        }
    }

    /// Resets the state of a connection that has ended.
    pub fn end(&mut self, limits: &Limits) {
        self.stream = stream(&self.options, limits);
        self.epoch = 0;
    }

    /// Begins a new offer, whose values follow `after`.
    pub fn accept(&mut self, instance: u64, epoch: u32, after: u64) {
        self.epoch = epoch;
        // Numbers continue from writer to writer, so they alone say what is newer.
        self.count_until(after, 0, instance);
    }

    /// Counts the values between the last shown one and `sequence` of the same origin.
    fn count_until(&mut self, sequence: u64, generation: u64, instance: u64) {
        if let Some(seen) = self.seen.filter(|seen| seen.instance == instance) {
            // The other agent's numbers may be any.
            let between = sequence.saturating_sub(seen.sequence);
            if !self.options.thins() {
                self.skipped = self.skipped.saturating_add(between);
            }
            if self.options.content == Content::All {
                self.lost = self.lost.saturating_add(between);
            }
        }
        self.seen = Some(Seen { instance, generation, sequence });
    }

    /// Takes a value if it is newer than all before; returns whether it is.
    pub fn take_newer(&mut self, sample: &Sample, epoch: u32) -> bool {
        let Some(seen) = self.seen.filter(|_| epoch == self.epoch) else { return false };
        let stamp = sample.stamp;
        if stamp.sequence <= seen.sequence || stamp.generation < seen.generation {
            return false;
        }
        self.count_until(stamp.sequence - 1, stamp.generation, seen.instance);
        self.seen = Some(Seen { sequence: stamp.sequence, generation: stamp.generation, ..seen });
        self.received += 1;
        true
    }

    /// Takes an announcement; earlier values that did not arrive are lost.
    pub fn receive_announcement(&mut self, announcement: &Announcement) {
        let Some(seen) = self.seen.filter(|_| announcement.epoch == self.epoch) else { return };
        if self.stream.is_complete() && announcement.sequence > seen.sequence {
            self.count_until(announcement.sequence, seen.generation, seen.instance);
        }
    }
}

fn stream(options: &Options, limits: &Limits) -> Inbound {
    let limit = limits.value + super::wire::SAMPLE_HEAD_SIZE;
    Inbound::new(options.content, options.reliable, limit, limits.window)
}

/// Subscription of the other agent, which ends with the connection.
#[derive(Debug)]
pub(super) struct Serving {
    pub options: Options,
    pub stream: Outbound,
    pub epoch: u32,
    /// State of the subscriber: true once it waits for values.
    pub begun: bool,
    due: u64,
    /// Transfer of a batch: values of a queue that accumulated until it was due.
    batch: bool,
    pub sent: u64,
}

impl Serving {
    pub fn new(options: Options, limits: &Limits, now: u64) -> Self {
        let stream = Outbound::new(options.content, options.reliable, limits.window);
        Self { options, stream, epoch: 0, begun: false, due: now, batch: false, sent: 0 }
    }

    /// Returns the time of the next value; `None` while the stream takes none.
    pub fn due(&self) -> Option<u64> {
        (self.begun && self.stream.is_ready()).then_some(self.due)
    }

    /// Notes that a value was taken.
    pub fn note_value(&mut self, now: u64) {
        self.sent += 1;
        match self.options.content {
            Content::Newest => self.schedule_next(now),
            Content::All => self.batch = true,
        }
    }

    /// Notes that no further value is ready.
    pub fn note_empty(&mut self, now: u64) {
        // A period without a value has passed like any other.
        let passed = matches!(self.options.mode, Mode::Periodic(_));
        if std::mem::take(&mut self.batch) || passed {
            self.schedule_next(now);
        }
    }

    fn schedule_next(&mut self, now: u64) {
        self.due = match self.options.mode {
            Mode::OnChange(interval) => now.saturating_add(interval),
            // On the grid of periods, so that it does not drift.
            Mode::Periodic(period) => {
                let period = period.max(1);
                let late = now.saturating_sub(self.due);
                self.due.saturating_add((late / period + 1).saturating_mul(period))
            }
        };
    }
}
