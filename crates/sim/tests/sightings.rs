//! The sensor that sees other robots.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use slate_sim::geometry::Pose;
use slate_sim::robot::{RobotDescription, RobotSensorDescription};
use slate_sim::world::{Body, World};
use slate_sim::{Placement, Simulation};

const STEP: u64 = 10_000_000;

/// A Summit that sees exactly, all around.
fn summit(x: f64, y: f64, theta: f64) -> Placement {
    let description = RobotDescription::load("summit_xl").unwrap();
    Placement {
        name: "s".into(),
        description,
        sonar: "vrep".into(),
        pose: Pose { x, y, theta },
        script: None,
    }
}

/// The same with another sensor.
fn with(change: impl Fn(&mut RobotSensorDescription)) -> Placement {
    let mut placement = summit(0.0, 0.0, 0.0);
    change(placement.description.robot_sensor.get_mut("vrep").unwrap());
    placement
}

fn pioneer(name: &str, x: f64, y: f64) -> Placement {
    let description = RobotDescription::load("pioneer_p3dx").unwrap();
    let pose = Pose { x, y, theta: 0.5 };
    Placement { name: name.into(), description, sonar: String::new(), pose, script: None }
}

fn simulate(bodies: Vec<Body>, robots: &[Placement]) -> Simulation {
    let mut world = World::load("rocs_arena").unwrap();
    world.bodies.extend(bodies);
    Simulation::new(&world, robots, 3, STEP).unwrap()
}

/// Names, ranges and bearings of what robot 0 sees.
fn seen(simulation: &Simulation) -> Vec<(String, f64, f64)> {
    let sightings = simulation.robot_sensor(0).unwrap().sightings();
    sightings.iter().map(|seen| (simulation.name(seen.robot).into(), seen.range, seen.bearing)).collect()
}

fn names(simulation: &Simulation) -> Vec<String> {
    seen(simulation).into_iter().map(|(name, _, _)| name).collect()
}

#[test]
fn range_and_bearing_go_from_reference_point_to_reference_point() {
    let simulation =
        simulate(vec![], &[summit(0.5, 0.2, 0.6), pioneer("p", 1.5, 1.2), pioneer("q", 0.5, -1.0)]);
    let seen = seen(&simulation);
    assert_eq!(names(&simulation), ["q", "p"], "the nearest comes first");
    let (_, range, bearing) = &seen[0];
    assert!((range - 1.2).abs() < 1e-12 && (bearing - (-FRAC_PI_2 - 0.6)).abs() < 1e-9, "{seen:?}");
    let (_, range, bearing) = &seen[1];
    assert!((range - 2.0_f64.sqrt()).abs() < 1e-12 && (bearing - (FRAC_PI_4 - 0.6)).abs() < 1e-9);
}

#[test]
fn measurement_is_independent_of_mounting() {
    let mounted = with(|sensor| sensor.mount = [0.3, -0.2, 0.0]);
    let simulation = simulate(vec![], &[mounted, pioneer("p", 1.0, 1.0)]);
    let (_, range, bearing) = &seen(&simulation)[0];
    assert!((range - 2.0_f64.sqrt()).abs() < 1e-12 && (bearing - FRAC_PI_4).abs() < 1e-12);
}

#[test]
fn a_box_hides_a_robot_and_half_a_box_only_half_of_it() {
    let look = |bodies: Vec<Body>, share: f64| {
        let robots = [with(|sensor| sensor.visible_share = share), pioneer("p", 2.0, 0.0)];
        !names(&simulate(bodies, &robots)).is_empty()
    };
    let wall = |y: f64| vec![Body::rectangle("wall", [1.0, y], [0.1, 1.0])];
    assert!(look(vec![], 1.0));
    assert!(!look(wall(0.0), 0.1));
    // The wall begins a little below the line between the two.
    assert!(look(wall(-0.51), 0.4) && !look(wall(-0.51), 0.8));
    assert!(look(vec![Body::rectangle("behind", [2.4, 0.0], [0.05, 1.0])], 1.0));
}

#[test]
fn a_robot_hides_another() {
    let robots = [summit(-1.0, 0.0, 0.0), pioneer("near", 0.3, 0.0), pioneer("far", 1.5, 0.0)];
    assert_eq!(names(&simulate(vec![], &robots)), ["near"]);
    let robots = [summit(-1.0, 0.0, 0.0), pioneer("near", 0.3, 0.8), pioneer("far", 1.5, 0.0)];
    assert_eq!(names(&simulate(vec![], &robots)).len(), 2);
}

#[test]
fn the_field_of_view_and_the_range_have_borders() {
    let look = |field_of_view: f64, range_max: f64, x: f64, y: f64| {
        let robot = with(|sensor| (sensor.field_of_view, sensor.range_max) = (field_of_view, range_max));
        names(&simulate(vec![], &[robot, pioneer("p", x, y)])).len() == 1
    };
    assert!(look(1.0, 3.0, 2.0, 0.0) && !look(1.0, 3.0, -2.0, 0.0));
    assert!(look(1.0, 3.0, 1.5, 0.7) && !look(1.0, 3.0, 1.5, 1.3));
    assert!(look(1.0, 2.1, 2.0, 0.0) && !look(1.0, 1.9, 2.0, 0.0));
    assert!(look(TAU, 3.0, -2.0, 0.0));
}

#[test]
fn noise_and_dropouts_depend_on_the_seed_alone() {
    let robot = with(|sensor| {
        (sensor.noise_constant, sensor.noise_proportional) = (0.02, 0.01);
        (sensor.noise_bearing, sensor.dropout) = (0.03, 0.2);
    });
    let look = || {
        let mut simulation = simulate(vec![], &[robot.clone(), pioneer("p", 2.0, 0.0)]);
        let once = |_| {
            simulation.sense();
            seen(&simulation).first().map(|(_, range, bearing)| (*range, *bearing))
        };
        (0..4000).map(once).collect::<Vec<_>>()
    };
    let all = look();
    assert_eq!(all, look());
    let there: Vec<_> = all.iter().flatten().collect();
    assert!((there.len() as f64 - 3200.0).abs() < 120.0, "{}", there.len());
    let spread = |value: fn(&(f64, f64)) -> f64, truth: f64| {
        let squares = there.iter().map(|seen| (value(seen) - truth) * (value(seen) - truth)).sum::<f64>();
        (squares / there.len() as f64).sqrt()
    };
    assert!((spread(|seen| seen.0, 2.0) - 0.04).abs() < 0.003);
    assert!((spread(|seen| seen.1, 0.0) - 0.03).abs() < 0.002);
}

#[test]
fn it_looks_as_often_as_its_rate_says() {
    let mut simulation = simulate(vec![], &[with(|sensor| sensor.rate = Some(4.0)), pioneer("p", 2.0, 0.0)]);
    let mut looks = Vec::new();
    for _ in 0..100 {
        (0..2).for_each(|_| simulation.step());
        simulation.sense();
        looks.push(simulation.robot_sensor(0).unwrap().measured_at().unwrap());
    }
    looks.dedup();
    // At 0, and then in the first cycle of 20 ms after each quarter of a second.
    assert_eq!(
        looks.iter().map(|time| time / 1_000_000).collect::<Vec<_>>(),
        [0, 260, 500, 760, 1000, 1260, 1500, 1760, 2000]
    );
}

#[test]
fn a_robot_has_the_sensor_that_it_is_described_with() {
    let simulation = simulate(vec![], &[pioneer("p", 0.0, 0.0)]);
    assert!(simulation.robot_sensor(0).is_none());
    let mut real = summit(0.0, 0.0, 0.0);
    real.sonar = "real".into();
    assert_eq!(real.robot_sensor().unwrap().rate, Some(10.0));
    real.sonar = String::new();
    assert!(real.robot_sensor().is_none(), "nothing says which of the two");
    real.description.robot_sensor.remove("real");
    assert_eq!(real.robot_sensor().unwrap().rate, None);
}
