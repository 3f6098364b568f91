//! Worlds that are maps of ROS.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_grid::{Geometry, LineCells, OccupancyMap};
use slate_module::{Random, math};
use slate_sim::geometry::{Point, Pose};
use slate_sim::robot::{LaserDescription, RobotDescription};
use slate_sim::world::World;
use slate_sim::{Placement, Simulation};

const STEP: u64 = 10_000_000;

/// A hall of 12 m by 9 m with pillars that a seed places.
fn hall() -> OccupancyMap {
    let geometry = Geometry::new([-2.0, -3.0], [12.0, 9.0], 0.05, 100_000).unwrap();
    let mut cells = vec![0; geometry.cells()];
    let mut random = Random::new(4, "hall");
    let pillars: Vec<[f64; 3]> = (0..30)
        .map(|_| [random.uniform(0.0, 240.0), random.uniform(0.0, 180.0), random.uniform(2.0, 8.0)])
        .collect();
    for (cell, occupancy) in cells.iter_mut().enumerate() {
        let (column, row) = (cell % geometry.width, cell / geometry.width);
        let is_wall = column == 0 || row == 0 || column == geometry.width - 1 || row == geometry.height - 1;
        let is_pillar = pillars
            .iter()
            .any(|[x, y, radius]| math::hypot(column as f64 + 0.5 - x, row as f64 + 0.5 - y) < *radius);
        *occupancy = if is_wall || is_pillar { 100 } else { 0 };
    }
    OccupancyMap { geometry, cells }
}

fn laser(noise: f64) -> LaserDescription {
    let robot = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    let laser = robot.laser["utm_30lx"].clone();
    let scaled = |value: f64| value * noise;
    LaserDescription {
        noise_constant: scaled(laser.noise_constant),
        noise_proportional: scaled(laser.noise_proportional),
        dropout: scaled(laser.dropout),
        mixed_pixels: scaled(laser.mixed_pixels),
        rate: None,
        ..laser
    }
}

fn simulation(map: &OccupancyMap, pose: Pose, laser: &LaserDescription) -> Simulation {
    let mut description = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    description.sonar.clear();
    let placement = Placement { name: "r1".into(), description, sonar: String::new(), pose, script: None };
    let world = World::from_map("hall", map).unwrap();
    let mut simulation = Simulation::new(&world, &[placement], 1, STEP).unwrap();
    simulation.mount_laser(0, laser, 1);
    simulation.step();
    simulation.sense();
    simulation
}

/// Free poses of the hall.
fn poses(map: &OccupancyMap) -> Vec<Pose> {
    let mut random = Random::new(5, "poses");
    let draws = (0..200).map(|_| Pose {
        x: random.uniform(-1.5, 9.5),
        y: random.uniform(-2.5, 5.5),
        theta: random.uniform(-3.0, 3.0),
    });
    let is_free = |pose: &Pose| {
        (0..64).all(|k| {
            let angle = f64::from(k) * 0.1;
            (0..10).all(|ring| {
                let radius = 0.05 * f64::from(ring);
                let cell =
                    map.geometry.cell(pose.x + radius * math::cos(angle), pose.y + radius * math::sin(angle));
                cell.is_some_and(|(column, row)| map.cells[map.geometry.index(column, row)] == 0)
            })
        })
    };
    draws.filter(is_free).collect()
}

/// The range by all cells of the beam, one by one.
fn exact(map: &OccupancyMap, from: Point, angle: f64, range_max: f64) -> f64 {
    let geometry = &map.geometry;
    let begin = geometry.place(from.x, from.y);
    let to = Point::new(from.x + range_max * math::cos(angle), from.y + range_max * math::sin(angle));
    let end = geometry.place(to.x, to.y);
    let hit = LineCells::new(begin, end).find(|(column, row)| {
        let cell = usize::try_from(*column).ok().zip(usize::try_from(*row).ok());
        cell.is_some_and(|(column, row)| {
            column < geometry.width && row < geometry.height && map.cells[geometry.index(column, row)] == 100
        })
    });
    let Some((column, row)) = hit else { return f64::INFINITY };
    let share = |cell: i64, from: f64, to: f64| {
        let border = if to > from { cell as f64 } else { cell as f64 + 1.0 };
        if from.floor() as i64 == cell { 0.0 } else { (border - from) / (to - from) }
    };
    range_max * math::max(share(column, begin.0, end.0), share(row, begin.1, end.1))
}

#[test]
fn ranges_in_a_map_are_exact_to_a_centimeter() {
    let map = hall();
    let laser = laser(0.0);
    let poses = poses(&map);
    assert!(poses.len() > 20, "{}", poses.len());
    for pose in poses {
        let simulation = simulation(&map, pose, &laser);
        let pose = simulation.pose(0);
        let from = pose.frame().apply(Point::new(laser.mount[0], laser.mount[1]));
        for (beam, range) in (0..).zip(simulation.laser(0).unwrap().ranges()) {
            let wanted = exact(&map, from, pose.theta + laser.angle_of(beam), laser.range_max);
            assert!((f64::from(*range) - wanted).abs() < 0.01, "{pose:?} {beam} {range} {wanted}");
        }
    }
}

#[test]
fn noise_of_a_real_laser_has_outliers_and_missing_returns() {
    let map = hall();
    let (exact, noisy) = (laser(0.0), laser(1.0));
    let (mut missing, mut outliers, mut near, mut squares) = (0, 0, 0, 0.0);
    for pose in poses(&map) {
        let truth = simulation(&map, pose, &exact);
        let measured = simulation(&map, pose, &noisy);
        let pairs = truth.laser(0).unwrap().ranges().iter().zip(measured.laser(0).unwrap().ranges());
        for (truth, measured) in pairs {
            let error = f64::from(measured - truth);
            match error.abs() {
                error if error.is_infinite() => missing += 1,
                error if error > 0.1 => outliers += 1,
                error => {
                    near += 1;
                    squares += error * error;
                }
            }
        }
    }
    let all = f64::from(missing + outliers + near);
    let (missing, outliers) = (f64::from(missing) / all, f64::from(outliers) / all);
    let stddev = (squares / f64::from(near)).sqrt();
    assert!(missing > 0.007 && missing < 0.013, "{missing}");
    assert!(outliers > 0.001 && outliers < 0.03, "{outliers}");
    assert!(stddev > 0.005 && stddev < 0.02, "{stddev}");
}

#[test]
fn walls_of_a_map_stop_robots_and_are_what_they_touch() {
    let map = hall();
    let pose = poses(&map)[0];
    let mut simulation = simulation(&map, pose, &laser(0.0));
    let wheels = slate_sim::drive::Wheels { left: 5.0, right: 5.0 };
    for _ in 0..3_000 {
        simulation.command(0, wheels);
        simulation.step();
    }
    let contacts = simulation.take_contacts();
    assert!(contacts.first().is_some_and(|contact| contact.other.starts_with("wall_")), "{contacts:?}");
    let pose = simulation.pose(0);
    assert!(pose.x > -2.0 && pose.x < 10.0 && pose.y > -3.0 && pose.y < 6.0, "{pose:?}");
    assert!(simulation.clearance(0) < 0.01);
}

#[test]
fn a_map_of_noise_is_refused_as_a_world() {
    let geometry = Geometry::new([0.0, 0.0], [20.0, 20.0], 0.05, 1_000_000).unwrap();
    let cells = (0..geometry.cells()).map(|cell| if (cell % 400 + cell / 400) % 2 == 0 { 100 } else { 0 });
    let error = World::from_map("noise", &OccupancyMap { geometry, cells: cells.collect() }).unwrap_err();
    assert!(error.to_string().contains("80000 rectangles"), "{error}");
}
