//! Test by which the exemplar compares strategies.

use slate_plugin::module::math;

/// Returns the p-value of a one-sided Mann-Whitney U test.
/// The alternative is that values of `first` tend to be less than those of `second`. 1 if either has no value.
///
/// Normal approximation with correction for ties and for continuity, as SciPy's `mannwhitneyu(alternative="less",
/// method="asymptotic")`. Source: Mann and Whitney, "On a test of whether one of two random variables is stochastically
/// larger than the other", 1947; correction for ties of Lehmann, "Nonparametrics", 1975, section 1.4.
pub fn mann_whitney_less(first: &[f64], second: &[f64]) -> f64 {
    let (n1, n2) = (first.len() as f64, second.len() as f64);
    let mut all: Vec<(f64, bool)> = first.iter().map(|value| (*value, true)).collect();
    all.extend(second.iter().map(|value| (*value, false)));
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Equal values share the mean of their ranks.
    let (mut rank_sum, mut ties, mut ranked) = (0.0, 0.0, 0.0);
    for equal in all.chunk_by(|a, b| a.0 == b.0) {
        let count = equal.len() as f64;
        let own = equal.iter().filter(|(_, is_first)| *is_first).count() as f64;
        rank_sum += own * (ranked + (count + 1.0) / 2.0);
        ties += count * count * count - count;
        ranked += count;
    }
    let (u, n) = (rank_sum - n1 * (n1 + 1.0) / 2.0, n1 + n2);
    let variance = n1 * n2 / 12.0 * ((n + 1.0) - ties / (n * (n - 1.0)));
    // All values equal, or none: nothing speaks for a difference.
    if variance.is_nan() || variance <= 0.0 {
        return 1.0;
    }
    normal_distribution((u + 0.5 - n1 * n2 / 2.0) / variance.sqrt())
}

/// Returns the distribution function of the standard normal distribution.
/// Abramowitz and Stegun, "Handbook of Mathematical Functions", 26.2.17, with an error below 7.5e-8.
fn normal_distribution(x: f64) -> f64 {
    const COEFFICIENTS: [f64; 5] =
        [0.319_381_530, -0.356_563_782, 1.781_477_937, -1.821_255_978, 1.330_274_429];
    let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
    let density = math::exp(-x * x / 2.0) / (2.0 * std::f64::consts::PI).sqrt();
    let tail = density * COEFFICIENTS.iter().rev().fold(0.0, |sum, coefficient| t * (coefficient + sum));
    if x > 0.0 { 1.0 - tail } else { tail }
}
