//! Benchmark of an update by a scan, milliseconds.
//! 2,000 particles, 60 beams, a map of 120 m by 50 m.
#![allow(clippy::disallowed_methods, reason = "a bench measures real time")]
#![allow(clippy::unwrap_used, reason = "a bench that can't go on ends")]

use std::time::Instant;

use slate_grid::Geometry;
use slate_interfaces::Pose2;
use slate_localization::{
    KldSampling, LikelihoodField, MonteCarloLocalization, MonteCarloParameters, SensorModel,
};
use slate_module::{Random, math};

fn main() {
    let geometry = Geometry::new([0.0, 0.0], [120.0, 50.0], 0.05, 10_000_000).unwrap();
    // Rooms of 5 m.
    let is_wall = |cell: usize| {
        let (column, row) = (cell % geometry.width, cell / geometry.width);
        column % 100 == 0 || row % 100 == 0
    };
    let begin = Instant::now();
    let field = LikelihoodField::new(geometry, is_wall, |_| true, SensorModel::default()).unwrap();
    let took = begin.elapsed();
    println!("likelihood field of {} cells: {:.0} ms", geometry.cells(), 1e3 * took.as_secs_f64());
    let points: Vec<[f64; 2]> = (0..60)
        .map(|k| {
            let bearing = f64::from(k) * 2.0 * std::f64::consts::PI / 60.0;
            [2.4 * math::cos(bearing), 2.4 * math::sin(bearing)]
        })
        .collect();
    println!("{:<40}{:>10}{:>10}{:>10}", "update, ms", "p50", "p99", "max");
    report("a pose that is known", false, &field, &points);
    report("a pose that may be anywhere", true, &field, &points);
}

fn report(name: &str, is_global: bool, field: &LikelihoodField, points: &[[f64; 2]]) {
    let sampling = KldSampling { min_particles: 2_000, max_particles: 2_000, pf_err: 0.05, pf_z: 0.99 };
    let parameters = MonteCarloParameters { sampling, ..MonteCarloParameters::default() };
    let mut random = Random::new(1, "update");
    let mut localization = MonteCarloLocalization::new(parameters).unwrap();
    let pose = Pose2 { x: 62.5, y: 27.5, theta: 0.0 };
    let mut times: Vec<f64> = (0..500)
        .map(|step| {
            if is_global {
                localization.initialize_globally(field, &mut random);
            } else if step == 0 {
                localization.initialize(pose, [0.2, 0.2, 0.1], &mut random);
            }
            let odometry = Pose2 { x: 0.3 * f64::from(step), y: 0.0, theta: 0.0 };
            let begin = Instant::now();
            localization.update(odometry, points, field, &mut random);
            let _ = std::hint::black_box(localization.estimate());
            1e3 * begin.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    println!("{name:<40}{:>10.2}{:>10.2}{:>10.2}", at(0.5), at(0.99), at(1.0));
}
