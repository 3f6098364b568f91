//! A building with a corridor around a block, and a robot that drives round in it.

use slate_interfaces::Pose2;
use slate_module::{Random, math};
use slate_slam::se2;

/// Ends of the walls, m.
type Wall = [[f64; 2]; 2];

/// Boxes: left, bottom, right, top. The first is the building; the others stand in it, and no two sides of the corridor
/// are alike.
const BOXES: [[f64; 4]; 9] = [
    [0.0, 0.0, 16.0, 12.0],
    [3.0, 3.0, 13.0, 9.0],
    [5.0, 0.0, 5.6, 0.7],
    [8.0, 0.0, 9.5, 0.4],
    [15.2, 3.0, 16.0, 3.5],
    [15.5, 6.0, 16.0, 7.7],
    [10.0, 11.5, 10.8, 12.0],
    [6.0, 11.0, 6.3, 12.0],
    [0.0, 5.0, 0.6, 5.9],
];
/// Corners of the path, m.
const PATH: [[f64; 2]; 4] = [[1.6, 1.6], [14.3, 1.5], [14.4, 10.3], [1.5, 10.4]];
/// Beams of the laser, which looks over 180 degrees.
const BEAMS: usize = 180;

/// A step of the drive.
pub struct Step {
    /// Where the robot is, in the frame of its first pose.
    pub truth: Pose2,
    /// Where its odometry says it is.
    pub odometry: Pose2,
    /// Ends of beams in its frame.
    pub points: Vec<[f64; 2]>,
}

/// Drives that many times round the block, a scan every 0.4 m, with an odometry that turns too far by 2 degrees a
/// meter.
pub fn drive(rounds: usize, seed: u64) -> Vec<Step> {
    let mut random = Random::new(seed, "drive");
    let walls: Vec<Wall> = BOXES.iter().flat_map(|sides| walls_of(*sides)).collect();
    let poses = poses(rounds);
    let mut odometry = Pose2::default();
    let mut before = poses[0];
    let step = |pose: &Pose2| {
        let mut moved = se2::relative(before, *pose);
        let length = math::hypot(moved.x, moved.y);
        moved.x *= 1.02 + 0.02 * random.normal();
        moved.theta += 0.035 * length + 0.02 * moved.theta * random.normal();
        odometry = se2::compose(odometry, moved);
        before = *pose;
        Step { truth: se2::relative(poses[0], *pose), odometry, points: scan(&walls, *pose, &mut random) }
    };
    poses.iter().map(step).collect()
}

fn poses(rounds: usize) -> Vec<Pose2> {
    let mut poses = Vec::new();
    for corner in 0..rounds * PATH.len() {
        let [from, to, after] = [0, 1, 2].map(|k| PATH[(corner + k) % PATH.len()]);
        let (right, up) = (to[0] - from[0], to[1] - from[1]);
        let heading = math::atan2(up, right);
        let steps = (math::hypot(right, up) / 0.4) as usize;
        for k in 0..steps {
            let share = k as f64 / steps as f64;
            poses.push(Pose2 { x: from[0] + share * right, y: from[1] + share * up, theta: heading });
        }
        let turn = math::angle_between(heading, math::atan2(after[1] - to[1], after[0] - to[0]));
        for k in 0..3 {
            poses.push(Pose2 { x: to[0], y: to[1], theta: heading + turn * f64::from(k) / 3.0 });
        }
    }
    poses
}

fn walls_of([left, bottom, right, top]: [f64; 4]) -> [Wall; 4] {
    let corners = [[left, bottom], [right, bottom], [right, top], [left, top]];
    [0, 1, 2, 3].map(|k| [corners[k], corners[(k + 1) % 4]])
}

/// Ranges with noise of 1 cm.
fn scan(walls: &[Wall], pose: Pose2, random: &mut Random) -> Vec<[f64; 2]> {
    let beam = |k: usize| {
        let bearing = std::f64::consts::PI * (k as f64 / BEAMS as f64 - 0.5);
        let direction = [math::cos(pose.theta + bearing), math::sin(pose.theta + bearing)];
        let ranges = walls.iter().filter_map(|wall| range(wall, pose, direction));
        let range = ranges.fold(f64::INFINITY, math::min) + 0.01 * random.normal();
        [range * math::cos(bearing), range * math::sin(bearing)]
    };
    (0..BEAMS).map(beam).collect()
}

/// Distance along a beam to a wall.
fn range([from, to]: &Wall, pose: Pose2, [x, y]: [f64; 2]) -> Option<f64> {
    let (right, up) = (to[0] - from[0], to[1] - from[1]);
    let across = x * up - y * right;
    let (left, low) = (from[0] - pose.x, from[1] - pose.y);
    let range = (left * up - low * right) / across;
    let share = (left * y - low * x) / across;
    (across != 0.0 && range > 0.0 && (0.0..=1.0).contains(&share)).then_some(range)
}

/// Largest distance between poses and the truth, m.
pub fn largest_error(poses: &[Pose2], steps: &[Step]) -> f64 {
    let apart = |(pose, step): (&Pose2, &Step)| math::hypot(pose.x - step.truth.x, pose.y - step.truth.y);
    poses.iter().zip(steps).map(apart).fold(0.0, math::max)
}
