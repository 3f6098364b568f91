//! Four wheels that all point ahead: what friction makes of them.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use std::f64::consts::FRAC_PI_2;

use proptest::prelude::*;
use slate_module::Random;
use slate_sim::drive::{Drive, FourWheels, Mass, SkidSteer, Velocity, Wheels};
use slate_sim::geometry::{Point, Pose};
use slate_sim::robot::{Friction, RobotDescription};
use slate_sim::script::RandomWalk;
use slate_sim::world::{Bounds, Scenery, World};
use slate_sim::{Placement, Simulation};

const STEP: u64 = 10_000_000;
const RADIUS: f64 = 0.11;
const ICE: Friction = Friction { longitudinal: 0.02, lateral: 0.02, rolling_resistance: 0.0 };

/// A Summit without noise.
fn summit() -> RobotDescription {
    let mut description = RobotDescription::load("summit_xl").unwrap();
    description.noise.wheel_radius_bias = 0.0;
    description.noise.track_bias = 0.0;
    description.noise.wheel_speed = 0.0;
    description
}

fn placed(name: &str, description: RobotDescription, x: f64, y: f64, theta: f64) -> Placement {
    Placement {
        name: name.into(),
        description,
        sonar: "vrep".into(),
        pose: Pose { x, y, theta },
        script: None,
    }
}

fn plain() -> World {
    let bounds = Bounds { minimum: [-10.0, -10.0], maximum: [10.0, 10.0] };
    World { name: "plain".into(), bounds, bodies: Vec::new(), scenery: Scenery::default(), map: None }
}

fn simulate(robots: &[Placement]) -> Simulation {
    Simulation::new(&plain(), robots, 0, STEP).unwrap()
}

fn run(simulation: &mut Simulation, seconds: f64) {
    (0..(seconds * 100.0) as usize).for_each(|_| simulation.step());
}

fn sides(left: f64, right: f64) -> Wheels {
    Wheels { left: left / RADIUS, right: right / RADIUS }
}

#[test]
fn equal_wheels_drive_straight_and_as_far_as_they_roll() {
    let mut simulation = simulate(&[placed("r", summit(), 0.0, 0.0, 0.7)]);
    simulation.command(0, sides(0.5, 0.5));
    run(&mut simulation, 10.0);
    let pose = simulation.pose(0);
    let (along, aside) =
        (pose.x * 0.7_f64.cos() + pose.y * 0.7_f64.sin(), pose.y * 0.7_f64.cos() - pose.x * 0.7_f64.sin());
    // 0.6 m/s^2 to 0.5 m/s takes 0.83 s, of which half is lost.
    assert!((along - 0.5 * (10.0 - 0.42)).abs() < 0.02, "{along}");
    assert!(aside.abs() < 1e-6 && (pose.theta - 0.7).abs() < 1e-6, "{pose:?}");
}

/// How fast it turns at last, radians per second.
fn turn(description: &RobotDescription, left: f64, right: f64) -> f64 {
    let mut simulation = simulate(&[placed("r", description.clone(), 0.0, 0.0, 0.0)]);
    simulation.command(0, sides(left, right));
    run(&mut simulation, 3.0);
    let before = simulation.pose(0).theta;
    run(&mut simulation, 0.1);
    slate_module::math::angle_between(before, simulation.pose(0).theta) / 0.1
}

#[test]
fn skid_steering_turns_like_a_wider_differential_drive() {
    // All wheels slip in proportion to their distance from where they would not: (v - w b / 2) b = w l^2 / 2.
    let track = 0.470 + 0.458 * 0.458 / 0.470;
    let rate = turn(&summit(), -0.3, 0.3);
    assert!((rate - 0.6 / track).abs() < 0.01 * rate, "{rate}, and {} is expected", 0.6 / track);
    // Wheels that slip more easily to the side turn more, and those that do so less, less.
    let turning = |lateral: f64| {
        let mut description = summit();
        description.drive.friction = Some(Friction { longitudinal: 0.8, lateral, rolling_resistance: 0.01 });
        turn(&description, -0.3, 0.3)
    };
    assert!(turning(0.4) > 1.2 * rate && turning(1.2) < 0.8 * rate);
    assert!(turning(0.0) > 0.99 * 0.6 / 0.470, "without lateral friction it turns as its track says");
}

#[test]
fn a_wheel_on_ice_makes_it_veer_to_the_other_side() {
    let heading = |which: &str| {
        let mut description = summit();
        let friction = &mut description.drive.wheel_friction;
        match which {
            "left" => friction.front_left = Some(ICE),
            "right" => friction.front_right = Some(ICE),
            _ => {}
        }
        // Hard acceleration, so that the wheels need their grip.
        description.drive.maximum_wheel_acceleration = 100.0;
        description.drive.friction.as_mut().unwrap().longitudinal = 0.5;
        let mut simulation = simulate(&[placed("r", description, 0.0, 0.0, 0.0)]);
        simulation.command(0, sides(1.0, 1.0));
        run(&mut simulation, 1.0);
        simulation.pose(0).theta
    };
    let (left, none, right) = (heading("left"), heading("none"), heading("right"));
    assert!(none.abs() < 1e-9, "{none}");
    // The side that pulls goes ahead.
    assert!(left > 0.01 && right < -0.01 && (left + right).abs() < 1e-6, "{left} {right}");
    // Turning, the wheel that does not hold lets its corner swing.
    let mut description = summit();
    description.drive.wheel_friction.back_left = Some(ICE);
    let mut simulation = simulate(&[placed("r", description, 0.0, 0.0, 0.0)]);
    simulation.command(0, sides(-0.3, 0.3));
    run(&mut simulation, 3.0);
    assert!(simulation.pose(0).point().norm() > 0.05, "{:?}", simulation.pose(0));
}

#[test]
fn it_stands_still_to_the_bit() {
    let start = Pose { x: 0.1, y: 0.2, theta: 0.3 };
    let mut simulation = simulate(&[placed("r", summit(), start.x, start.y, start.theta)]);
    run(&mut simulation, 20.0);
    let first = simulation.pose(0);
    assert!(first.point().minus(start.point()).norm() < 1e-12);
    run(&mut simulation, 20.0);
    assert_eq!(simulation.pose(0), first);
}

#[test]
fn it_stops_when_its_wheels_do_and_stays() {
    let mut simulation = simulate(&[placed("r", summit(), 0.0, 0.0, 0.0)]);
    simulation.command(0, sides(0.2, 1.0));
    run(&mut simulation, 3.0);
    simulation.command(0, sides(0.0, 0.0));
    run(&mut simulation, 3.0);
    let stopped = simulation.pose(0);
    run(&mut simulation, 60.0);
    let later = simulation.pose(0);
    let moved = later.point().minus(stopped.point()).norm();
    assert!(moved < 1e-6 && (later.theta - stopped.theta).abs() < 1e-6, "{moved}");
}

#[test]
fn a_push_moves_it_a_little_and_a_wall_stops_it() {
    // A Pioneer at 0.5 m/s meets the standing Summit from the side.
    let pioneer = RobotDescription::load("pioneer_p3dx").unwrap();
    let robots = [placed("pushed", summit(), 0.0, 0.0, 0.0), placed("pusher", pioneer, 0.0, -0.8, FRAC_PI_2)];
    let mut simulation = simulate(&robots);
    simulation.command(1, Wheels { left: 5.0, right: 5.0 });
    run(&mut simulation, 3.0);
    let pushed = simulation.pose(0);
    assert!(pushed.y > 0.01, "{pushed:?}");
    let contacts = simulation.take_contacts();
    assert!(contacts.len() == 1 && !contacts[0].caused && contacts[0].caused_by_other, "{contacts:?}");

    let arena = World::load("rocs_arena").unwrap();
    let mut simulation = Simulation::new(&arena, &[placed("r", summit(), 1.5, 0.0, 0.0)], 0, STEP).unwrap();
    simulation.command(0, sides(0.4, 0.4));
    run(&mut simulation, 6.0);
    let front = simulation.pose(0).x + 0.362;
    assert!((front - 2.475).abs() < 0.005, "{front}");
    let contacts = simulation.take_contacts();
    assert!(contacts.len() == 1 && contacts[0].caused, "{contacts:?}");
    // Its encoders do not know of the wall.
    assert!(simulation.odometry(0).0.x > 2.0);
}

#[test]
fn pushed_robot_did_not_cause_wall_contact() {
    let pioneer = RobotDescription::load("pioneer_p3dx").unwrap();
    let robots = [placed("pushed", summit(), 2.0, 0.0, 0.0), placed("pusher", pioneer, 1.2, 0.0, 0.0)];
    let arena = World::load("rocs_arena").unwrap();
    let mut simulation = Simulation::new(&arena, &robots, 0, STEP).unwrap();
    simulation.command(1, Wheels { left: 12.0, right: 12.0 });
    run(&mut simulation, 20.0);
    let contacts = simulation.take_contacts();
    let wall: Vec<_> = contacts.iter().filter(|contact| contact.other == "east_wall").collect();
    assert!(wall.len() == 1 && !wall[0].caused, "{contacts:?}");
}

#[test]
fn odometry_with_the_effective_track_follows_a_turn_on_the_spot() {
    let mut simulation = simulate(&[placed("r", summit(), 0.0, 0.0, 0.0)]);
    simulation.command(0, sides(-0.3, 0.3));
    run(&mut simulation, 2.0);
    let (believed, truth) = (simulation.odometry(0).0, simulation.pose(0));
    assert!(truth.theta > 1.0 && (believed.theta - truth.theta).abs() < 0.05, "{believed:?} {truth:?}");
}

#[test]
fn four_wheels_are_distinguished() {
    let mut simulation = simulate(&[placed("r", summit(), 0.0, 0.0, 0.0)]);
    // The wheels of one side work against each other: it stays about where it is.
    simulation
        .command(0, FourWheels { front_left: 3.0, front_right: 3.0, back_left: -3.0, back_right: -3.0 });
    run(&mut simulation, 3.0);
    assert!(simulation.pose(0).point().norm() < 1e-6, "{:?}", simulation.pose(0));
}

#[test]
fn a_saved_simulation_goes_on_bit_for_bit() {
    let mut wanderer = placed("a", summit(), 0.0, 0.0, 0.0);
    wanderer.script = Some(RandomWalk::default());
    wanderer.sonar = "real".into();
    let robots = [wanderer, placed("b", summit(), 1.5, 0.3, 3.0)];
    let arena = World::load("rocs_arena").unwrap();
    let state = |simulation: &Simulation| slate_module::encode(simulation).unwrap();
    let start = || {
        let mut simulation = Simulation::new(&arena, &robots, 4, STEP).unwrap();
        simulation.command(1, sides(0.5, 0.4));
        simulation
    };
    let go = |simulation: &mut Simulation, steps: usize| {
        for _ in 0..steps {
            simulation.step();
            simulation.sense();
        }
    };
    let mut simulation = start();
    for _ in 0..20 {
        go(&mut simulation, 50);
        let mut resumed: Simulation = slate_module::decode(&state(&simulation)).unwrap();
        go(&mut simulation, 10);
        go(&mut resumed, 10);
        assert!(state(&simulation) == state(&resumed));
    }
    let mut again = start();
    go(&mut again, 20 * 60);
    assert!(state(&simulation) == state(&again), "equal seeds, equal bits");
}

#[test]
fn a_wanderer_with_three_sonars_turns_away_from_walls() {
    let arena = World::load("rocs_arena").unwrap();
    // How many of 5 minutes' steps it touches something, and how far it gets.
    let wander = |blind: bool| {
        let mut robot = placed("r", summit(), 0.0, 0.0, 0.5);
        robot.script = Some(RandomWalk { wheel_speed: 2.0, blind, ..RandomWalk::default() });
        let (mut touching, mut way) = (0, 0.0);
        for seed in 0..5 {
            let mut simulation = Simulation::new(&arena, std::slice::from_ref(&robot), seed, STEP).unwrap();
            for _ in 0..6000 {
                let before = simulation.pose(0).point();
                simulation.step();
                simulation.sense();
                way += simulation.pose(0).point().minus(before).norm();
                touching += i32::from(simulation.touches(0));
            }
        }
        (touching, way)
    };
    let ((listening, way), (blind, _)) = (wander(false), wander(true));
    // Three sonars leave room to graze a wall beside it.
    assert!(listening < 300 && blind > 10 * listening.max(30) && way > 30.0, "{listening} {blind} {way}");
}

/// The wheels of a drive that rolls at those speeds.
fn rolling(friction: [Friction; 4], wheels: FourWheels) -> SkidSteer {
    let mut description = summit();
    let [front_left, front_right, back_left, back_right] = friction.map(Some);
    let own = &mut description.drive.wheel_friction;
    (own.front_left, own.front_right, own.back_left, own.back_right) =
        (front_left, front_right, back_left, back_right);
    description.drive.maximum_wheel_acceleration = 1e9;
    let center = Point::default();
    let mut drive = Drive::new(&description.drive, &description.noise, 51.0, center, Random::new(0, ""));
    drive.command(wheels);
    let Drive::SkidSteer(mut drive) = drive else { unreachable!() };
    drive.follow(0.01);
    drive
}

const BODY: Mass = Mass { mass: 51.0, moment: 3.8 };

fn energy(velocity: Velocity) -> f64 {
    let Velocity { forward, left, turn } = velocity;
    (BODY.mass * (forward * forward + left * left) + BODY.moment * turn * turn) / 2.0
}

prop_compose! {
    fn friction()(longitudinal in 0.0..2.0, lateral in 0.0..2.0, rolling_resistance in 0.0..0.1) -> Friction {
        Friction { longitudinal, lateral, rolling_resistance }
    }
}

prop_compose! {
    fn velocity()(forward in -5.0..5.0, left in -5.0..5.0, turn in -10.0..10.0) -> Velocity {
        Velocity { forward, left, turn }
    }
}

proptest! {
    #[test]
    fn standing_wheels_take_energy_and_never_give_any(
        friction in [friction(), friction(), friction(), friction()],
        start in velocity(),
        step in 1e-4..0.2,
    ) {
        let drive = rolling(friction, FourWheels::default());
        let mut velocity = start;
        for _ in 0..50 {
            let after = drive.rub(BODY, velocity, step);
            prop_assert!(energy(after) <= energy(velocity) * (1.0 + 1e-12), "{velocity:?} {after:?}");
            velocity = after;
        }
    }

    /// Energy in a frame that moves with the wheels' surfaces never grows either when all turn alike.
    #[test]
    fn turning_wheels_bring_the_body_to_their_speed_and_no_farther(
        friction in [friction(), friction(), friction(), friction()],
        start in velocity(),
        speed in -10.0..10.0,
        step in 1e-4..0.2,
    ) {
        let friction = friction.map(|friction: Friction| Friction { rolling_resistance: 0.0, ..friction });
        let all = FourWheels { front_left: speed, front_right: speed, back_left: speed, back_right: speed };
        let drive = rolling(friction, all);
        let relative = |velocity: Velocity| {
            energy(Velocity { forward: velocity.forward - speed * RADIUS, ..velocity })
        };
        let mut velocity = start;
        for _ in 0..50 {
            let after = drive.rub(BODY, velocity, step);
            prop_assert!(relative(after) <= relative(velocity) * (1.0 + 1e-12) + 1e-15);
            velocity = after;
        }
    }

    /// The force is never more than friction allows.
    #[test]
    fn friction_has_its_limit(start in velocity(), grip in 0.0..1.5, step in 1e-4..0.05) {
        let same = Friction { longitudinal: grip, lateral: grip, rolling_resistance: 0.0 };
        let after = rolling([same; 4], FourWheels::default()).rub(BODY, start, step);
        let (forward, left) = (after.forward - start.forward, after.left - start.left);
        let change = (forward * forward + left * left).sqrt();
        prop_assert!(change <= grip * 9.80665 * step * (1.0 + 1e-9), "{change}");
    }
}
