//! Beams that are left out.

use slate_interfaces::Particle;
use slate_module::math;

use crate::likelihood_field::LikelihoodField;
use crate::parameters::BeamSkip;

/// Selects the beams that enough particles explain.
/// All count, if most would be left out. `explained` is a buffer.
pub(crate) fn skip_beams(
    skip: &BeamSkip,
    particles: &[Particle],
    points: &[[f64; 2]],
    field: &LikelihoodField,
    (explained, counts): (&mut Vec<f64>, &mut Vec<bool>),
) {
    explained.clear();
    explained.resize(points.len(), 0.0);
    for Particle { pose, weight } in particles {
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        for ([x, y], explained) in points.iter().zip(&mut *explained) {
            let end = (pose.x + x * cosine - y * sine, pose.y + x * sine + y * cosine);
            if field.distance(end.0, end.1) < skip.distance {
                *explained += weight;
            }
        }
    }
    counts.extend(explained.iter().map(|share| *share > skip.threshold));
    let skipped = counts.iter().filter(|counts| !**counts).count() as f64;
    if skipped >= skip.error_threshold * points.len() as f64 {
        counts.fill(true);
    }
}
