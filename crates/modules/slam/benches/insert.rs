//! Benchmark of a scan's insertion, with loop closures.
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "a measurement reads the clock, and panics when it fails"
)]

use std::time::Instant;

use slate_interfaces::Pose2;
use slate_module::Random;
use slate_slam::{GraphSlam, GraphSlamParameters, ParticleSlam, ParticleSlamParameters};

#[path = "../tests/world.rs"]
mod world;

fn main() {
    let steps = world::drive(4, 1);
    println!("{:<40}{:>10}{:>10}{:>10}", format!("{} scans, ms", steps.len()), "p50", "p99", "max");
    let mut graph = GraphSlam::new(GraphSlamParameters::default()).unwrap();
    report("graph", &steps, |step| graph.insert(step.odometry, &step.points));
    let begin = Instant::now();
    graph.finish();
    println!("{:<40}{:>10.1}", "graph: finish", 1e3 * begin.elapsed().as_secs_f64());
    println!("{:<40}{:>10.3}", "graph: largest error, m", world::largest_error(graph.poses(), &steps));
    let mut filter = ParticleSlam::new(ParticleSlamParameters::default()).unwrap();
    let mut random = Random::new(1, "insert");
    report("particle filter", &steps, |step| filter.insert(step.odometry, &step.points, &mut random));
}

fn report(name: &str, steps: &[world::Step], mut insert: impl FnMut(&world::Step) -> Pose2) {
    let time = |step| {
        let begin = Instant::now();
        let _ = std::hint::black_box(insert(step));
        1e3 * begin.elapsed().as_secs_f64()
    };
    let mut times: Vec<f64> = steps.iter().map(time).collect();
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    println!("{name:<40}{:>10.2}{:>10.2}{:>10.2}", at(0.5), at(0.99), at(1.0));
}
