//! Refinement of a pose against the surfaces of a map.

use nalgebra::{Matrix3, Vector3};
use slate_interfaces::Pose2;
use slate_module::math;

use crate::se2;
use crate::surface_map::SurfaceMap;

/// Standard deviation of a point beside its surface, m.
/// It is larger than the noise of the laser, as errors of neighboring points are not independent.
const SIGMA: f64 = 0.1;
/// Standard deviation of a point beside its surface in the likelihood of a scan, m.
const LIKELIHOOD_SIGMA: f64 = 0.05;
/// Residual at which a point has a quarter of its weight (Geman and McClure), m.
const ROBUST_SCALE: f64 = 0.06;
/// Largest ratio of variances across and along a surface with a known normal.
const STRAIGHT: f64 = 0.2;
/// Weight of a point without a surface direction, such as a corner.
/// It is relative to that of a point beside a surface.
const POINT_WEIGHT: f64 = 0.1;
/// Maximum number of Gauss-Newton iterations.
const ITERATIONS: usize = 12;
/// Change of a pose below which it counts as found, m and rad.
const CONVERGED: f64 = 1e-4;

/// Fit of a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Refined {
    /// Pose in the map's frame.
    pub pose: Pose2,
    /// Inverse covariance of x, y and theta by the points alone, without the prior.
    pub information: Matrix3<f64>,
    /// Share of points that lie on surfaces, 0 to 1.
    pub inliers: f64,
}

/// Prior of a pose: its mean, and its inverse covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PosePrior {
    pub mean: Pose2,
    pub information: Matrix3<f64>,
}

/// Point's residual: its distance from a surface along up to two directions.
struct Residual {
    directions: [[f64; 2]; 2],
    distances: [f64; 2],
    /// Weight of each direction.
    weights: [f64; 2],
}

/// Refines a pose by Gauss-Newton on point-to-line distances.
/// Lines go through nearby points of the map (point to line: Censi, 2008, *An ICP variant using a point-to-line
/// metric*; they are least-squares fits weighed by distance, moving least squares). `radius` is the reach of surfaces,
/// m.
pub(crate) fn refine(
    map: &SurfaceMap,
    points: &[[f64; 2]],
    guess: Pose2,
    radius: f64,
    prior: Option<PosePrior>,
) -> Refined {
    let mut pose = guess;
    let mut system = NormalEquations::new(map, points, pose, radius);
    for _ in 0..ITERATIONS {
        let (mut hessian, mut gradient) = (system.hessian, system.gradient);
        if let Some(PosePrior { mean, information }) = prior {
            let error =
                Vector3::new(pose.x - mean.x, pose.y - mean.y, math::angle_between(mean.theta, pose.theta));
            hessian += information;
            gradient += information * error;
        }
        // Directions of which nothing is known keep the guess.
        hessian += Matrix3::identity() * 1e-6;
        let Some(inverse) = hessian.try_inverse() else { break };
        let step = -(inverse * gradient);
        pose = Pose2 { x: pose.x + step.x, y: pose.y + step.y, theta: math::wrap_angle(pose.theta + step.z) };
        system = NormalEquations::new(map, points, pose, radius);
        if step.amax() < CONVERGED {
            break;
        }
    }
    Refined { pose, information: system.hessian, inliers: system.inliers / points.len().max(1) as f64 }
}

/// Returns the logarithm of the likelihood of a scan at a pose, but for a constant.
pub(crate) fn log_likelihood(map: &SurfaceMap, points: &[[f64; 2]], pose: Pose2, radius: f64) -> f64 {
    let square = |point: [f64; 2]| {
        let square = residual(map, point, radius).map_or(f64::INFINITY, |residual| {
            residual.distances.iter().map(|distance| distance * distance).sum()
        });
        // A point that hits nothing known is as unlikely as one at the border.
        math::min(square, ROBUST_SCALE * ROBUST_SCALE)
    };
    let sum: f64 = se2::transform_all(pose, points).map(square).sum();
    -0.5 * sum / (LIKELIHOOD_SIGMA * LIKELIHOOD_SIGMA)
}

/// Normal equations at a pose.
struct NormalEquations {
    hessian: Matrix3<f64>,
    gradient: Vector3<f64>,
    inliers: f64,
}

impl NormalEquations {
    fn new(map: &SurfaceMap, points: &[[f64; 2]], pose: Pose2, radius: f64) -> Self {
        let mut system = Self { hessian: Matrix3::zeros(), gradient: Vector3::zeros(), inliers: 0.0 };
        for point in se2::transform_all(pose, points) {
            let Some(residual) = residual(map, point, radius) else { continue };
            // The point moves across its direction from the pose as this turns.
            let (right, up) = (point[0] - pose.x, point[1] - pose.y);
            for ([x, y], (distance, weight)) in
                residual.directions.into_iter().zip(residual.distances.into_iter().zip(residual.weights))
            {
                let share = distance / ROBUST_SCALE;
                let robust = 1.0 / ((1.0 + share * share) * (1.0 + share * share));
                let weight = robust * weight / (SIGMA * SIGMA);
                let jacobian = Vector3::new(x, y, y * right - x * up);
                system.hessian += jacobian * jacobian.transpose() * weight;
                system.gradient += jacobian * (weight * distance);
            }
            let square: f64 = residual.distances.iter().map(|distance| distance * distance).sum();
            system.inliers += f64::from(u8::from(square < ROBUST_SCALE * ROBUST_SCALE));
        }
        system
    }
}

/// Returns the distance of a point from the map's surface.
/// `None` if none is within the radius.
fn residual(map: &SurfaceMap, point: [f64; 2], radius: f64) -> Option<Residual> {
    let low = map.place([point[0] - radius, point[1] - radius]);
    let high = map.place([point[0] + radius, point[1] + radius]);
    // Moments about the point.
    let (mut sum, mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let scale = 1.0 / (radius * radius);
    map.for_each_near(low, high, |cell| {
        let (right, up) = (f64::from(cell.x) - point[0], f64::from(cell.y) - point[1]);
        let near = 1.0 - (right * right + up * up) * scale;
        if near > 0.0 {
            let weight = near * near;
            sum += weight;
            x += weight * right;
            y += weight * up;
            xx += weight * right * right;
            xy += weight * right * up;
            yy += weight * up * up;
        }
    });
    if sum <= 0.0 {
        return None;
    }
    let (x, y) = (x / sum, y / sum);
    let (xx, xy, yy) = (xx / sum - x * x, xy / sum - x * y, yy / sum - y * y);
    // Variances across and along the surface, and its normal.
    let half = (xx + yy) / 2.0;
    let root = math::hypot((xx - yy) / 2.0, xy);
    let (across, along) = (half - root, half + root);
    let [right, up] = if xx > yy { [xy, across - xx] } else { [across - yy, xy] };
    let length = math::hypot(right, up);
    let resolution = map.resolution();
    let is_line = across < STRAIGHT * along && along > 0.1 * resolution * resolution && length > 0.0;
    Some(if is_line {
        let normal = [right / length, up / length];
        let distance = -(x * normal[0] + y * normal[1]);
        Residual { directions: [normal, [0.0; 2]], distances: [distance, 0.0], weights: [1.0, 0.0] }
    } else {
        Residual { directions: [[1.0, 0.0], [0.0, 1.0]], distances: [-x, -y], weights: [POINT_WEIGHT; 2] }
    })
}
