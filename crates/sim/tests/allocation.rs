//! Robots and their sensors allocate nothing once everything is in motion. Alone in its file, as it counts for the whole process.
#![allow(clippy::unwrap_used)] // Tests say what went wrong by failing.

use allocation_counter::measure;
use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::script::RandomWalk;
use slate_sim::world::World;
use slate_sim::{Placement, Simulation};

#[test]
fn nothing_is_allocated_for_robots_in_the_long_run() {
    let robot = |i: u32, model: &str| Placement {
        name: format!("r{i}"),
        description: RobotDescription::load(model).unwrap(),
        sonar: "real".into(),
        pose: Pose { x: f64::from(i % 4) - 1.5, y: f64::from(i / 4) - 1.5, theta: f64::from(i) },
        script: Some(RandomWalk::default()),
    };
    let robots: Vec<_> =
        (0..16).map(|i| robot(i, if i == 5 { "summit_xl" } else { "pioneer_p3dx" })).collect();
    let world = World::load("rocs_arena").unwrap();
    let mut simulation = Simulation::new(&world, &robots, 1, 20_000_000).unwrap();
    // What steps allocate, and what everything else does.
    let mut go = |cycles: usize| {
        let (mut by_steps, mut by_others) = (0, 0);
        for _ in 0..cycles {
            by_steps += measure(|| simulation.step()).count_total;
            let others = measure(|| {
                simulation.sense();
                for robot in 0..16 {
                    std::hint::black_box((simulation.clearance(robot), simulation.fix(robot)));
                    std::hint::black_box(simulation.odometry(robot));
                }
            });
            by_others += others.count_total;
            drop(simulation.take_contacts());
        }
        (by_steps, by_others)
    };
    go(1000);
    let (by_steps, by_others) = go(1000);
    assert_eq!(by_others, 0);
    // The physics engine allocates a few times in each step, as do contacts that begin; nothing does for each robot.
    assert!(by_steps < 8 * 1000, "{by_steps}");
    assert!(by_steps > 0, "the allocator counts");
}
