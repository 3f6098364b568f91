//! Doors that open for people and robots, and by the clock.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_sim::door::DoorDescription;
use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::world::{Body, World};
use slate_sim::{MovingBodies, Placement, Simulation};
use slate_sorted::SortedMap;

const STEP: u64 = 10_000_000;

/// A wall at x = 0 with a doorway from y = -0.5 to y = 0.5, and a robot before it that looks along x.
fn simulation(keys: &str) -> Simulation {
    let mut world = World::named("rocs_arena").unwrap().unwrap();
    world.bodies.push(Body::rectangle("south", [0.0, -1.4625], [0.1, 1.925]));
    world.bodies.push(Body::rectangle("north", [0.0, 1.5], [0.1, 2.0]));
    let text = format!(r#"{{"from": [0.0, -0.5], "to": [0.0, 0.5] {keys}}}"#);
    let door: DoorDescription = serde_json::from_str(&text).unwrap();
    door.check("world.doors.d").unwrap();
    let mut description = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    let laser = description.laser.remove("urg_04lx").unwrap();
    let pose = Pose { x: -2.0, y: 0.0, theta: 0.0 };
    let robot = Placement { name: "r".into(), description, sonar: "vrep".into(), pose, script: None };
    let moving = MovingBodies { doors: SortedMap::from([("d".into(), door)]), ..MovingBodies::default() };
    let mut simulation = Simulation::with_moving(&world, &[robot], &moving, 0, STEP).unwrap();
    simulation.mount_laser(0, &laser, 0);
    simulation
}

fn opening(simulation: &Simulation) -> f64 {
    simulation.doors().next().unwrap().2
}

fn go(simulation: &mut Simulation, speed: f64, seconds: f64) {
    let turn = speed / 0.0975;
    for _ in 0..(seconds * 100.0) as usize {
        simulation.command(0, Wheels { left: turn, right: turn });
        simulation.step();
    }
    simulation.sense();
}

/// The range straight ahead.
fn ahead(simulation: &Simulation) -> f64 {
    let ranges = simulation.laser(0).unwrap().ranges();
    f64::from(ranges[ranges.len() / 2])
}

#[test]
fn a_closed_door_is_seen_and_stops_a_robot() {
    let mut simulation = simulation(r#", "open": "never""#);
    go(&mut simulation, 0.0, 0.1);
    assert!((ahead(&simulation) - (2.0 - 0.12 - 0.025)).abs() < 0.05, "{}", ahead(&simulation));
    go(&mut simulation, 0.5, 6.0);
    let contacts = simulation.take_contacts();
    assert!(contacts.iter().any(|contact| contact.other == "d" && contact.caused), "{contacts:?}");
    assert!(contacts.iter().all(|contact| !contact.caused_by_other), "{contacts:?}");
    assert!(simulation.pose(0).x < -0.2, "{:?}", simulation.pose(0));
    assert_eq!(opening(&simulation), 0.0);
}

#[test]
fn door_opens_for_near_bodies_and_closes_behind_them() {
    let mut simulation = simulation(r#", "open": "near", "distance": 1.2"#);
    assert_eq!(opening(&simulation), 0.0);
    go(&mut simulation, 0.4, 3.4);
    assert_eq!(opening(&simulation), 1.0);
    assert!(ahead(&simulation) > 2.0, "{}", ahead(&simulation));
    go(&mut simulation, 0.4, 6.0);
    go(&mut simulation, 0.0, 5.0);
    assert!(simulation.pose(0).x > 1.5, "{:?}", simulation.pose(0));
    assert_eq!((opening(&simulation), simulation.take_contacts()), (0.0, vec![]));
}

#[test]
fn door_opens_by_clock_and_never_closes_on_body() {
    let mut simulation = simulation(r#", "open": "period", "period": 8.0, "open_time": 4.0, "speed": 1.0"#);
    let mut openings = Vec::new();
    for _ in 0..4 {
        go(&mut simulation, 0.0, 3.5);
        openings.push(opening(&simulation));
    }
    // After 3.5, 7, 10.5 and 14 s.
    assert_eq!(openings, [1.0, 0.0, 1.0, 0.0]);
    // The robot stands in the doorway when it should close.
    go(&mut simulation, 0.0, 3.5);
    go(&mut simulation, 1.0, 2.2);
    go(&mut simulation, 0.0, 4.0);
    assert!(simulation.pose(0).x.abs() < 0.4, "{:?}", simulation.pose(0));
    assert_eq!((opening(&simulation), simulation.take_contacts()), (1.0, vec![]));
}

#[test]
fn a_door_that_can_not_be_is_refused_at_its_key() {
    for (keys, wrong) in [
        (r#""to": [0.0, 0.1]"#, "world.doors.d.to: expected a point from 0.2 to 20 m from `from`"),
        (r#""to": [0.0, 1.0], "thickness": 0.0"#, "world.doors.d.thickness: "),
        (r#""to": [0.0, 1.0], "period": 5.0"#, "world.doors.d.open_time: "),
        (r#""to": [0.0, 1.0], "speed": -1.0"#, "world.doors.d.speed: "),
    ] {
        let door: DoorDescription =
            serde_json::from_str(&format!(r#"{{"from": [0.0, 0.0], {keys}}}"#)).unwrap();
        let error = door.check("world.doors.d").unwrap_err().to_string();
        assert!(error.starts_with(wrong), "{error}");
    }
}
