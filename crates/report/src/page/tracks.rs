use crate::plot::Curve;
use crate::{Sample, Trajectory};

/// Maximum number of samples of a robot; a picture can't show more.
const MAX_SAMPLES: usize = 20_000;

/// Sampled poses of robots, thinned when there are more than a picture can show.
#[derive(Debug, Default)]
pub(super) struct RobotTracks {
    robots: Vec<RobotTrack>,
}

#[derive(Debug, Default)]
struct RobotTrack {
    samples: Vec<Sample>,
    /// Number of samples of which one is kept.
    stride: usize,
    seen: usize,
}

impl RobotTracks {
    pub fn new(robots: usize) -> Self {
        Self { robots: (0..robots).map(|_| RobotTrack { stride: 1, ..RobotTrack::default() }).collect() }
    }

    pub fn add(&mut self, robot: usize, sample: Sample) {
        let Some(track) = self.robots.get_mut(robot) else { return };
        let goes_on = track
            .samples
            .last()
            .is_some_and(|last| last.route == sample.route && last.action == sample.action);
        track.seen += 1;
        if goes_on && !track.seen.is_multiple_of(track.stride) {
            return;
        }
        track.samples.push(sample);
        if track.samples.len() >= MAX_SAMPLES {
            track.stride *= 2;
            track.samples = std::mem::take(&mut track.samples).into_iter().step_by(2).collect();
        }
    }

    /// Returns the samples of all robots, in the order of time.
    pub fn trajectory(self) -> Trajectory {
        let mut samples: Vec<_> = self.robots.into_iter().flat_map(|track| track.samples).collect();
        samples.sort_by_key(|sample| sample.time);
        Trajectory { samples }
    }
}

/// Number over time, thinned as a track; the exact minimum is kept.
#[derive(Debug, Default)]
pub(super) struct Series {
    points: Vec<(f64, f64)>,
    stride: usize,
    seen: usize,
    pub least: Option<(f64, f64)>,
    pub last: Option<f64>,
}

impl Series {
    pub fn add(&mut self, time: f64, number: f64) {
        self.last = Some(number);
        if number.is_finite() && self.least.is_none_or(|(_, least)| number < least) {
            self.least = Some((time, number));
        }
        self.stride = self.stride.max(1);
        self.seen += 1;
        if !(self.seen - 1).is_multiple_of(self.stride) {
            return;
        }
        self.points.push((time, number));
        if self.points.len() >= MAX_SAMPLES {
            self.stride *= 2;
            self.points = std::mem::take(&mut self.points).into_iter().step_by(2).collect();
        }
    }

    pub fn median(&self) -> Option<f64> {
        let mut numbers: Vec<_> =
            self.points.iter().map(|(_, number)| *number).filter(|n| n.is_finite()).collect();
        numbers.sort_by(f64::total_cmp);
        crate::statistics::percentile(&numbers, 50)
    }

    pub fn curve(self, name: String) -> Curve {
        Curve { name, points: self.points }
    }
}
