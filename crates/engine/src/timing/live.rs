use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use super::Histogram;
use super::histogram::{BUCKETS, bucket};

/// Histogram that one thread at a time fills while others read it.
/// A reader may miss the duration that is just being counted, and nothing else.
#[derive(Debug)]
pub struct LiveHistogram {
    buckets: Box<[AtomicU32; BUCKETS]>,
    count: AtomicU64,
    sum: AtomicU64,
    min: AtomicU64,
    max: AtomicU64,
}

impl Default for LiveHistogram {
    fn default() -> Self {
        Self {
            buckets: Box::new([const { AtomicU32::new(0) }; BUCKETS]),
            count: AtomicU64::new(0),
            sum: AtomicU64::new(0),
            min: AtomicU64::new(u64::MAX),
            max: AtomicU64::new(0),
        }
    }
}

impl LiveHistogram {
    /// Counts a duration, ns, `times` times; only one thread at a time may call it.
    #[inline]
    pub fn record(&self, duration: u64, times: u32) {
        let bucket = &self.buckets[bucket(duration)];
        // A full counter stays full, after thousands of millions of times.
        bucket.store(bucket.load(Ordering::Relaxed).saturating_add(times), Ordering::Relaxed);
        let sum = duration.saturating_mul(times.into());
        self.sum.store(self.sum.load(Ordering::Relaxed).saturating_add(sum), Ordering::Relaxed);
        if duration < self.min.load(Ordering::Relaxed) {
            self.min.store(duration, Ordering::Relaxed);
        }
        if duration > self.max.load(Ordering::Relaxed) {
            self.max.store(duration, Ordering::Relaxed);
        }
        // Last, so that a reader of the count also sees the counted durations.
        self.count.store(self.count.load(Ordering::Relaxed) + u64::from(times), Ordering::Release);
    }

    /// Returns the number of durations counted.
    pub fn count(&self) -> u64 {
        self.count.load(Ordering::Acquire)
    }

    /// Returns the longest duration, ns.
    pub fn max(&self) -> u64 {
        self.max.load(Ordering::Relaxed)
    }

    /// Copies the counts to `histogram`.
    pub fn copy_to(&self, histogram: &mut Histogram) {
        let load = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        histogram.count = self.count();
        for (to, from) in histogram.buckets.iter_mut().zip(self.buckets.iter()) {
            *to = from.load(Ordering::Relaxed);
        }
        (histogram.sum, histogram.min, histogram.max) = (load(&self.sum), load(&self.min), load(&self.max));
    }

    /// Clears all counts; no thread may record meanwhile.
    pub fn clear(&self) {
        self.buckets.iter().for_each(|bucket| bucket.store(0, Ordering::Relaxed));
        self.sum.store(0, Ordering::Relaxed);
        self.min.store(u64::MAX, Ordering::Relaxed);
        self.max.store(0, Ordering::Relaxed);
        self.count.store(0, Ordering::Release);
    }
}
