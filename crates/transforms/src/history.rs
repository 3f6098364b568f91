use std::collections::VecDeque;

use nalgebra::Isometry3;

use crate::interpolation::between;

/// History of a frame's transform in its parent.
/// The last samples in order of time, in memory that never grows.
#[derive(Clone, Debug)]
pub(crate) struct History {
    /// Room for `capacity` samples was made when the history was.
    samples: VecDeque<TransformSample>,
    capacity: usize,
}

#[derive(Clone, Copy, Debug)]
struct TransformSample {
    time: u64,
    transform: Isometry3<f64>,
}

/// Requested time outside the samples.
pub(crate) enum Gap {
    /// Time of the oldest sample, after the requested one.
    Before(u64),
    /// Time of the newest sample, before the requested one.
    After(u64),
}

impl History {
    /// Returns a history with its first sample, for at least one.
    pub fn new(capacity: usize, time: u64, transform: Isometry3<f64>) -> Self {
        let capacity = capacity.max(1);
        let mut samples = VecDeque::with_capacity(capacity);
        samples.push_back(TransformSample { time, transform });
        Self { samples, capacity }
    }

    pub fn newest(&self) -> u64 {
        self.samples.back().map_or(0, |sample| sample.time)
    }

    pub fn oldest(&self) -> u64 {
        self.samples.front().map_or(0, |sample| sample.time)
    }

    /// Adds a sample; false if it is older than all that can be kept.
    /// It replaces one of the same time.
    pub fn add(&mut self, time: u64, transform: Isometry3<f64>) -> bool {
        let sample = TransformSample { time, transform };
        let place = self.samples.partition_point(|other| other.time < time);
        if let Some(same) = self.samples.get_mut(place).filter(|other| other.time == time) {
            *same = sample;
            return true;
        }
        if self.samples.len() < self.capacity {
            self.samples.insert(place, sample);
        } else if place == 0 {
            return false;
        } else {
            self.samples.pop_front();
            self.samples.insert(place - 1, sample);
        }
        true
    }

    /// Returns the transform of the frame at a time.
    /// Up to `tolerance` beyond the samples the nearest one holds.
    pub fn at(&self, time: u64, tolerance: u64) -> Result<Isometry3<f64>, Gap> {
        let place = self.samples.partition_point(|sample| sample.time < time);
        let before = place.checked_sub(1).and_then(|place| self.samples.get(place));
        match (before, self.samples.get(place)) {
            (_, Some(after)) if after.time == time => Ok(after.transform),
            (Some(before), Some(after)) => {
                let part = (time - before.time) as f64 / (after.time - before.time) as f64;
                Ok(between(&before.transform, &after.transform, part))
            }
            (Some(newest), None) if time - newest.time <= tolerance => Ok(newest.transform),
            (None, Some(oldest)) if oldest.time - time <= tolerance => Ok(oldest.transform),
            (_, None) => Err(Gap::After(self.newest())),
            (None, Some(oldest)) => Err(Gap::Before(oldest.time)),
        }
    }
}
