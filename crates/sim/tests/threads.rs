//! Any number of threads gives the same bits.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use slate_sim::geometry::Pose;
use slate_sim::robot::{PositioningDescription, RobotDescription};
use slate_sim::script::RandomWalk;
use slate_sim::world::{Bounds, Scenery, World};
use slate_sim::{Placement, Simulation};
use slate_sorted::SortedMap;

#[test]
fn the_state_is_the_same_with_any_number_of_threads() {
    let bounds = Bounds { minimum: [0.0, 0.0], maximum: [36.0, 36.0] };
    let world =
        World { name: "field".into(), bounds, bodies: Vec::new(), scenery: Scenery::default(), map: None };
    let robots: Vec<_> = (0..300)
        .map(|i| {
            let model = if i % 10 == 0 { "summit_xl" } else { "pioneer_p3dx" };
            let mut description = RobotDescription::load(model).unwrap();
            let profile =
                PositioningDescription { noise_position: 0.01, ..PositioningDescription::default() };
            description.positioning = SortedMap::from([("real".into(), profile)]);
            Placement {
                name: format!("r{i}"),
                description,
                sonar: "real".into(),
                pose: Pose { x: f64::from(i % 18) * 1.5, y: f64::from(i / 18) * 1.5, theta: f64::from(i) },
                script: Some(RandomWalk::default()),
            }
        })
        .collect();
    let run = |threads: usize| {
        let mut simulation = Simulation::new(&world, &robots, 9, 20_000_000).unwrap();
        simulation.set_threads(threads);
        for _ in 0..8 {
            (0..5).for_each(|_| simulation.step());
            simulation.sense();
        }
        slate_module::encode(&simulation).unwrap()
    };
    let one = run(1);
    assert!(one == run(1));
    for threads in [2, 3, 7, 1000] {
        assert!(one == run(threads), "{threads} threads");
    }
}
