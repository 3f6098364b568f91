//! Statistics over runs. Each is independent of the order of the runs, bit for bit.

/// Returns the 95 % Wilson score interval of a rate, `successes` of `runs`.
/// Without continuity correction. Without runs it is 0 to 1.
pub(crate) fn wilson_interval(successes: u64, runs: u64) -> [f64; 2] {
    /// The 97.5th percentile of the normal distribution.
    const Z: f64 = 1.959_963_984_540_054;
    if runs == 0 {
        return [0.0, 1.0];
    }
    let runs_counted = runs as f64;
    let rate = successes as f64 / runs_counted;
    let middle = rate + Z * Z / (2.0 * runs_counted);
    let half = Z * (rate * (1.0 - rate) / runs_counted + Z * Z / (4.0 * runs_counted * runs_counted)).sqrt();
    let scale = 1.0 + Z * Z / runs_counted;
    // At the ends the formula gives 0 and 1 only up to rounding.
    [
        if successes == 0 { 0.0 } else { (middle - half) / scale },
        if successes == runs { 1.0 } else { (middle + half) / scale },
    ]
}

/// Returns a percentile of sorted values by linear interpolation.
/// It interpolates between the two nearest ranks, counted from the first value (0th) to the last (100th). `None`
/// without values; above 100 the last value.
pub(crate) fn percentile(sorted: &[f64], percent: usize) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    // In hundredths, so that whole ranks are met exactly.
    let position = last * percent;
    let (index, fraction) = (position / 100, (position % 100) as f64 / 100.0);
    if index >= last {
        return sorted.last().copied();
    }
    Some(sorted[index] + (sorted[index + 1] - sorted[index]) * fraction)
}

/// Returns the sum, from the smallest to the largest value.
pub(crate) fn sum(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.iter().sum()
}

/// Returns the 95 % upper bound of the mean of a Poisson distribution.
/// With that mean, as few events as were counted, or fewer, occur in 5 % of all cases. It is Garwood's exact bound,
/// half the 95th percentile of the chi-squared distribution with 2 (`events` + 1) degrees of freedom.
pub(crate) fn poisson_bound(events: u64) -> f64 {
    const TAIL_PROBABILITY: f64 = 0.05;
    if events == 0 {
        return -libm::log(TAIL_PROBABILITY);
    }
    let counted = events as f64;
    let (mut low, mut high) = (counted, 2.0 * counted + 5.0);
    loop {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            return high;
        }
        if at_most(events, middle) > TAIL_PROBABILITY { low = middle } else { high = middle }
    }
}

/// Returns the probability that a Poisson variable is at most `events`.
/// `events` is not more than its mean.
fn at_most(events: u64, mean: f64) -> f64 {
    let counted = events as f64;
    // The last term is the largest; the others are its multiples, so that none underflows.
    let last = libm::exp(counted * libm::log(mean) - mean - libm::lgamma(counted + 1.0));
    let (mut share, mut shares) = (1.0, 1.0);
    for event in (1..=events).rev() {
        share *= event as f64 / mean;
        if shares + share == shares {
            break;
        }
        shares += share;
    }
    last * shares
}
