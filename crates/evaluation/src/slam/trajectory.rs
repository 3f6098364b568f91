//! Poses at the rate of the odometry.

use slate_interfaces::Pose2;
use slate_module::math;
use slate_slam::carmen::{LaserLog, LoggedPose};
use slate_slam::se2;
use slate_sorted::SortedMap;

/// Returns times, ascending, and poses of the odometry's lines.
/// They follow from the poses of scans: between two scans the odometry is bent so that it joins them, in proportion to
/// its motion.
pub fn trajectory(log: &LaserLog, poses: &[Pose2]) -> Vec<(f64, Pose2)> {
    let mut trajectory = Vec::with_capacity(log.odometry.len());
    for lines in log.odometry.chunk_by(|one, other| one.scans == other.scans) {
        let raw: Vec<Pose2> = lines.iter().map(|line| line.pose).collect();
        let before = lines[0].scans.checked_sub(1).map(|scan| (log.scans[scan].odometry, poses[scan]));
        let after = log.scans.get(lines[0].scans).zip(poses.get(lines[0].scans));
        let after = after.map(|(scan, pose)| (scan.odometry, *pose));
        let found = match (before, after) {
            (Some(before), Some(after)) => join(before, &raw, after),
            (Some((odometry, pose)), None) | (None, Some((odometry, pose))) => {
                raw.iter().map(|raw| se2::compose(pose, se2::relative(odometry, *raw))).collect()
            }
            (None, None) => raw,
        };
        trajectory.extend(found);
    }
    let mut trajectory: Vec<(f64, Pose2)> = spread_times(log).into_iter().zip(trajectory).collect();
    // Clocks of the laser and of the base do not agree.
    trajectory.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    trajectory
}

/// Returns the times of the odometry's lines, with rounding undone.
/// Those that the log has rounded to the same time are spread over the interval of times that are rounded to it.
fn spread_times(log: &LaserLog) -> Vec<f64> {
    let mut at_time: SortedMap<u64, Vec<usize>> = SortedMap::new();
    for (at, line) in log.odometry.iter().enumerate() {
        at_time.entry(line.time.to_bits()).or_default().push(at);
    }
    let mut times = vec![0.0; log.odometry.len()];
    for lines in at_time.values() {
        let time = log.odometry[lines[0]].time;
        let unit = rounding(time);
        for (k, line) in lines.iter().enumerate() {
            times[*line] = time + unit * ((k as f64 + 0.5) / lines.len() as f64 - 0.5);
        }
    }
    times
}

/// Returns true if exactly one line of the odometry has a time.
/// Times are compared up to their rounding.
pub fn is_one_line(log: &LaserLog, time: f64) -> bool {
    let is_same = |line: &&LoggedPose| (line.time - time).abs() <= 0.51 * rounding(line.time);
    log.odometry.iter().filter(is_same).count() == 1
}

/// Returns the unit of the last of six significant digits, as in the log.
fn rounding(time: f64) -> f64 {
    let mut unit = 1e-5;
    while time.abs() >= unit * 1e6 && unit < 1.0 {
        unit *= 10.0;
    }
    unit
}

/// Poses between two scans, each with its raw odometry and its pose.
fn join((start, from): (Pose2, Pose2), raw: &[Pose2], (end, to): (Pose2, Pose2)) -> Vec<Pose2> {
    let total = se2::relative(start, end);
    let missing = math::angle_between(total.theta, se2::relative(from, to).theta);
    // Headings first: each step turns a little more.
    let length = |one: Pose2, other: Pose2| {
        let step = se2::relative(one, other);
        math::hypot(step.x, step.y) + step.theta.abs()
    };
    let mut before = start;
    let mut traveled: Vec<f64> = Vec::with_capacity(raw.len() + 1);
    for pose in raw.iter().chain([&end]) {
        traveled.push(traveled.last().unwrap_or(&0.0) + length(before, *pose));
        before = *pose;
    }
    let whole = math::max(traveled.last().copied().unwrap_or(0.0), 1e-9);
    let (mut pose, mut before, mut share_before) = (from, start, 0.0);
    let mut bent = Vec::with_capacity(raw.len() + 1);
    for (raw, traveled) in raw.iter().chain([&end]).zip(&traveled) {
        let share = traveled / whole;
        let mut step = se2::relative(before, *raw);
        step.theta += missing * (share - share_before);
        pose = se2::compose(pose, step);
        bent.push((pose, share));
        (before, share_before) = (*raw, share);
    }
    // Then the rest of the way.
    let (right, up) = (to.x - pose.x, to.y - pose.y);
    bent.truncate(raw.len());
    let moved =
        |(pose, share): (Pose2, f64)| Pose2 { x: pose.x + share * right, y: pose.y + share * up, ..pose };
    bent.into_iter().map(moved).collect()
}
