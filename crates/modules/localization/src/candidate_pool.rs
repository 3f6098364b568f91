//! Candidates for random particles.

use slate_interfaces::Pose2;
use slate_module::{Random, math};

use crate::likelihood_field::LikelihoodField;

/// Poses anywhere in the map, with which a scan was compared.
#[derive(Clone, Debug, Default)]
pub(crate) struct CandidatePool {
    drawn: Vec<(f64, Pose2)>,
    some: Vec<[f64; 2]>,
    /// Logarithm of the scan's likelihood from each, then sums of weights.
    cumulative: Vec<f64>,
}

/// Exponent that flattens a candidate's likelihood.
/// A candidate is some decimeters and degrees from the pose that it stands for, so that its likelihood overstates the
/// information of a scan.
const TEMPER: f64 = 0.25;
/// Number of beams in the first comparison, and candidates per one compared fully.
const SOME_BEAMS: usize = 12;
const BEST: usize = 10;

impl CandidatePool {
    /// Draws `count` poses, and weighs them by a scan.
    /// All are compared with some of its beams, then the best with all of them.
    pub fn fill(&mut self, count: usize, points: &[[f64; 2]], field: &LikelihoodField, random: &mut Random) {
        self.some.clear();
        self.some.extend(points.iter().step_by(points.len().div_ceil(SOME_BEAMS).max(1)));
        self.drawn.clear();
        self.drawn.extend((0..count).map_while(|_| {
            let pose = field.random_pose(random)?;
            Some((field.score(&pose, &self.some, &[]).log_likelihood(), pose))
        }));
        let best = (self.drawn.len() / BEST).max(1).min(self.drawn.len());
        if best < self.drawn.len() {
            self.drawn.select_nth_unstable_by(best, |(a, _), (b, _)| b.total_cmp(a));
        }
        self.drawn.truncate(best);
        self.cumulative.clear();
        let full = self.drawn.iter().map(|(_, pose)| field.score(pose, points, &[]).log_likelihood());
        self.cumulative.extend(full);
        let best = self.cumulative.iter().copied().fold(f64::NEG_INFINITY, math::max);
        let mut sum = 0.0;
        for weight in &mut self.cumulative {
            sum += math::exp(TEMPER * (*weight - best));
            *weight = sum;
        }
    }

    /// Draws a pose by its weight; `None` without one.
    pub fn draw(&self, random: &mut Random) -> Option<Pose2> {
        let draw = random.unit() * self.cumulative.last()?;
        let at = self.cumulative.partition_point(|sum| *sum <= draw);
        self.drawn.get(at.min(self.drawn.len() - 1)).map(|(_, pose)| *pose)
    }
}
