//! Cause of a contact in ambiguous cases.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use slate_sim::contact::Contact;
use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::world::{Body, World};
use slate_sim::{Placement, Simulation};

const STEP: u64 = 10_000_000;

fn pioneer(name: &str, x: f64, y: f64, theta: f64) -> Placement {
    let description = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    Placement {
        name: name.into(),
        description,
        sonar: "vrep".into(),
        pose: Pose { x, y, theta },
        script: None,
    }
}

fn drive(bodies: Vec<Body>, robots: &[(Placement, Wheels)], seconds: f64) -> Vec<Contact> {
    let mut world = World::named("rocs_arena").unwrap().unwrap();
    world.bodies.extend(bodies);
    let placements: Vec<_> = robots.iter().map(|(placement, _)| placement.clone()).collect();
    let mut simulation = Simulation::new(&world, &placements, 0, STEP).unwrap();
    for (robot, (_, wheels)) in robots.iter().enumerate() {
        simulation.command(robot, *wheels);
    }
    for _ in 0..(seconds * 100.0) as usize {
        simulation.step();
    }
    simulation.take_contacts()
}

fn straight(speed: f64) -> Wheels {
    Wheels { left: speed / 0.0975, right: speed / 0.0975 }
}

#[test]
fn a_fast_robot_causes_its_contact_anywhere_at_a_wall() {
    for k in 0..40 {
        let y = -2.0 + 0.1 * f64::from(k);
        for speed in [0.1, 0.3, 0.5, 0.8, 1.2] {
            let contacts = drive(vec![], &[(pioneer("r", 1.2, y, 0.0), straight(speed))], 1.5 / speed);
            assert_eq!(contacts.len(), 1, "{y} {speed} {contacts:?}");
            assert!(contacts[0].caused, "at {y} with {speed} m/s: {contacts:?}");
        }
    }
}

#[test]
fn passing_by_at_a_millimeter_is_no_contact() {
    // The widest part of the outline, away from the box by 1 mm.
    let outline = RobotDescription::named("pioneer_p3dx").unwrap().unwrap().outline();
    let half_width = outline.points.iter().map(|point| point.y).fold(0.0, f64::max);
    let post = Body::rectangle("post", [0.0, 0.5 + half_width + 0.001 + 0.1], [0.2, 0.2]);
    let contacts = drive(vec![post], &[(pioneer("r", -1.0, 0.5, 0.0), straight(0.3))], 6.0);
    assert_eq!(contacts, []);
}

#[test]
fn driving_away_from_a_touched_wall_is_not_caused() {
    let contacts = drive(vec![], &[(pioneer("r", 2.475 - 0.1905, 0.3, 0.0), straight(-0.3))], 2.0);
    assert!(contacts.iter().all(|contact| !contact.caused), "{contacts:?}");
}

#[test]
fn a_robot_pushed_into_a_wall_did_not_cause_the_contact() {
    let robots = [
        (pioneer("pusher", 0.9, 0.0, 0.0), straight(0.3)),
        (pioneer("pushed", 1.7, 0.0, 0.0), straight(0.0)),
    ];
    let contacts = drive(vec![], &robots, 8.0);
    let wall: Vec<_> = contacts.iter().filter(|contact| contact.other == "east_wall").collect();
    assert!(!wall.is_empty() && wall.iter().all(|contact| !contact.caused), "{contacts:?}");
    let met: Vec<_> = contacts.iter().filter(|contact| contact.other != "east_wall").collect();
    assert_eq!(met.len(), 1, "{contacts:?}");
    assert!(met[0].caused && !met[0].caused_by_other, "{contacts:?}");
}

#[test]
fn only_leaving_a_wall_makes_a_second_contact() {
    let world = World::named("rocs_arena").unwrap().unwrap();
    let mut simulation = Simulation::new(&world, &[pioneer("r", 2.2, 0.3, 0.0)], 0, STEP).unwrap();
    let mut go = |speed: f64, seconds: f64| {
        simulation.command(0, straight(speed));
        (0..(seconds * 100.0) as usize).for_each(|_| simulation.step());
        (simulation.take_contacts().len(), simulation.touches(0))
    };
    assert_eq!(go(0.1, 2.0), (1, true));
    assert_eq!(go(0.0, 2.0), (0, true));
    assert_eq!(go(0.1, 2.0), (0, true));
    assert_eq!(go(-0.1, 1.0), (0, false));
    assert_eq!(go(0.1, 2.0), (1, true));
}

#[test]
fn turning_into_a_wall_is_caused_too() {
    // The tail swings into the wall while the reference point stands.
    let turn = Wheels { left: -1.0, right: 1.0 };
    let contacts = drive(vec![], &[(pioneer("r", 2.475 - 0.25, 0.0, 1.2), turn)], 3.0);
    assert!(!contacts.is_empty() && contacts[0].caused, "{contacts:?}");
}

#[test]
fn a_simulation_saved_while_robots_press_goes_on_bit_for_bit() {
    let robots = [pioneer("a", 0.9, 0.0, 0.1), pioneer("b", 1.7, 0.1, 0.0)];
    let mut world = World::named("rocs_arena").unwrap().unwrap();
    world.bodies.push(Body::circle("post", [1.9, 0.6], 0.1));
    let mut simulation = Simulation::new(&world, &robots, 0, STEP).unwrap();
    simulation.command(0, straight(0.3));
    simulation.command(1, Wheels { left: 0.2, right: -0.1 });
    let mut pressed = 0;
    for _ in 0..40 {
        (0..20).for_each(|_| simulation.step());
        pressed += usize::from(simulation.touches(0));
        let saved = slate_module::encode(&simulation).unwrap();
        let mut resumed: Simulation = slate_module::decode(&saved).unwrap();
        (0..20).for_each(|_| simulation.step());
        (0..20).for_each(|_| resumed.step());
        assert_eq!(slate_module::encode(&simulation).unwrap(), slate_module::encode(&resumed).unwrap());
    }
    assert!(pressed > 10, "{pressed}");
}
