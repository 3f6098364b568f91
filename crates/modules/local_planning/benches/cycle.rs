//! Benchmark of a local planning cycle, milliseconds.
//! A cycle is a distance field of the ends of 361 beams, and a plan on it.
#![allow(clippy::disallowed_methods, reason = "a bench measures real time")]
#![allow(clippy::unwrap_used, reason = "a bench that can't go on ends")]

use std::time::Instant;

use slate_avoidance::Footprint;
use slate_interfaces::{Point2, Pose2};
use slate_local_planning::{
    Dwa, DwaParameters, MotionLimits, MotionState, Mppi, MppiParameters, ObstacleField, PlanarVelocity,
};
use slate_module::{Random, math};

/// Beams of a scan over 270 degrees.
const BEAMS: u32 = 361;
const PERIOD: f64 = 0.05;

fn main() {
    let footprint =
        Footprint::new(&[[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]]).unwrap();
    println!("{:<40}{:>10}{:>10}{:>10}", "cycle, ms", "p50", "p99", "max");
    for (name, size) in [("field of 6 m", 6.0), ("field of 10 m", 10.0)] {
        let mut field = ObstacleField::new(size, 0.05).unwrap();
        report(name, |pose, _| {
            field.update([pose.x, pose.y], scan(pose).into_iter());
            None
        });
    }
    let limits = MotionLimits { vx_max: 2.0, ..MotionLimits::default() };
    for (name, limits) in [("MPPI at 0.5 m/s", MotionLimits::default()), ("MPPI at 2 m/s", limits)] {
        let parameters =
            MppiParameters { limits, prune_distance: 3.4 * limits.vx_max, ..MppiParameters::default() };
        let mut planner = Mppi::new(parameters, &footprint, Random::new(1, "bench")).unwrap();
        // As far as it drives within the horizon.
        let mut field = ObstacleField::new(math::max(6.0, 6.0 * limits.vx_max), 0.05).unwrap();
        report(name, |pose, velocity| {
            field.update([pose.x, pose.y], scan(pose).into_iter());
            let robot = MotionState { pose: *pose, velocity };
            planner.plan(&robot, &path(), None, &field)
        });
    }
    let mut planner = Dwa::new(DwaParameters::default(), &footprint).unwrap();
    let mut field = ObstacleField::new(6.0, 0.05).unwrap();
    report("DWA at 0.5 m/s", |pose, velocity| {
        field.update([pose.x, pose.y], scan(pose).into_iter());
        planner.plan(&MotionState { pose: *pose, velocity }, &path(), &field)
    });
}

/// Returns a path that winds between columns.
fn path() -> Vec<Point2> {
    (0..200).map(|k| 0.1 * f64::from(k)).map(|x| Point2 { x, y: 0.35 * math::sin(2.0 * x) }).collect()
}

/// Returns the ends of beams at columns of 0.3 m on both sides of the path.
/// The columns stand 1.5 m apart.
fn scan(pose: &Pose2) -> Vec<[f64; 2]> {
    let columns = (0..30).map(|k| {
        let x = 0.75 * f64::from(k);
        [x, if k % 2 == 0 { 0.35 * math::sin(2.0 * x) + 0.8 } else { 0.35 * math::sin(2.0 * x) - 0.8 }]
    });
    let columns: Vec<[f64; 2]> = columns.collect();
    (0..BEAMS)
        .map(|k| {
            let bearing = pose.theta - 2.356 + 4.712 * f64::from(k) / f64::from(BEAMS - 1);
            let (across, up) = (math::cos(bearing), math::sin(bearing));
            let range = columns
                .iter()
                .filter_map(|[x, y]| hit([x - pose.x, y - pose.y], [across, up], 0.15))
                .fold(4.0, math::min);
            [pose.x + range * across, pose.y + range * up]
        })
        .collect()
}

/// Returns the range at which a ray hits a column.
fn hit([x, y]: [f64; 2], [across, up]: [f64; 2], radius: f64) -> Option<f64> {
    let along = x * across + y * up;
    let square = radius * radius - (x * x + y * y - along * along);
    (square >= 0.0 && along > 0.0).then(|| along - square.sqrt())
}

/// Drives for 20 s, and prints the times of cycles.
fn report(name: &str, mut cycle: impl FnMut(&Pose2, PlanarVelocity) -> Option<PlanarVelocity>) {
    let mut pose = Pose2 { x: 0.0, y: 0.0, theta: 0.6 };
    let mut velocity = PlanarVelocity::ZERO;
    let mut times: Vec<f64> = (0..400)
        .map(|_| {
            if pose.x > 14.0 {
                (pose, velocity) = (Pose2 { x: 0.0, y: 0.0, theta: 0.6 }, PlanarVelocity::ZERO);
            }
            let begin = Instant::now();
            let command = std::hint::black_box(cycle(&pose, velocity));
            let took = 1e3 * begin.elapsed().as_secs_f64();
            velocity = command.unwrap_or(PlanarVelocity::ZERO);
            pose.x += PERIOD * velocity.vx * math::cos(pose.theta);
            pose.y += PERIOD * velocity.vx * math::sin(pose.theta);
            pose.theta += PERIOD * velocity.wz;
            took
        })
        .collect();
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    println!("{name:<40}{:>10.2}{:>10.2}{:>10.2}", at(0.5), at(0.99), at(1.0));
}
