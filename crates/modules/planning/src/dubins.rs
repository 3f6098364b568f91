//! Shortest paths forward.

use slate_interfaces::Pose2;
use slate_module::math;

use crate::steering_path::{PathPenalties, SteeringPath, SteeringPosition, normalized, positive};

/// Returns the shortest path of a forward-only robot (Dubins curve).
/// The smallest turning radius is in meters (Dubins, 1957, *On curves of minimal length with a constraint on average
/// curvature*; words as in Shkel and Lumelsky, 2001, *Classification of the Dubins set*, section 3).
pub fn dubins(start: &Pose2, end: &Pose2, turning_radius: f64) -> SteeringPath {
    best(start, end, turning_radius, &PathPenalties { reverse: 1.0, non_straight: 1.0, change: 0.0 })
}

/// Returns the cheapest of the words.
pub(crate) fn best(
    start: &Pose2,
    end: &Pose2,
    turning_radius: f64,
    penalties: &PathPenalties,
) -> SteeringPath {
    let [x, y, turn] = normalized(start, end, turning_radius);
    let distance = math::hypot(x, y);
    let direction = if distance > 0.0 { math::atan2(y, x) } else { 0.0 };
    let words = words(distance, positive(-direction), positive(turn - direction));
    let paths = words.into_iter().flatten().map(|word| SteeringPath::new(&word, turning_radius));
    let cheaper = |a: &SteeringPath, b: &SteeringPath| a.cost(penalties).total_cmp(&b.cost(penalties));
    // One of LSL and RSR exists always.
    paths.min_by(cheaper).unwrap_or_default()
}

type DubinsWord = Option<[(SteeringPosition, f64); 3]>;

/// Returns the six words between poses at a distance.
/// Their headings differ by `alpha` and `beta` from the line between them.
fn words(distance: f64, alpha: f64, beta: f64) -> [DubinsWord; 6] {
    use SteeringPosition::{Left, Right, Straight};
    let ([sin_a, cos_a], [sin_b, cos_b]) =
        ([math::sin(alpha), math::cos(alpha)], [math::sin(beta), math::cos(beta)]);
    let cosine = math::cos(alpha - beta);
    let square = distance * distance;
    let straight = |square: f64| (square >= 0.0).then(|| square.sqrt());
    let arc =
        |cosine: f64| (cosine.abs() <= 1.0).then(|| positive(std::f64::consts::TAU - math::acos(cosine)));
    let word = |[a, b, c]: [SteeringPosition; 3], t: f64, p: f64, q: f64| {
        [(a, positive(t)), (b, p), (c, positive(q))]
    };
    let lsl = straight(2.0 + square - 2.0 * cosine + 2.0 * distance * (sin_a - sin_b)).map(|p| {
        let angle = math::atan2(cos_b - cos_a, distance + sin_a - sin_b);
        word([Left, Straight, Left], angle - alpha, p, beta - angle)
    });
    let rsr = straight(2.0 + square - 2.0 * cosine - 2.0 * distance * (sin_a - sin_b)).map(|p| {
        let angle = math::atan2(cos_a - cos_b, distance - sin_a + sin_b);
        word([Right, Straight, Right], alpha - angle, p, angle - beta)
    });
    let lsr = straight(square - 2.0 + 2.0 * cosine + 2.0 * distance * (sin_a + sin_b)).map(|p| {
        let angle = math::atan2(-cos_a - cos_b, distance + sin_a + sin_b) - math::atan2(-2.0, p);
        word([Left, Straight, Right], angle - alpha, p, angle - beta)
    });
    let rsl = straight(square - 2.0 + 2.0 * cosine - 2.0 * distance * (sin_a + sin_b)).map(|p| {
        let angle = math::atan2(cos_a + cos_b, distance - sin_a - sin_b) - math::atan2(2.0, p);
        word([Right, Straight, Left], alpha - angle, p, beta - angle)
    });
    let rlr = arc((6.0 - square + 2.0 * cosine + 2.0 * distance * (sin_a - sin_b)) / 8.0).map(|p| {
        let t = alpha - math::atan2(cos_a - cos_b, distance - sin_a + sin_b) + 0.5 * p;
        word([Right, Left, Right], t, p, alpha - beta - t + p)
    });
    let lrl = arc((6.0 - square + 2.0 * cosine - 2.0 * distance * (sin_a - sin_b)) / 8.0).map(|p| {
        let t = -alpha - math::atan2(cos_a - cos_b, distance + sin_a - sin_b) + 0.5 * p;
        word([Left, Right, Left], t, p, beta - alpha - t + p)
    });
    [lsl, rsr, lsr, rsl, rlr, lrl]
}
