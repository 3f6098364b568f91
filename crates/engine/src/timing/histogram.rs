use slate_composition::own::TimingHistogram;

/// Base-2 logarithm of the buckets per power of two.
/// 32 buckets are at most 3.1 % wide.
const BUCKET_BITS: u32 = 5;
const BUCKETS_PER_OCTAVE: usize = 1 << BUCKET_BITS;
/// Base-2 logarithm of the limit: 2^37 ns, some 137 s, counts as the greatest.
const LIMIT_BITS: u32 = 37;
pub(super) const BUCKETS: usize = (LIMIT_BITS - BUCKET_BITS + 1) as usize * BUCKETS_PER_OCTAVE;

/// Histogram of durations in ns, in buckets of at most 3.1 %.
/// It is exact up to 63 ns, and has these buckets from there to 137 s. It takes 4 KiB, whatever is counted.
/// Own, as `hdrhistogram` takes 16 KiB for this range with two digits and counters of 32 bits, and one digit is too
/// coarse.
///
/// ```
/// use slate_engine::timing::Histogram;
///
/// let mut histogram = Histogram::default();
/// (1..=100).for_each(|duration| histogram.record(duration * 1000));
/// let p90 = histogram.quantile(0.9);
/// assert!((88_000..92_000).contains(&p90));
/// assert_eq!(histogram.summary().max, 100_000);
/// ```
#[derive(Clone, PartialEq, Eq)]
pub struct Histogram {
    pub(super) buckets: Box<[u32; BUCKETS]>,
    pub(super) count: u64,
    pub(super) sum: u64,
    pub(super) min: u64,
    pub(super) max: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { buckets: Box::new([0; BUCKETS]), count: 0, sum: 0, min: u64::MAX, max: 0 }
    }
}

impl std::fmt::Debug for Histogram {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Histogram").field(&self.summary()).finish()
    }
}

impl Histogram {
    /// Counts a duration, ns.
    #[inline]
    pub fn record(&mut self, duration: u64) {
        let bucket = bucket(duration);
        if self.buckets[bucket] == u32::MAX {
            self.halve();
        }
        self.buckets[bucket] += 1;
        self.count += 1;
        self.sum = self.sum.saturating_add(duration);
        self.min = self.min.min(duration);
        self.max = self.max.max(duration);
    }

    /// Halves all counters to make room.
    /// Earlier durations then have half the weight in the quantiles, once in thousands of millions of times.
    #[cold]
    fn halve(&mut self) {
        self.buckets.iter_mut().for_each(|count| *count /= 2);
    }

    /// Returns the number of durations counted.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Returns the mean, ns; 0 when nothing was counted.
    pub fn mean(&self) -> u64 {
        self.sum.checked_div(self.count).unwrap_or(0)
    }

    /// Returns the longest duration, ns, exactly; 0 when nothing was counted.
    pub fn max(&self) -> u64 {
        self.max
    }

    /// Returns a quantile of the durations, ns, to 1.6 %; 0 when nothing was counted.
    /// `part` is in 0 to 1.
    pub fn quantile(&self, part: f64) -> u64 {
        let [quantile] = self.quantiles([part]);
        quantile
    }

    /// Returns several quantiles in one pass; `parts` ascend.
    fn quantiles<const N: usize>(&self, parts: [f64; N]) -> [u64; N] {
        let total: u64 = self.buckets.iter().map(|count| u64::from(*count)).sum();
        let mut below = 0;
        let mut buckets = self.buckets.iter().enumerate();
        let mut bucket = 0;
        parts.map(|part| {
            if total == 0 {
                return 0;
            }
            let rank = ((total as f64 * part).ceil() as u64).clamp(1, total);
            while below < rank {
                let Some((next, count)) = buckets.next() else { break };
                below += u64::from(*count);
                bucket = next;
            }
            // The longest is known exactly, and none is beyond the ends.
            if rank == total { self.max } else { middle(bucket).clamp(self.min, self.max) }
        })
    }

    /// Adds the counts of another histogram.
    pub fn merge(&mut self, other: &Self) {
        let mut halvings = 0;
        for (own, others) in self.buckets.iter().zip(other.buckets.iter()) {
            halvings |= u32::from(u64::from(*own) + u64::from(*others) > u64::from(u32::MAX));
        }
        for (own, others) in self.buckets.iter_mut().zip(other.buckets.iter()) {
            *own = (*own >> halvings) + (*others >> halvings);
        }
        self.count = self.count.saturating_add(other.count);
        self.sum = self.sum.saturating_add(other.sum);
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.buckets.fill(0);
        (self.count, self.sum, self.min, self.max) = (0, 0, u64::MAX, 0);
    }

    /// Returns the summary that a property shows.
    pub fn summary(&self) -> TimingHistogram {
        let [p50, p90, p99, p999] = self.quantiles([0.5, 0.9, 0.99, 0.999]);
        TimingHistogram { count: self.count, mean: self.mean(), p50, p90, p99, p999, max: self.max }
    }
}

/// Returns the index of a duration's bucket.
/// It consists of the power of two, and the next lower bits, as many as tell its buckets apart.
#[inline]
pub(super) fn bucket(duration: u64) -> usize {
    let duration = duration.min((1 << LIMIT_BITS) - 1);
    if duration < BUCKETS_PER_OCTAVE as u64 {
        return duration as usize;
    }
    let shift = duration.ilog2() - BUCKET_BITS;
    (shift as usize) * BUCKETS_PER_OCTAVE + (duration >> shift) as usize
}

/// Returns the duration in the middle of a bucket.
fn middle(bucket: usize) -> u64 {
    if bucket < BUCKETS_PER_OCTAVE {
        return bucket as u64;
    }
    let shift = bucket / BUCKETS_PER_OCTAVE - 1;
    let low = ((BUCKETS_PER_OCTAVE + bucket % BUCKETS_PER_OCTAVE) as u64) << shift;
    low + (1 << shift >> 1)
}
