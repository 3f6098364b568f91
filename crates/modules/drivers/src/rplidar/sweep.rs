//! Turns of a scanner as scans with beams at equal angles.

use std::f64::consts::{PI, TAU};

use slate_module::Sequence;

use super::packet::RplidarNode;
use crate::scan::{LaserSweep, MOST_BEAMS};

/// Turn that is being measured.
///
/// A scanner measures at any angles. Each node counts for the nearest beam, and the shortest range of a beam counts; a
/// beam without a node takes that of the one beside it.
#[derive(Clone, Debug)]
pub struct TurnBuilder {
    beams: usize,
    range_min: f64,
    range_max: f64,
    /// Range of each beam; infinite without an echo, NaN without a node.
    ranges: [f32; MOST_BEAMS],
    nodes: usize,
}

impl TurnBuilder {
    /// Scans of that many beams, at most [`MOST_BEAMS`].
    pub fn new(beams: usize, range_min: f64, range_max: f64) -> Self {
        let beams = beams.clamp(1, MOST_BEAMS);
        Self { beams, range_min, range_max, ranges: [f32::NAN; MOST_BEAMS], nodes: 0 }
    }

    /// Returns the angle between beams, radians.
    fn increment(&self) -> f64 {
        TAU / self.beams as f64
    }

    /// Adds a node.
    pub fn add(&mut self, node: &RplidarNode) {
        self.nodes += 1;
        // The first beam looks back; directions are from a full turn clockwise to the front.
        let place = (node.direction() + TAU + PI) / self.increment();
        let range = match node.range() {
            Some(range) if (self.range_min..=self.range_max).contains(&range) => range as f32,
            _ => f32::INFINITY,
        };
        let beam = &mut self.ranges[(place + 0.5) as usize % self.beams];
        if beam.is_nan() || range < *beam {
            *beam = range;
        }
    }

    /// Returns the scan of the turn, if anything was measured, and begins the next one.
    pub fn finish(&mut self) -> Option<LaserSweep> {
        let nodes = std::mem::take(&mut self.nodes);
        let measured = self.ranges;
        self.ranges = [f32::NAN; MOST_BEAMS];
        let mut ranges = [f32::INFINITY; MOST_BEAMS];
        for (beam, place) in ranges.iter_mut().enumerate().take(self.beams) {
            let beside = [beam, (beam + self.beams - 1) % self.beams, (beam + 1) % self.beams];
            let range = beside.into_iter().map(|beam| measured[beam]).find(|range| !range.is_nan());
            *place = range.unwrap_or(f32::INFINITY);
        }
        (nodes > 0).then(|| LaserSweep {
            angle_min: -PI,
            angle_increment: self.increment(),
            range_min: self.range_min,
            range_max: self.range_max,
            ranges: Sequence::new(&ranges[..self.beams]),
        })
    }
}
