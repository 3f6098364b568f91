use serde::{Deserialize, Serialize};

use super::Sample;

/// A trajectory of bounded size.
///
/// Samples come every 50 ms. With more than 20,000 of them, every other time is removed and samples come half as often, as often as
/// necessary. So a run of any length takes the same memory, and the same run always has the same samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ThinnedTrajectory {
    /// Time at which the next samples are due, nanoseconds.
    next: u64,
    /// Sampling period, nanoseconds.
    #[serde(default = "period")]
    period: u64,
    samples: Vec<Sample>,
    /// Number of times that samples were removed or replaced, for readers.
    #[serde(skip)]
    generation: u64,
}

fn period() -> u64 {
    ThinnedTrajectory::SAMPLE_PERIOD
}

impl Default for ThinnedTrajectory {
    fn default() -> Self {
        Self { next: 0, period: Self::SAMPLE_PERIOD, samples: Vec::new(), generation: 0 }
    }
}

/// Read position in a [`ThinnedTrajectory`]; initially its beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrajectoryPosition {
    generation: u64,
    samples: usize,
}

impl TrajectoryPosition {
    /// Returns true if the samples read follow those read until another position.
    /// Otherwise all were read once more, because samples were removed.
    pub fn follows(&self, before: Self) -> bool {
        self.generation == before.generation
    }
}

impl ThinnedTrajectory {
    /// Sampling period before any sample was removed, nanoseconds.
    pub const SAMPLE_PERIOD: u64 = 50_000_000;

    /// The most samples.
    pub const MAX_SAMPLES: usize = 20_000;

    /// The most samples that are read at once, so that their copies need little memory.
    pub const BATCH_SIZE: usize = 1_000;

    /// Adds the samples of all robots at a time, if they are due or the run ends.
    pub fn add(&mut self, time: u64, is_end: bool, samples: impl IntoIterator<Item = Sample>) {
        if time < self.next && !is_end {
            return;
        }
        self.next += self.period;
        self.samples.extend(samples);
        if self.samples.len() > Self::MAX_SAMPLES {
            self.thin();
        }
    }

    /// Removes every other time, and lets samples come half as often.
    fn thin(&mut self) {
        let (mut time, mut number) = (None, 0_usize);
        self.samples.retain(|sample| {
            if time.replace(sample.time).is_some_and(|last| last != sample.time) {
                number += 1;
            }
            number.is_multiple_of(2)
        });
        self.period = self.period.saturating_mul(2);
        // Samples that are left are on the grid of the new period.
        let last = self.samples.last().map_or(0, |sample| sample.time);
        self.next = (last / self.period).saturating_add(1).saturating_mul(self.period);
        self.generation += 1;
    }

    /// Continues with another trajectory, such as that of a snapshot.
    pub fn replace(&mut self, other: Self) {
        let generation = self.generation + 1;
        *self = Self { generation, ..other };
    }

    /// Returns the samples, in order of time.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Takes the samples out.
    pub fn take(&mut self) -> Vec<Sample> {
        self.generation += 1;
        std::mem::take(&mut self.samples)
    }

    /// Returns samples from a position on, and advances it.
    /// At most [`BATCH_SIZE`](Self::BATCH_SIZE) at a time. When samples were removed since, it begins with the first.
    pub fn read(&self, position: &mut TrajectoryPosition) -> &[Sample] {
        let start = if position.generation == self.generation { position.samples } else { 0 };
        let rest = self.samples.get(start..).unwrap_or_default();
        let read = &rest[..rest.len().min(Self::BATCH_SIZE)];
        *position = TrajectoryPosition { generation: self.generation, samples: start + read.len() };
        read
    }
}
