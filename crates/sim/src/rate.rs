//! Sampling of sensors with a rate of their own.

/// Returns whether a periodic action of `rate` Hz was due since `last`, ns.
/// `share` is the phase: a delay as a share of the period.
///
/// On the first call, without a `last`, everything is due.
pub fn due(rate: f64, share: f64, last: Option<u64>, now: u64) -> bool {
    let Some(last) = last else { return true };
    let between = 1e9 / rate;
    let turns = |time: u64| ((time as f64 - share * between) / between).floor();
    turns(now) > turns(last)
}
