//! The inertial measurement unit.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::inertial::InertialReading;
use slate_sim::robot::{ImuDescription, RobotDescription};
use slate_sim::world::World;
use slate_sim::{Placement, Simulation};

const STEP: u64 = 10_000_000;

/// Readings of a robot whose wheels turn at those speeds, each cycle of 20 ms.
fn readings(imu: ImuDescription, wheels: Wheels, cycles: usize, seed: u64) -> (Vec<InertialReading>, Pose) {
    let mut description = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    description.sonar.clear();
    let pose = Pose { x: -1.0, y: 0.0, theta: 0.5 };
    let robot = Placement { name: "r".into(), description, sonar: String::new(), pose, script: None };
    let world = World::named("rocs_arena").unwrap().unwrap();
    let mut simulation = Simulation::new(&world, &[robot], seed, STEP).unwrap();
    simulation.mount_imu(0, imu, seed);
    let mut readings = Vec::new();
    for _ in 0..cycles {
        simulation.command(0, wheels);
        (0..2).for_each(|_| simulation.step());
        readings.extend(simulation.shown_imu(0));
    }
    (readings, simulation.pose(0))
}

fn real() -> ImuDescription {
    RobotDescription::named("pioneer_p3dx").unwrap().unwrap().imu["real"]
}

#[test]
fn an_exact_imu_measures_turn_acceleration_and_gravity() {
    // It goes in a circle at 0.3 m/s and 0.6 rad/s.
    let wheels =
        Wheels { left: (0.3 - 0.6 * 0.331 / 2.0) / 0.0975, right: (0.3 + 0.6 * 0.331 / 2.0) / 0.0975 };
    let (readings, pose) = readings(ImuDescription::default(), wheels, 100, 0);
    let last = readings[99];
    assert_eq!((last.heading, last.heading_variance), (pose.theta, 0.0));
    assert!((last.angular_velocity[2] - 0.6).abs() < 1e-6, "{last:?}");
    let [x, y, z] = last.acceleration;
    assert!(x.abs() < 0.02 && (y - 0.18).abs() < 0.01 && z == 9.80665, "{last:?}");
    // While it starts it accelerates forward, by at most what its wheels can.
    let most = readings.iter().map(|reading| reading.acceleration[0]).fold(0.0, slate_module::math::max);
    assert!(most > 1.0 && most < 2.2, "{most}");
}

#[test]
fn an_imu_aside_of_the_middle_feels_the_turn() {
    let imu = ImuDescription { mount: [0.2, 0.0, 90.0], ..ImuDescription::default() };
    let (readings, pose) = readings(imu, Wheels { left: -1.0, right: 1.0 }, 100, 0);
    let turn = 2.0 * 0.0975 / 0.331;
    // Its y axis points to the back, and the middle is behind it.
    let [x, y, _] = readings[99].acceleration;
    assert!(x.abs() < 0.01 && (y - turn * turn * 0.2).abs() < 0.01, "{x} {y}");
    let heading = slate_module::math::wrap_angle(pose.theta + std::f64::consts::FRAC_PI_2);
    assert!((readings[99].heading - heading).abs() < 1e-9);
}

#[test]
fn a_real_imu_has_noise_and_a_bias_for_each_run() {
    let mut biases = Vec::new();
    for seed in 0..30 {
        let (readings, _) = readings(real(), Wheels::default(), 250, seed);
        assert_eq!(readings.len(), 250);
        let turns: Vec<f64> = readings.iter().map(|reading| reading.angular_velocity[2]).collect();
        let mean = turns.iter().sum::<f64>() / 250.0;
        let spread = turns.iter().map(|turn| (turn - mean) * (turn - mean)).sum::<f64>() / 250.0;
        assert!((spread.sqrt() - 0.00061).abs() < 0.00015, "{}", spread.sqrt());
        let last = readings[249];
        let drift = slate_module::math::angle_between(0.5, last.heading);
        assert!((drift - mean * 4.98).abs() < 1e-4, "the heading is the integral of the turn");
        assert!(drift.abs() < 4.0 * last.heading_variance.sqrt(), "{drift} {last:?}");
        biases.push(mean);
    }
    let spread = (biases.iter().map(|bias| bias * bias).sum::<f64>() / 30.0).sqrt();
    assert!((spread - 0.0028).abs() < 0.001, "{spread}");
}

#[test]
fn noise_of_an_imu_depends_on_the_seed_alone() {
    let run = |seed: u64| readings(real(), Wheels { left: 1.0, right: 2.0 }, 50, seed).0;
    assert!(run(1) == run(1) && run(1) != run(2));
}

#[test]
fn rough_ground_shakes_an_imu_that_moves_on_it() {
    // Standard deviation of the vertical acceleration at 0.3 m/s.
    let shaken = |roughness: f64, speed: f64| {
        let mut description = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
        description.sonar.clear();
        let pose = Pose { x: -1.0, y: 0.0, theta: 0.0 };
        let robot = Placement { name: "r".into(), description, sonar: String::new(), pose, script: None };
        let mut world = World::named("rocs_arena").unwrap().unwrap();
        world.scenery.floor_roughness = Some(roughness);
        let mut simulation = Simulation::new(&world, &[robot], 3, STEP).unwrap();
        simulation.mount_imu(0, ImuDescription::default(), 3);
        let mut squares = 0.0;
        for cycle in 0..150 {
            simulation.command(0, Wheels { left: speed / 0.0975, right: speed / 0.0975 });
            (0..2).for_each(|_| simulation.step());
            let up = simulation.shown_imu(0).unwrap().acceleration[2] - 9.80665;
            squares += if cycle < 50 { 0.0 } else { up * up };
        }
        (squares / 100.0_f64).sqrt()
    };
    let (even, rough, halted) = (shaken(0.0, 0.3), shaken(0.5, 0.3), shaken(0.5, 0.0));
    assert!(even == 0.0 && halted < 1e-6, "{even} {halted}");
    assert!((rough - 4.0 * 0.5 * 0.3).abs() < 0.15, "{rough} m/s²");
}
