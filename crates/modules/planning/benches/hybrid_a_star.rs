//! Benchmark of a search of Hybrid A*, milliseconds.
#![allow(clippy::disallowed_methods, reason = "a bench measures real time")]
#![allow(clippy::unwrap_used, reason = "a bench that can't go on ends")]

use std::time::Instant;

use slate_avoidance::Footprint;
use slate_grid::Geometry;
use slate_interfaces::Pose2;
use slate_module::Random;
use slate_planning::{DriveModel, FootprintGrid, HybridAStar, HybridAStarParameters};

/// Plans in a car park of 40 m by 40 m, cells of 0.1 m.
/// The car is 4.5 m by 1.8 m.
fn main() {
    let geometry = Geometry::new([0.0, 0.0], [40.0, 40.0], 0.1, 1_000_000).unwrap();
    // Rows of cars with lanes of 6 m between, every third place empty.
    let is_parked = |x: f64, y: f64| {
        let (row, place) = (y % 12.0, x % 2.5);
        let is_row = (6.0..11.0).contains(&row) && (4.0..36.0).contains(&x);
        is_row && (0.35..2.15).contains(&place) && !((x / 2.5) as u32).is_multiple_of(3)
    };
    let grid = FootprintGrid::new(geometry, |cell| {
        let center = geometry.center(cell % geometry.width, cell / geometry.width);
        is_parked(center.x, center.y)
    });
    println!("{:<40}{:>8}{:>10}{:>10}{:>10}{:>12}", "search, ms", "found", "p50", "p90", "max", "states p50");
    report("forward and in reverse", DriveModel::ReedsShepp, &grid);
    report("forward only", DriveModel::Dubins, &grid);
}

fn report(name: &str, drive_model: DriveModel, grid: &FootprintGrid) {
    let parameters = HybridAStarParameters {
        drive_model,
        minimum_turning_radius: 5.0,
        ..HybridAStarParameters::default()
    };
    let footprint = Footprint::new(&[[-1.0, -0.9], [3.5, -0.9], [3.5, 0.9], [-1.0, 0.9]]).unwrap();
    let mut planner = HybridAStar::new(parameters, footprint).unwrap();
    let mut random = Random::new(1, "poses");
    let (mut times, mut states) = (Vec::new(), Vec::new());
    for _ in 0..100 {
        let start = Pose2 { x: random.uniform(3.0, 37.0), y: 3.0, theta: random.uniform(-0.4, 0.4) };
        // An empty place.
        let place = (random.uniform(1.0, 4.0) as u32 * 3) as f64 * 2.5 + 1.25;
        let goal = Pose2 {
            x: place,
            y: 7.5 + 12.0 * random.uniform(0.0, 2.0).floor(),
            theta: std::f64::consts::FRAC_PI_2,
        };
        let begin = Instant::now();
        let is_found = planner.search(grid, start, goal).is_ok();
        if is_found {
            times.push(1e3 * begin.elapsed().as_secs_f64());
            states.push(planner.iterations());
        }
    }
    times.sort_by(f64::total_cmp);
    states.sort_unstable();
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    let middle = states[states.len() / 2];
    println!("{name:<40}{:>8}{:>10.1}{:>10.1}{:>10.1}{middle:>12}", times.len(), at(0.5), at(0.9), at(1.0));
}
