//! People walking among walls, robots and each other.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_grid::{Geometry, OccupancyMap};
use slate_module::math::{atan2, min};
use slate_sim::contact::Contact;
use slate_sim::drive::Wheels;
use slate_sim::geometry::{Point, Polygon, Pose};
use slate_sim::people::PeopleDescription;
use slate_sim::robot::RobotDescription;
use slate_sim::script::RandomWalk;
use slate_sim::world::{Body, World};
use slate_sim::{MovingBodies, Placement, Simulation};

const STEP: u64 = 10_000_000;

fn people(count: usize, places: &[[f64; 2]]) -> PeopleDescription {
    let text = format!(r#"{{"count": {count}}}"#);
    PeopleDescription { places: places.to_vec(), ..serde_json::from_str(&text).unwrap() }
}

fn pioneer(x: f64, y: f64, theta: f64) -> Placement {
    let description = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    Placement {
        name: "r".into(),
        description,
        sonar: "vrep".into(),
        pose: Pose { x, y, theta },
        script: None,
    }
}

fn outline(placement: &Placement) -> Polygon {
    let mut placed = Polygon::default();
    placement.description.outline().place(&placement.pose.frame(), &mut placed);
    placed
}

fn simulation(world: &World, robots: &[Placement], people: &PeopleDescription, seed: u64) -> Simulation {
    let outlines: Vec<_> = robots.iter().map(outline).collect();
    let layout = people.lay_out(world, &outlines, seed).unwrap();
    let moving = MovingBodies { people: Some(layout), ..MovingBodies::default() };
    Simulation::with_moving(world, robots, &moving, seed, STEP).unwrap()
}

/// A room of 12 m by 8 m with three pillars.
fn room() -> World {
    let mut world = World::named("rocs_arena").unwrap().unwrap();
    (world.bounds.minimum, world.bounds.maximum) = ([0.0, 0.0], [12.0, 8.0]);
    world.bodies = vec![
        Body::rectangle("west", [0.0, 4.0], [0.1, 8.0]),
        Body::rectangle("east", [12.0, 4.0], [0.1, 8.0]),
        Body::rectangle("south", [6.0, 0.0], [12.0, 0.1]),
        Body::rectangle("north", [6.0, 8.0], [12.0, 0.1]),
        Body::circle("pillar_1", [3.0, 4.0], 0.4),
        Body::circle("pillar_2", [6.0, 4.2], 0.4),
        Body::rectangle("box", [9.0, 3.8], [1.0, 1.0]),
    ];
    world
}

/// The positions of all people.
fn positions(simulation: &Simulation) -> Vec<Point> {
    simulation.people().map(|(_, pose)| pose.point()).collect()
}

#[test]
fn people_walk_from_place_to_place_and_touch_nothing() {
    let world = room();
    let places = [[1.0, 1.0], [11.0, 7.0], [11.0, 1.0], [1.0, 7.0]];
    let mut simulation = simulation(&world, &[], &people(8, &places), 3);
    let walls: Vec<_> = world.bodies.iter().filter_map(Body::polygon).collect();
    let mut before = positions(&simulation);
    let mut walked = [0.0; 8];
    let (mut nearest_wall, mut nearest_person) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..3_000 {
        simulation.step();
        let now = positions(&simulation);
        for (number, person) in now.iter().enumerate() {
            walked[number] += person.minus(before[number]).norm();
            for wall in &walls {
                nearest_wall = min(nearest_wall, wall.nearest(*person).minus(*person).norm());
            }
            for other in &now[..number] {
                nearest_person = min(nearest_person, other.minus(*person).norm());
            }
        }
        before = now;
    }
    assert!(walked.iter().all(|length| *length > 20.0 && *length < 55.0), "{walked:?}");
    assert!(nearest_wall > 0.245, "{nearest_wall}");
    assert!(nearest_person > 0.495, "{nearest_person}");
}

#[test]
fn people_never_walk_into_a_standing_robot() {
    // In the middle of all ways.
    let robot = pioneer(6.0, 2.2, 1.0);
    for seed in 0..2 {
        let places = [[5.0, 1.0], [7.0, 3.0], [7.0, 1.0], [5.0, 3.0]];
        let mut simulation = simulation(&room(), std::slice::from_ref(&robot), &people(6, &places), seed);
        let mut nearest = f64::INFINITY;
        for _ in 0..2_500 {
            simulation.step();
            nearest = min(nearest, simulation.clearance(0));
        }
        let contacts = simulation.take_contacts();
        assert!(contacts.is_empty(), "{contacts:?}");
        assert!(nearest > 0.0 && nearest < 0.3, "they pass by at {nearest} m");
    }
}

#[test]
fn a_robot_that_runs_into_people_caused_it() {
    let script = RandomWalk { wheel_speed: 12.0, blind: true, ..RandomWalk::default() };
    let robot = Placement { script: Some(script), ..pioneer(6.0, 2.2, 1.0) };
    let mut simulation = simulation(&room(), &[robot], &people(12, &[]), 1);
    (0..6_000).for_each(|_| simulation.step());
    let with_people = |contact: &Contact| contact.other.starts_with("person_");
    let contacts: Vec<_> = simulation.take_contacts().into_iter().filter(with_people).collect();
    assert!(contacts.len() > 2, "{}", contacts.len());
    let by_people: Vec<_> = contacts.iter().filter(|contact| contact.caused_by_other).collect();
    assert!(by_people.is_empty(), "{by_people:?}");
}

#[test]
fn laser_and_sonar_see_a_person_as_a_disc() {
    let places = [[4.0, 1.5], [4.0, 1.6]];
    let mut description = people(1, &places);
    description.pause = [3600.0, 3600.0];
    let robot = Placement { sonar: "real".into(), ..pioneer(2.0, 1.5, 0.0) };
    let laser = robot.description.laser["urg_04lx"].clone();
    let mut simulation = simulation(&room(), &[robot], &description, 0);
    simulation.mount_laser(0, &laser, 0);
    (0..2_000).for_each(|_| simulation.step());
    simulation.command(0, Wheels::default());
    simulation.sense();
    let person = positions(&simulation)[0];
    let eye = Point::new(2.12, 1.5);
    let ranges = simulation.laser(0).unwrap().ranges();
    let way = person.minus(eye);
    let bearing = atan2(way.y, way.x);
    let beam = ((bearing - laser.angle_of(0)) / laser.increment()).round() as usize;
    let expected = way.norm() - 0.25;
    assert!((f64::from(ranges[beam]) - expected).abs() < 0.06, "{} {expected}", ranges[beam]);
    let (echoes, _) = simulation.sonar(0).unwrap();
    let nearest = echoes[2..6].iter().map(|echo| echo.range).fold(9.0, min);
    assert!((nearest - expected).abs() < 0.2, "{nearest} {expected}");
}

#[test]
fn people_are_the_same_with_any_number_of_threads() {
    let run = |threads: usize| {
        let robots = [pioneer(6.0, 2.2, 1.0)];
        let mut simulation = simulation(&room(), &robots, &people(5, &[]), 7);
        simulation.set_threads(threads);
        for _ in 0..200 {
            simulation.step();
            simulation.sense();
        }
        slate_module::encode(&simulation).unwrap()
    };
    let one = run(1);
    assert!(one == run(1) && one == run(2), "the state differs");
}

#[test]
fn people_pass_the_doorways_of_a_map() {
    let geometry = Geometry::new([0.0, 0.0], [12.0, 6.0], 0.05, 100_000).unwrap();
    let is_wall = |column: usize, row: usize| {
        let is_edge = column < 2 || row < 2 || column >= 238 || row >= 118;
        is_edge || ((119..121).contains(&column) && !(50..70).contains(&row))
    };
    let cells = (0..geometry.cells()).map(|cell| if is_wall(cell % 240, cell / 240) { 100 } else { 0 });
    let map = OccupancyMap { geometry, cells: cells.collect() };
    let world = World::from_map("two rooms", &map).unwrap();
    let mut simulation = simulation(&world, &[], &people(2, &[[2.0, 1.0], [10.0, 5.0]]), 0);
    let mut sides = [[false; 2]; 2];
    for _ in 0..2_500 {
        simulation.step();
        for (person, sides) in positions(&simulation).into_iter().zip(&mut sides) {
            sides[usize::from(person.x > 6.0)] = true;
        }
    }
    assert_eq!(sides, [[true; 2]; 2]);
}

#[test]
fn places_in_walls_and_behind_them_are_refused() {
    let world = room();
    let refusal = |places: &[[f64; 2]]| people(2, places).lay_out(&world, &[], 0).unwrap_err().to_string();
    let in_pillar = refusal(&[[1.0, 1.0], [3.0, 4.0]]);
    assert!(in_pillar.starts_with("world.people.places: [3, 4] is outside"), "{in_pillar}");
    let outside = refusal(&[[1.0, 1.0], [13.0, 4.0]]);
    assert!(outside.contains("outside of the world"), "{outside}");
    let mut split = world.clone();
    split.bodies.push(Body::rectangle("wall", [4.5, 4.0], [0.1, 8.0]));
    let places = people(2, &[[1.0, 1.0], [11.0, 1.0]]);
    let behind = places.lay_out(&split, &[], 0).unwrap_err().to_string();
    assert!(behind.contains("no path from [1, 1] to [11, 1]"), "{behind}");
    let crowd = people(400, &[]).lay_out(&world, &[], 0).unwrap_err().to_string();
    assert!(crowd.starts_with("world.people.count: no room for 400 people"), "{crowd}");
}
