//! Prints how much faster than real time a wandering Pioneer and a commanded one are simulated, with their sonar rings
//! heard and their clearances measured 50 times per second: `cargo run --release -p slate-sim --example speed`.

// Wall time is what is measured here.
#![allow(clippy::disallowed_methods)]

use std::time::Instant;

use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::script::RandomWalk;
use slate_sim::world::{Body, World};
use slate_sim::{Placement, Simulation};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let description = RobotDescription::named("pioneer_p3dx").ok_or("no pioneer_p3dx")??;
    let mut world = World::named("rocs_arena").ok_or("no rocs_arena")??;
    world.bodies.push(Body::rectangle("box", [-0.45, 0.275], [0.5, 0.5]));
    for profile in ["vrep", "real"] {
        for milliseconds in [10, 20] {
            let robot = |name: &str, x, y, script| Placement {
                name: name.into(),
                description: description.clone(),
                sonar: profile.into(),
                pose: Pose { x, y, theta: 0.5 },
                script,
            };
            let robots = [robot("r1", 1.0, 1.0, Some(RandomWalk::default())), robot("r2", -1.2, -1.2, None)];
            let mut simulation = Simulation::new(&world, &robots, 1, milliseconds * 1_000_000)?;
            simulation.command(1, Wheels { left: 1.0, right: 2.0 });
            let (seconds, start) = (2000_u64, Instant::now());
            for _ in 0..seconds * 50 {
                for _ in 0..20 / milliseconds {
                    simulation.step();
                }
                simulation.sense();
                std::hint::black_box((simulation.clearance(0), simulation.clearance(1)));
            }
            let factor = seconds as f64 / start.elapsed().as_secs_f64();
            println!("{profile}, {milliseconds} ms steps: {factor:.0} times real time");
        }
    }
    Ok(())
}
