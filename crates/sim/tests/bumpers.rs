//! Contacts of bumpers.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::world::World;
use slate_sim::{Placement, Simulation};

/// Whether the front and the back feel anything after a Pioneer has driven for so long.
fn bumper_contacts(x: f64, theta: f64, wheels: Wheels, seconds: f64) -> (bool, bool) {
    let description = RobotDescription::load("pioneer_p3dx").unwrap();
    let pose = Pose { x, y: 0.3, theta };
    let robot = Placement { name: "r".into(), description, sonar: String::new(), pose, script: None };
    let world = World::load("rocs_arena").unwrap();
    let mut simulation = Simulation::new(&world, &[robot], 0, 10_000_000).unwrap();
    simulation.command(0, wheels);
    (0..(seconds * 100.0) as usize).for_each(|_| simulation.step());
    let bumper_contacts = simulation.bumper_contacts(0);
    assert!(bumper_contacts.anywhere || !(bumper_contacts.front || bumper_contacts.back));
    (bumper_contacts.front, bumper_contacts.back)
}

const AHEAD: Wheels = Wheels { left: 2.0, right: 2.0 };
const BACK: Wheels = Wheels { left: -2.0, right: -2.0 };

#[test]
fn each_end_feels_what_it_drives_into() {
    assert_eq!(bumper_contacts(2.0, 0.0, AHEAD, 0.5), (false, false));
    assert_eq!(bumper_contacts(2.0, 0.0, AHEAD, 4.0), (true, false));
    assert_eq!(bumper_contacts(-2.0, 0.0, BACK, 4.0), (false, true));
    assert_eq!(bumper_contacts(2.0, 0.4, AHEAD, 4.0), (true, false));
}

#[test]
fn ended_contact_is_not_reported() {
    let description = RobotDescription::load("pioneer_p3dx").unwrap();
    let pose = Pose { x: 2.2, y: 0.0, theta: 0.0 };
    let robot = Placement { name: "r".into(), description, sonar: String::new(), pose, script: None };
    let mut simulation =
        Simulation::new(&World::load("rocs_arena").unwrap(), &[robot], 0, 10_000_000).unwrap();
    let mut go = |wheels: Wheels| {
        simulation.command(0, wheels);
        (0..150).for_each(|_| simulation.step());
        simulation.bumper_contacts(0).front
    };
    assert!(go(AHEAD) && go(Wheels::default()), "it still leans on the wall");
    assert!(!go(BACK));
}

#[test]
fn a_robot_feels_another_that_drives_into_it() {
    let robot = |name: &str, x: f64| Placement {
        name: name.into(),
        description: RobotDescription::load("pioneer_p3dx").unwrap(),
        sonar: String::new(),
        pose: Pose { x, y: 0.0, theta: 0.0 },
        script: None,
    };
    let robots = [robot("hit", 0.5), robot("hitting", -0.5)];
    let mut simulation =
        Simulation::new(&World::load("rocs_arena").unwrap(), &robots, 0, 10_000_000).unwrap();
    simulation.command(1, AHEAD);
    (0..400).for_each(|_| simulation.step());
    let (hit, hitting) = (simulation.bumper_contacts(0), simulation.bumper_contacts(1));
    assert!(hit.back && !hit.front && hitting.front && !hitting.back, "{hit:?} {hitting:?}");
}

#[test]
fn a_robot_without_bumpers_has_none() {
    let placement = |model: &str| Placement {
        name: "r".into(),
        description: RobotDescription::load(model).unwrap(),
        sonar: String::new(),
        pose: Pose::default(),
        script: None,
    };
    let world = World::load("rocs_arena").unwrap();
    let has =
        |model: &str| Simulation::new(&world, &[placement(model)], 0, 10_000_000).unwrap().has_bumper(0);
    assert!(has("pioneer_p3dx") && !has("summit_xl"));
}
