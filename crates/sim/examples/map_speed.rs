//! Benchmark of the real-time factor of a Pioneer with a laser in a large map.
//! It also has sonars and odometry. The map has 120 m by 50 m, or is the `map.yaml` that is named behind `--`. The
//! laser has 541 beams at 10 Hz or 1,081 at 40 Hz; the robot is alone or among 20 people. `cargo run --release -p
//! slate-sim --example map_speed`.

// Wall time is what is measured here.
#![allow(clippy::disallowed_methods)]

use std::error::Error;
use std::time::{Duration, Instant};

use slate_grid::{Geometry, OccupancyMap, RayCaster};
use slate_map_file::read_map;
use slate_module::Random;
use slate_sim::geometry::{Polygon, Pose};
use slate_sim::people::PeopleDescription;
use slate_sim::robot::{LaserDescription, RobotDescription};
use slate_sim::script::RandomWalk;
use slate_sim::world::World;
use slate_sim::{MovingBodies, Placement, Simulation};

const STEP: u64 = 10_000_000;
const SECONDS: usize = 300;

fn main() -> Result<(), Box<dyn Error>> {
    let map = match std::env::args().nth(1) {
        Some(file) => read_map(file.as_ref())?,
        None => hospital().ok_or("no map")?,
    };
    let world = World::from_map("map", &map)?;
    let (width, height) = (map.geometry.width, map.geometry.height);
    println!("{width} x {height} cells of {} m, {} walls", map.geometry.resolution, world.bodies.len());
    println!(
        "| people | beams | rate | times real time by processor time | cycle of 20 ms: p50 | p99 | max |"
    );
    println!("|---|---|---|---|---|---|---|");
    for people in [0, 20] {
        for (beams, rate) in [(541, 10.0), (1081, 40.0)] {
            measure(&world, free_pose(&map), people, beams, rate)?;
        }
    }
    Ok(())
}

fn measure(world: &World, pose: Pose, count: usize, beams: u32, rate: f64) -> Result<(), Box<dyn Error>> {
    let mut description = RobotDescription::load("pioneer_p3dx")?;
    let laser = description.laser.remove("utm_30lx").ok_or("no such laser")?;
    let laser = LaserDescription { beams, rate: Some(rate), ..laser };
    let robot = Placement {
        name: "r1".into(),
        description,
        sonar: "real".into(),
        pose,
        script: Some(RandomWalk::default()),
    };
    let mut moving = MovingBodies::default();
    if count > 0 {
        let people: PeopleDescription = serde_json::from_str(&format!(r#"{{"count": {count}}}"#))?;
        let mut outline = Polygon::default();
        robot.description.outline().place(&pose.frame(), &mut outline);
        moving.people = Some(people.lay_out(world, &[outline], 1)?);
    }
    let mut simulation = Simulation::with_moving(world, &[robot], &moving, 1, STEP)?;
    simulation.mount_laser(0, &laser, 1);
    let mut times = Vec::with_capacity(SECONDS * 50);
    let begin = processor_time();
    // Two steps of the physics in each cycle of 20 ms, as an agent has them.
    for _ in 0..SECONDS * 50 {
        let start = Instant::now();
        simulation.step();
        simulation.step();
        simulation.sense();
        times.push(start.elapsed());
    }
    let all: Duration = times.iter().sum();
    // On a machine that others use the wall time is no measure.
    let all = processor_time().zip(begin).map_or(all, |(end, begin)| end - begin);
    times.sort_unstable();
    let microseconds = |share: f64| times[((times.len() - 1) as f64 * share) as usize].as_secs_f64() * 1e6;
    println!(
        "| {count} | {beams} | {rate} Hz | {:.0} | {:.0} us | {:.0} us | {:.0} us |",
        SECONDS as f64 / all.as_secs_f64(),
        microseconds(0.5),
        microseconds(0.99),
        microseconds(1.0),
    );
    Ok(())
}

/// Time that this thread has had a processor, where the system tells it.
fn processor_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse().ok().map(Duration::from_nanos)
}

/// Rooms of 5 m with doors, some of them furnished.
fn hospital() -> Option<OccupancyMap> {
    let geometry = Geometry::new([0.0, 0.0], [120.0, 50.0], 0.05, 10_000_000)?;
    let mut cells = vec![0; geometry.cells()];
    for (cell, occupancy) in cells.iter_mut().enumerate() {
        let (column, row) = (cell % geometry.width, cell / geometry.width);
        let is_edge = column < 2 || row < 2 || column + 2 >= geometry.width || row + 2 >= geometry.height;
        let is_door = (40..62).contains(&(column % 100)) || (40..62).contains(&(row % 100));
        let is_wall = (column % 100 < 2 || row % 100 < 2) && !is_door;
        if is_edge || is_wall {
            *occupancy = 100;
        }
    }
    let mut random = Random::new(1, "furniture");
    for _ in 0..1_000 {
        let at = |random: &mut Random, most: usize| (random.unit() * (most - 30) as f64) as usize;
        let (left, low) = (at(&mut random, geometry.width), at(&mut random, geometry.height));
        for row in low..low + at(&mut random, 45) {
            cells[row * geometry.width + left..row * geometry.width + left + 14].fill(100);
        }
    }
    Some(OccupancyMap { geometry, cells })
}

/// A pose that is far from all walls.
fn free_pose(map: &OccupancyMap) -> Pose {
    let caster = RayCaster::new(map.geometry, |cell| map.cells[cell] >= 50);
    let mut random = Random::new(1, "pose");
    let middle = map.geometry.center(map.geometry.width / 2, map.geometry.height / 2);
    loop {
        let [x, y] = [middle.x, middle.y].map(|part| part + random.uniform(-10.0, 10.0));
        let is_far = |k: i32| {
            let angle = f64::from(k) * 0.1;
            let along = [slate_module::math::cos(angle), slate_module::math::sin(angle)];
            caster.range([x, y], along, 1.0).is_infinite()
        };
        if !caster.is_occupied(x, y) && (0..63).all(is_far) {
            return Pose { x, y, theta: 0.0 };
        }
    }
}
