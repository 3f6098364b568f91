//! Benchmark of the real-time factor of wandering Pioneers with 16 sonars at 10 Hz.
//! They are among boxes, with one robot per 4 square meters: `cargo run --release -p slate-sim --example speed`.
//! Numbers of robots can be named behind `--`.
//!
//! A step of the physics is 10 ms long, and every tenth ends with the sonars' sweep. With a `rate` of 3 Hz each sonar
//! sounds 3 times per second, as those of the real ring.

// Wall time is what is measured here.
#![allow(clippy::disallowed_methods)]

use std::error::Error;
use std::time::{Duration, Instant};

use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::script::RandomWalk;
use slate_sim::world::{Body, Bounds, Scenery, World};
use slate_sim::{Placement, Simulation};

/// Meters from robot to robot at the start.
const SPACING: f64 = 2.0;

const STEP: u64 = 10_000_000;

fn main() -> Result<(), Box<dyn Error>> {
    let named: Vec<usize> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let counts = if named.is_empty() { vec![1, 10, 100, 1000, 5000] } else { named };
    println!("| robots | sonars | rate | threads | times real time | step p50 | p99 | max | digest |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for count in counts {
        for (profile, rate) in [("vrep", None), ("vrep", Some(3.0)), ("real", None), ("real", Some(3.0))] {
            for threads in [1, 2] {
                measure(count, profile, rate, threads)?;
            }
        }
    }
    Ok(())
}

fn measure(count: usize, profile: &str, rate: Option<f64>, threads: usize) -> Result<(), Box<dyn Error>> {
    let (world, robots) = lay_out(count, profile, rate)?;
    let mut simulation = Simulation::new(&world, &robots, 1, STEP)?;
    simulation.set_threads(threads);
    // As long as a few seconds allow, and the same for all rows of a number of robots.
    let seconds = (10_000 / count).clamp(5, 2000);
    let mut times = Vec::with_capacity(seconds * 100);
    for step in 0..seconds * 100 {
        let start = Instant::now();
        simulation.step();
        if step % 10 == 9 {
            simulation.sense();
        }
        times.push(start.elapsed());
    }
    let all: Duration = times.iter().sum();
    times.sort_unstable();
    let microseconds = |share: f64| times[((times.len() - 1) as f64 * share) as usize].as_secs_f64() * 1e6;
    println!(
        "| {count} | {profile} | {} | {threads} | {:.1} | {:.1} us | {:.1} us | {:.1} us | {:016x} |",
        rate.map_or_else(|| "10 Hz".into(), |rate: f64| format!("{rate} Hz")),
        seconds as f64 / all.as_secs_f64(),
        microseconds(0.5),
        microseconds(0.99),
        microseconds(1.0),
        digest(&simulation),
    );
    Ok(())
}

/// A square with walls, robots in rows, and a box between for every tenth of them.
fn lay_out(
    count: usize,
    profile: &str,
    rate: Option<f64>,
) -> Result<(World, Vec<Placement>), Box<dyn Error>> {
    let mut description = RobotDescription::load("pioneer_p3dx")?;
    description.sonar.get_mut(profile).ok_or("no such profile")?.rate = rate;
    let row = (count as f64).sqrt().ceil();
    let side = (row + 1.0) * SPACING;
    let half = side / 2.0;
    let walls = [("east", half, 0.0), ("west", -half, 0.0), ("north", 0.0, half), ("south", 0.0, -half)];
    let bodies = walls.map(|(name, x, y)| {
        let size = if y == 0.0 { [0.1, side] } else { [side, 0.1] };
        Body::rectangle(name, [x, y], size)
    });
    let bounds = Bounds { minimum: [-half; 2], maximum: [half; 2] };
    let mut world = World {
        name: "square".into(),
        bounds,
        bodies: bodies.into(),
        scenery: Scenery::default(),
        map: None,
    };
    let mut robots = Vec::new();
    for i in 0..count {
        let (x, y) = (i as f64 % row, (i as f64 / row).floor());
        let (x, y) = ((x - (row - 1.0) / 2.0) * SPACING, (y - (row - 1.0) / 2.0) * SPACING);
        if i % 10 == 0 {
            world.bodies.push(Body::rectangle(&format!("box{i}"), [x + 1.0, y + 1.0], [0.5, 0.5]));
        }
        robots.push(Placement {
            name: format!("r{i}"),
            description: description.clone(),
            sonar: profile.into(),
            pose: Pose { x, y, theta: (i * 7 % 6) as f64 },
            script: Some(RandomWalk::default()),
        });
    }
    Ok((world, robots))
}

/// A number that is another one when any pose or echo has another bit.
fn digest(simulation: &Simulation) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut add = |number: f64| hash = (hash ^ number.to_bits()).wrapping_mul(0x0100_0000_01b3);
    for robot in 0..simulation.robot_count() {
        let pose = simulation.pose(robot);
        [pose.x, pose.y, pose.theta].into_iter().for_each(&mut add);
        let echoes = simulation.sonar(robot).map_or(&[][..], |(echoes, _)| echoes);
        echoes.iter().for_each(|echo| add(echo.range));
    }
    hash
}
