//! Shortest ways and clearances, against what can be calculated.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use slate_sim::geometry::{Point, Polygon, Pose};
use slate_sim::robot::RobotDescription;
use slate_sim::shortest_path::shortest_path;
use slate_sim::world::{Body, World};
use slate_sim::{Placement, Simulation};

#[test]
fn a_free_way_is_straight() {
    let length = shortest_path(&[], Point::new(0.0, 0.0), Point::new(3.0, 4.0), 0.2).unwrap();
    assert!((length - 5.0).abs() < 1e-12, "{length}");
}

#[test]
fn a_way_around_a_box_is_two_tangents_two_arcs_and_a_side() {
    let obstacle = Polygon::rectangle(Point::new(0.0, 0.05), 0.5, 0.5);
    let length = shortest_path(&[obstacle], Point::new(-1.0, 0.0), Point::new(1.0, 0.0), 0.2).unwrap();
    // The nearer corners are at (+-0.25, -0.2); a tangent is 0.75 long and falls by twice atan(0.2 / 0.75).
    let exact = 2.0 * (0.75 + 0.2 * 2.0 * (0.2_f64 / 0.75).atan()) + 0.5;
    assert!(length >= exact - 1e-9 && length < exact * 1.003, "{length} {exact}");
}

#[test]
fn a_disc_does_not_pass_a_gap_that_is_too_narrow() {
    let wall = |y: f64| Polygon::rectangle(Point::new(0.0, y), 0.1, 2.0);
    let room = [
        Polygon::rectangle(Point::new(0.0, 2.15), 6.0, 0.1),
        Polygon::rectangle(Point::new(0.0, -2.15), 6.0, 0.1),
        Polygon::rectangle(Point::new(3.0, 0.0), 0.1, 4.4),
        Polygon::rectangle(Point::new(-3.0, 0.0), 0.1, 4.4),
        wall(1.2),
        wall(-1.2),
    ];
    // The gap is 0.4 m.
    let way = |radius: f64| shortest_path(&room, Point::new(-1.0, 0.5), Point::new(1.0, 0.5), radius);
    assert!(way(0.19).is_some());
    assert_eq!(way(0.21), None);
}

#[test]
fn the_clearance_is_that_of_the_outline_to_the_nearest_body() {
    let mut world = World::load("rocs_arena").unwrap();
    world.bodies.push(Body::circle("post", [-1.0, 1.0], 0.1));
    let robot = |name: &str, x: f64, y: f64| Placement {
        name: name.into(),
        description: RobotDescription::load("pioneer_p3dx").unwrap(),
        sonar: String::new(),
        pose: Pose { x, y, theta: 0.0 },
        script: None,
    };
    let reach = |value: fn(&Point) -> f64| {
        let outline = robot("", 0.0, 0.0).description.outline();
        outline.points.iter().map(value).fold(f64::NEG_INFINITY, f64::max)
    };
    let (front, back) = (reach(|point| point.x), reach(|point| -point.x));
    let robots = [robot("east", 1.8, 0.0), robot("middle", 1.0, 0.0)];
    let simulation = Simulation::new(&world, &robots, 0, 10_000_000).unwrap();
    let between = 0.8 - front - back;
    assert!((simulation.clearance(1) - between).abs() < 1e-12, "{}", simulation.clearance(1));
    let to_wall = 2.475 - 1.8 - front;
    assert!((simulation.clearance(0) - to_wall.min(between)).abs() < 1e-12, "{}", simulation.clearance(0));
}
