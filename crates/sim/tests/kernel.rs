//! Guarantees of the simulator.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::script::RandomWalk;
use slate_sim::world::{Body, World};
use slate_sim::{Placement, Simulation};

const STEP: u64 = 10_000_000;

fn arena(bodies: Vec<Body>) -> World {
    let mut world = World::named("rocs_arena").unwrap().unwrap();
    world.bodies.extend(bodies);
    world
}

fn pioneer(name: &str, x: f64, y: f64, theta: f64) -> Placement {
    let mut description = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    description.noise.wheel_speed = 0.0;
    Placement {
        name: name.into(),
        description,
        sonar: "vrep".into(),
        pose: Pose { x, y, theta },
        script: None,
    }
}

fn run(simulation: &mut Simulation, seconds: f64) {
    for _ in 0..(seconds * 100.0) as usize {
        simulation.step();
        simulation.sense();
    }
}

#[test]
fn equal_wheels_drive_a_straight_line() {
    let mut simulation = Simulation::new(&arena(vec![]), &[pioneer("r", -1.0, 0.0, 0.0)], 0, STEP).unwrap();
    simulation.command(0, Wheels { left: 2.0, right: 2.0 });
    run(&mut simulation, 5.0);
    let pose = simulation.pose(0);
    // 2 rad/s * 0.0975 m * 5 s, less the moment of starting.
    assert!((pose.x + 1.0 - 0.975).abs() < 0.02, "{pose:?}");
    assert!(pose.y.abs() < 1e-9 && pose.theta.abs() < 1e-9, "{pose:?}");
}

#[test]
fn different_wheels_drive_the_analytic_circle() {
    let mut simulation = Simulation::new(&arena(vec![]), &[pioneer("r", 0.0, 0.0, 0.0)], 0, STEP).unwrap();
    simulation.command(0, Wheels { left: 1.0, right: 3.0 });
    let radius = 0.331 / 2.0 * (3.0 + 1.0) / (3.0 - 1.0);
    for _ in 0..1000 {
        simulation.step();
        let pose = simulation.pose(0);
        let from_center = (pose.x * pose.x + (pose.y - radius) * (pose.y - radius)).sqrt();
        assert!((from_center - radius).abs() < 0.02, "{pose:?}");
    }
}

#[test]
fn a_sonar_measures_walls_within_its_maximum_incidence() {
    let facing = Simulation::new(&arena(vec![]), &[pioneer("r", 1.8, 0.0, 0.0)], 0, STEP).unwrap();
    let (echoes, _) = facing.sonar(0).unwrap();
    // Sonar 4 at x 0.165 looks 10 degrees to the left; the nearest point in its cone is straight ahead.
    assert!(echoes[3].heard && (echoes[3].range - (2.475 - 1.965)).abs() < 1e-6, "{:?}", echoes[3]);
    // Turned by 70 degrees, the wall's normal is 70 - 10 - 15 = 45 degrees and more from every way in that cone.
    let oblique =
        Simulation::new(&arena(vec![]), &[pioneer("r", 1.8, 0.0, 71f64.to_radians())], 0, STEP).unwrap();
    let (echoes, _) = oblique.sonar(0).unwrap();
    assert!(!echoes[3].heard, "{:?}", echoes[3]);
}

#[test]
fn a_cone_hears_a_post_that_a_ray_on_its_axis_would_miss() {
    // 10 degrees beside the axis of sonar 4, which itself looks to 10 degrees.
    let post = Body::rectangle("post", [0.7, 0.22], [0.02, 0.02]);
    let simulation = Simulation::new(&arena(vec![post]), &[pioneer("r", 0.0, 0.0, 0.0)], 0, STEP).unwrap();
    let (echoes, _) = simulation.sonar(0).unwrap();
    assert!(echoes[3].heard && echoes[3].range < 0.6, "{:?}", echoes[3]);
    assert!(!echoes[5].heard, "the other side hears nothing: {:?}", echoes[5]);
}

fn contact_causes(first: Wheels, second: Wheels) -> Vec<(bool, bool)> {
    let robots = [pioneer("a", -0.4, 0.0, 0.0), pioneer("b", 0.4, 0.0, std::f64::consts::PI)];
    let mut simulation = Simulation::new(&arena(vec![]), &robots, 0, STEP).unwrap();
    simulation.command(0, first);
    simulation.command(1, second);
    run(&mut simulation, 6.0);
    simulation.take_contacts().iter().map(|contact| (contact.caused, contact.caused_by_other)).collect()
}

#[test]
fn approaching_robot_causes_the_contact() {
    let (still, forward) = (Wheels::default(), Wheels { left: 1.0, right: 1.0 });
    assert_eq!(contact_causes(forward, still), [(true, false)]);
    assert_eq!(contact_causes(still, forward), [(false, true)]);
    assert_eq!(contact_causes(forward, forward), [(true, true)]);
    assert_eq!(contact_causes(still, still), []);
}

#[test]
fn leaning_on_a_wall_is_one_contact() {
    let mut simulation = Simulation::new(&arena(vec![]), &[pioneer("r", 1.8, 0.0, 0.3)], 0, STEP).unwrap();
    simulation.command(0, Wheels { left: 2.0, right: 2.0 });
    run(&mut simulation, 8.0);
    let contacts = simulation.take_contacts();
    assert_eq!(contacts.len(), 1, "{contacts:?}");
    assert!(contacts[0].caused && contacts[0].other == "east_wall", "{contacts:?}");
}

/// Two robots, one of them wandering, for 20 s.
fn digest() -> (u64, Simulation) {
    let mut wanderer = pioneer("r1", 1.0, 1.0, 0.5);
    wanderer.script = Some(RandomWalk::default());
    let mut other = pioneer("r2", -1.0, -0.5, 2.0);
    other.sonar = "real".into();
    let mut simulation = Simulation::new(&arena(vec![]), &[wanderer, other], 7, STEP).unwrap();
    simulation.command(1, Wheels { left: 1.0, right: 1.2 });
    run(&mut simulation, 20.0);
    (fingerprint(&simulation), simulation)
}

fn fingerprint(simulation: &Simulation) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut add = |number: f64| hash = (hash ^ number.to_bits()).wrapping_mul(0x0100_0000_01b3);
    for robot in 0..simulation.robot_count() {
        let pose = simulation.pose(robot);
        [pose.x, pose.y, pose.theta].into_iter().for_each(&mut add);
        simulation.sonar(robot).unwrap().0.iter().for_each(|echo| add(echo.range));
    }
    hash
}

#[test]
fn the_same_seed_gives_the_same_bits_in_every_build() {
    let (first, _) = digest();
    assert_eq!(first, digest().0);
    // Measured once; debug and release builds must both give it.
    assert_eq!(first, 0x42b6_535b_c221_a814, "{first:#x}");
}

#[test]
fn a_saved_simulation_goes_on_bit_for_bit() {
    let (_, mut straight) = digest();
    let saved = slate_module::encode(&straight).unwrap();
    let mut resumed: Simulation = slate_module::decode(&saved).unwrap();
    run(&mut straight, 10.0);
    run(&mut resumed, 10.0);
    assert_eq!(fingerprint(&straight), fingerprint(&resumed));
}

#[test]
fn a_wanderer_keeps_off_the_walls() {
    let mut wanderer = pioneer("r1", 0.0, 0.0, 0.5);
    wanderer.script = Some(RandomWalk::default());
    let mut simulation = Simulation::new(&arena(vec![]), &[wanderer], 3, STEP).unwrap();
    run(&mut simulation, 300.0);
    assert_eq!(simulation.take_contacts(), []);
}

#[test]
fn a_wrong_world_says_where_and_what_is_expected() {
    let error = World::parse("w.toml", "name = \"w\"\nbounds = 3\n").unwrap_err().to_string();
    assert!(error.contains("w.toml") && error.contains("line 2") && error.contains("Bounds"), "{error}");
    let text = "name = \"w\"\n[bounds]\nminimum = [0, 0]\nmaximum = [1, 1]\n[[bodies]]\nname = \"b\"\ncenter = [0, 0]\n";
    let error = World::parse("w.toml", text).unwrap_err().to_string();
    assert!(error.contains("`b`") && error.contains("rectangle"), "{error}");
}

#[test]
fn robots_do_not_start_inside_something() {
    let error =
        Simulation::new(&arena(vec![]), &[pioneer("r", 2.4, 0.0, 0.0)], 0, STEP).unwrap_err().to_string();
    assert!(error.contains("`r` stands in `east_wall`"), "{error}");
}
