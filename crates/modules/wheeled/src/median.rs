use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Echo, SonarScan};
use slate_plugin::prelude::*;

/// Maximum number of scans.
const SCANS: usize = 9;
/// Maximum number of sonars.
const SONARS: usize = 16;

/// Median filter of the newest scans of a ring of sonars.
/// The median of each range over time drops single outliers.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct MedianRing {
    /// Ranges of each scan, meters; oldest overwritten first.
    scans: [[f64; SONARS]; SCANS],
    /// Number of scans so far.
    count: u64,
}

impl MedianRing {
    /// Adds a scan; returns the shortest median of the newest `scans`, meters.
    /// A sonar without an echo counts with the maximum range.
    pub fn nearest(&mut self, scan: &SonarScan, scans: usize) -> f64 {
        self.add(scan);
        let sonars = scan.echoes.len().min(SONARS);
        (0..sonars).map(|sonar| self.median(sonar, scans)).fold(scan.range_max, math::min)
    }

    /// Adds a scan; returns it with the medians of the newest `scans` as ranges.
    /// A range that is not a number stays: a failed sonar must not look like free space.
    pub fn filter(&mut self, scan: &SonarScan, scans: usize) -> SonarScan {
        self.add(scan);
        let mut echoes = [Echo::default(); SONARS];
        let length = scan.echoes.len().min(SONARS);
        for (sonar, (filtered, echo)) in echoes.iter_mut().zip(scan.echoes.iter()).enumerate() {
            let range = if echo.range.is_finite() { self.median(sonar, scans) } else { echo.range };
            *filtered = Echo { range, heard: (range.is_nan() || range < scan.range_max).into() };
        }
        SonarScan { echoes: Sequence::new(&echoes[..length]), ..*scan }
    }

    fn add(&mut self, scan: &SonarScan) {
        let mut ranges = [scan.range_max; SONARS];
        for (range, echo) in ranges.iter_mut().zip(scan.echoes.iter()) {
            if echo.heard.get() && echo.range < scan.range_max {
                *range = echo.range;
            }
        }
        self.scans[(self.count % SCANS as u64) as usize] = ranges;
        self.count += 1;
    }

    /// Returns the median range of a sonar over the newest `scans` scans.
    fn median(&self, sonar: usize, scans: usize) -> f64 {
        let scans = scans.clamp(1, SCANS).min(self.count.min(SCANS as u64) as usize);
        let mut window = [0.0; SCANS];
        for (back, value) in window[..scans].iter_mut().enumerate() {
            *value = self.scans[((self.count - 1 - back as u64) % SCANS as u64) as usize][sonar];
        }
        window[..scans].sort_unstable_by(f64::total_cmp);
        window[scans / 2]
    }
}
