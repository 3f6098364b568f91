//! Noise, odometry and what sensors do to each other.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::positioning::Fix;
use slate_sim::robot::{PositioningDescription, RobotDescription};
use slate_sim::sonar::Echo;
use slate_sim::world::{Body, World};
use slate_sim::{Placement, Simulation};
use slate_sorted::SortedMap;

const STEP: u64 = 10_000_000;

fn pioneer(name: &str, sonar: &str, x: f64, y: f64) -> Placement {
    let description = RobotDescription::load("pioneer_p3dx").unwrap();
    Placement {
        name: name.into(),
        description,
        sonar: sonar.into(),
        pose: Pose { x, y, theta: 0.3 },
        script: None,
    }
}

/// One profile of the positioning system.
fn positions(noise: f64, dropout: f64, rate: Option<f64>) -> SortedMap<String, PositioningDescription> {
    let profile =
        PositioningDescription { noise_position: noise, noise_orientation: noise / 2.0, dropout, rate };
    SortedMap::from([("real".into(), profile)])
}

fn simulate(robots: &[Placement], seed: u64) -> Simulation {
    let mut simulation = Simulation::new(&World::load("rocs_arena").unwrap(), robots, seed, STEP).unwrap();
    for robot in 0..robots.len() {
        simulation.command(robot, Wheels { left: 1.0, right: 1.5 });
    }
    simulation
}

/// Everything that robot 0 senses in 3 s.
fn sensed(mut simulation: Simulation) -> Vec<(Vec<Echo>, Pose, Fix)> {
    (0..150)
        .map(|_| {
            simulation.step();
            simulation.step();
            simulation.sense();
            let echoes = simulation.sonar(0).map_or_else(Vec::new, |(echoes, _)| echoes.to_vec());
            (echoes, simulation.odometry(0).0, simulation.fix(0))
        })
        .collect()
}

#[test]
fn noise_depends_on_the_seed_alone() {
    let robots = [pioneer("r", "real", 0.0, 0.0)];
    assert_eq!(sensed(simulate(&robots, 5)), sensed(simulate(&robots, 5)));
    assert_ne!(sensed(simulate(&robots, 5)), sensed(simulate(&robots, 6)));
}

#[test]
fn a_sensor_more_changes_nothing_in_the_others() {
    let odometry = |sonar: &str| {
        let mut robot = pioneer("r", sonar, 0.0, 0.0);
        robot.description.positioning = positions(0.01, 0.0, None);
        sensed(simulate(&[robot], 5))
            .into_iter()
            .map(|(_, odometry, measured)| (odometry, measured))
            .collect::<Vec<_>>()
    };
    assert_eq!(odometry(""), odometry("real"));
}

#[test]
fn a_robot_more_changes_nothing_where_it_is_not_heard() {
    let alone = sensed(simulate(&[pioneer("r", "vrep", -1.5, -1.5)], 5));
    let beside = sensed(simulate(&[pioneer("r", "vrep", -1.5, -1.5), pioneer("s", "real", 1.5, 1.0)], 5));
    assert_eq!(alone, beside);
}

#[test]
fn odometry_is_exact_without_noise_and_drifts_with_bias() {
    let drift = |noisy: bool| {
        let mut robot = pioneer("r", "", 0.0, 0.0);
        if !noisy {
            robot.description.noise.wheel_radius_bias = 0.0;
            robot.description.noise.track_bias = 0.0;
            robot.description.noise.wheel_speed = 0.0;
        }
        let mut simulation = simulate(&[robot], 5);
        (0..1000).for_each(|_| simulation.step());
        let (believed, truth) = (simulation.odometry(0).0, simulation.pose(0));
        // Odometry counts from the start.
        let (cos, sin) = (0.3_f64.cos(), 0.3_f64.sin());
        let (x, y) = (believed.x * cos - believed.y * sin, believed.x * sin + believed.y * cos);
        ((x - truth.x) * (x - truth.x) + (y - truth.y) * (y - truth.y)).sqrt()
    };
    assert!(drift(false) < 1e-4, "{}", drift(false));
    assert!(drift(true) > 1e-3, "{}", drift(true));
}

#[test]
fn the_spread_of_ranges_is_the_described_one() {
    let mut robot = pioneer("r", "real", 0.0, 0.0);
    robot.pose.theta = 0.0;
    let profile = robot.description.sonar.get_mut("real").unwrap();
    (profile.dropout, profile.crosstalk) = (0.0, 0.0);
    let mut simulation = Simulation::new(&World::load("rocs_arena").unwrap(), &[robot], 1, STEP).unwrap();
    let (mut sum, mut squares, count) = (0.0, 0.0, 4000);
    for _ in 0..count {
        simulation.sense();
        let range = simulation.sonar(0).unwrap().0[3].range;
        sum += range;
        squares += range * range;
    }
    let mean = sum / f64::from(count);
    let deviation = (squares / f64::from(count) - mean * mean).sqrt();
    let truth = 2.475 - 0.166;
    assert!((mean - truth).abs() < 0.003, "{mean}");
    assert!((deviation - (0.005 + 0.01 * truth)).abs() < 0.002, "{deviation}");
}

#[test]
fn echoes_are_lost_and_crossed_as_often_as_described() {
    let mut robot = pioneer("r", "real", 0.0, 0.0);
    robot.pose.theta = 0.0;
    let profile = robot.description.sonar.get_mut("real").unwrap();
    (profile.dropout, profile.crosstalk) = (0.2, 0.1);
    (profile.noise_constant, profile.noise_proportional) = (0.0, 0.0);
    let mut simulation = Simulation::new(&World::load("rocs_arena").unwrap(), &[robot], 1, STEP).unwrap();
    let truth = 2.475 - 0.166;
    let (mut lost, mut crossed) = (0, 0);
    for _ in 0..5000 {
        simulation.sense();
        let echo = simulation.sonar(0).unwrap().0[3];
        lost += i32::from(!echo.heard);
        crossed += i32::from(echo.range < truth - 0.001);
    }
    assert!((lost - 900).abs() < 100 && (crossed - 500).abs() < 80, "{lost} {crossed}");
}

#[test]
fn a_thin_post_between_the_axes_is_heard_at_its_distance() {
    let mut world = World::load("rocs_arena").unwrap();
    world.bodies.push(Body::circle("post", [0.8, 0.0], 0.01));
    let mut robot = pioneer("r", "vrep", 0.0, 0.0);
    robot.pose.theta = 0.0;
    let simulation = Simulation::new(&world, &[robot], 1, STEP).unwrap();
    let (echoes, _) = simulation.sonar(0).unwrap();
    // Sonars 4 and 5 look 10 degrees to either side; an axis of neither meets the post.
    let expected = ((0.8_f64 - 0.165) * (0.8 - 0.165) + 0.027 * 0.027).sqrt() - 0.01;
    for echo in &echoes[3..5] {
        assert!(echo.heard && (echo.range - expected).abs() < 1e-4, "{echo:?} {expected}");
    }
}

#[test]
fn missing_echo_has_maximum_range() {
    let simulation = simulate(&[pioneer("r", "vrep", 0.0, 0.0)], 1);
    assert!(simulation.sonar(0).unwrap().0.iter().all(|echo| !echo.heard && echo.range == 1.0));
}

/// Fixes of a robot that stands at (0.5, 0.25) looking along 0.3 rad, each cycle of 20 ms, with their times in milliseconds.
fn fixes(positioning: SortedMap<String, PositioningDescription>, cycles: usize) -> Vec<(u64, Fix)> {
    let mut robot = pioneer("r", "", 0.5, 0.25);
    robot.description.positioning = positioning;
    let mut simulation = Simulation::new(&World::load("rocs_arena").unwrap(), &[robot], 5, STEP).unwrap();
    let fixes = (0..cycles).map(|_| {
        (0..2).for_each(|_| simulation.step());
        (simulation.now() / 1_000_000, simulation.fix(0))
    });
    fixes.collect()
}

#[test]
fn a_positioning_system_errs_as_its_profile_says() {
    let fixes = fixes(positions(0.1, 0.2, None), 5000);
    let spread = |errors: Vec<f64>| {
        assert!((errors.len() as f64 - 4000.0).abs() < 150.0, "a fifth is missing, not {}", errors.len());
        (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt()
    };
    let x = spread(fixes.iter().filter_map(|(_, fix)| Some(fix.position?.x - 0.5)).collect());
    let y = spread(fixes.iter().filter_map(|(_, fix)| Some(fix.position?.y - 0.25)).collect());
    let theta = spread(fixes.iter().filter_map(|(_, fix)| Some(fix.orientation? - 0.3)).collect());
    assert!((x - 0.1).abs() < 0.005 && (y - 0.1).abs() < 0.005, "{x} {y}");
    assert!((theta - 0.05).abs() < 0.0025, "{theta}");
}

#[test]
fn a_positioning_system_measures_at_its_rate_in_simulated_time() {
    let measured: Vec<_> = fixes(positions(0.1, 0.0, Some(5.0)), 60)
        .into_iter()
        .filter(|(_, fix)| fix.position.is_some() && fix.orientation.is_some())
        .map(|(time, _)| time)
        .collect();
    assert_eq!(measured, [20, 200, 400, 600, 800, 1000, 1200]);
}

#[test]
fn an_exact_positioning_system_measures_the_truth() {
    let robot = pioneer("r", "", 0.5, 0.25);
    assert_eq!(
        robot.description.positioning.len(),
        2,
        "the description has two profiles, of which none is chosen"
    );
    let mut simulation = simulate(&[robot], 5);
    (0..100).for_each(|_| simulation.step());
    let (fix, pose) = (simulation.fix(0), simulation.pose(0));
    assert_eq!(fix, Fix { position: Some(pose.point()), orientation: Some(pose.theta) });
}
