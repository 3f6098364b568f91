use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::SonarScan;
use slate_plugin::prelude::*;

/// Maximum number of scans.
const SCANS: usize = 9;
/// Maximum number of sonars.
const SONARS: usize = 16;

/// Newest scans of a ring of sonars: the median of each range over time drops single outliers.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct MedianRing {
    /// Ranges of each scan, metres; oldest overwritten first.
    scans: [[f64; SONARS]; SCANS],
    /// Number of scans so far.
    count: u64,
}

impl MedianRing {
    /// Adds a scan and returns the shortest of the sonars' medians over the newest `scans` ones, metres. A sonar without an
    /// echo counts with the maximum range.
    pub fn nearest(&mut self, scan: &SonarScan, scans: usize) -> f64 {
        let mut ranges = [scan.range_max; SONARS];
        for (range, echo) in ranges.iter_mut().zip(scan.echoes.iter()) {
            if echo.heard.get() && echo.range < scan.range_max {
                *range = echo.range;
            }
        }
        self.scans[(self.count % SCANS as u64) as usize] = ranges;
        self.count += 1;
        let scans = scans.clamp(1, SCANS).min(self.count.min(SCANS as u64) as usize);
        let newest = |back: usize| &self.scans[((self.count - 1 - back as u64) % SCANS as u64) as usize];
        let sonars = scan.echoes.len().min(SONARS);
        let median = |sonar: usize| {
            let mut window = [0.0; SCANS];
            for (back, value) in window[..scans].iter_mut().enumerate() {
                *value = newest(back)[sonar];
            }
            window[..scans].sort_unstable_by(f64::total_cmp);
            window[scans / 2]
        };
        (0..sonars).map(median).fold(scan.range_max, math::min)
    }
}
