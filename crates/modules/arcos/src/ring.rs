//! Scan of the ring of sonars, from several reports.

use slate_interfaces::{Echo, SonarPlacement, SonarScan};
use slate_module::Sequence;

use crate::model::Model;
use crate::report::Range;

/// Age of an echo above which a scan is incomplete, seconds.
/// Each sonar fires every 0.32 s.
const STALE: f64 = 1.0;

/// Newest reading of each sonar, and its time.
#[derive(Clone, Debug)]
pub struct Ring {
    scan: SonarScan,
    range: f64,
    echoes: [Echo; 16],
    /// Time of each sonar's newest reading, seconds; `None` before the first.
    reading_times: [Option<f64>; 16],
    count: usize,
}

impl Ring {
    /// Returns the first `count` sonars of a robot: 8 for one with a front array alone.
    pub fn new(model: &Model, count: usize) -> Self {
        let count = count.min(model.sonars.len());
        let placements =
            model.sonars.map(|[x, y, degrees]| SonarPlacement { x, y, theta: degrees.to_radians() });
        Self {
            scan: SonarScan {
                field_of_view: model.field_of_view,
                range_min: model.range_min,
                range_max: model.range_max,
                placements: Sequence::new(&placements[..count]),
                echoes: Sequence::default(),
            },
            range: model.range,
            echoes: [Echo::default(); 16],
            reading_times: [None; 16],
            count,
        }
    }

    /// Adds the ranges of a report; returns the scan if it is new and complete.
    /// `now` is the report's time, seconds. With a missing sonar there is no scan: a silent sonar must not be taken for
    /// one without an obstacle.
    pub fn advance(&mut self, ranges: &[Range], now: f64) -> Option<SonarScan> {
        let mut is_new = false;
        for Range { sonar, range } in ranges {
            let place = usize::from(*sonar);
            if place >= self.count {
                continue;
            }
            let range = f64::from(*range) * self.range;
            let heard = range < self.scan.range_max;
            let range = range.clamp(self.scan.range_min, self.scan.range_max);
            self.echoes[place] = Echo { range, heard: heard.into() };
            self.reading_times[place] = Some(now);
            is_new = true;
        }
        if !is_new || self.silent(now).is_some() {
            return None;
        }
        self.scan.echoes = Sequence::new(&self.echoes[..self.count]);
        Some(self.scan)
    }

    /// Returns the first silent sonar.
    pub fn silent(&self, now: f64) -> Option<usize> {
        self.reading_times[..self.count].iter().position(|time| time.is_none_or(|time| now - time > STALE))
    }
}
