//! Sensors that measure less often than they are asked.

/// Whether something that has its turn `rate` times a second had one since `last`, both times in nanoseconds. Its turns
/// come later than those of others by that share of the time between two.
///
/// The first time that it is asked, without a `last`, everything has its turn.
pub fn due(rate: f64, share: f64, last: Option<u64>, now: u64) -> bool {
    let Some(last) = last else { return true };
    let between = 1e9 / rate;
    let turns = |time: u64| ((time as f64 - share * between) / between).floor();
    turns(now) > turns(last)
}
