//! Robots that circle among boxes with a laser, beside the physics engine alone.
//! Both have the same bodies and rays.

use rapier2d_f64::prelude::*;
use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::robot::{LaserDescription, RobotDescription};
use slate_sim::world::{Body, Bounds, World};
use slate_sim::{Placement, Simulation};

use crate::machine::pin;
use crate::measure::{Contest, Effort};
use crate::table::{Role, Table};

/// Meters from robot to robot at the start.
const SPACING: f64 = 2.0;

/// Nanoseconds of a step of the physics.
const STEP: u64 = 10_000_000;

/// Steps from one scan to the next.
const STEPS: usize = 10;

const BEAMS: u32 = 16;

/// Radians of a scan, and meters that it reaches.
const FIELD: f64 = 4.0;
const RANGE: f64 = 4.0;

/// Radians per second of the wheels.
const WHEELS: (f64, f64) = (4.0, 6.0);

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    pin(0);
    for count in [1, 10, 100, 1000, 5000] {
        let scene = Scene::new(count);
        let mut slate = scene.slate();
        let mut rapier = scene.rapier();
        let line = format!("{count} robots, 100 ms in ten steps and a scan of {BEAMS} rays each");
        let mut contest = Contest::new("simulator", line);
        let samples_of = effort.count(2000 / count).clamp(1, 200);
        contest.with("Slate", Role::Slate, move |samples| {
            for _ in 0..samples_of {
                samples.time(|| {
                    (0..STEPS).for_each(|_| slate.step());
                    slate.sense();
                });
            }
        });
        contest.with("rapier2d alone", Role::Floor, move |samples| {
            for _ in 0..samples_of {
                samples.time(|| {
                    (0..STEPS).for_each(|_| rapier.step());
                    std::hint::black_box(rapier.scan());
                });
            }
        });
        contest.run(effort, table);
    }
}

/// Rectangles that stand, and robots.
struct Scene {
    /// Center and size.
    rectangles: Vec<([f64; 2], [f64; 2])>,
    poses: Vec<Pose>,
    half: f64,
    description: RobotDescription,
}

impl Scene {
    /// A square with walls, robots in rows, and a box between for every tenth of them.
    fn new(count: usize) -> Self {
        let row = (count as f64).sqrt().ceil();
        let side = (row + 1.0) * SPACING;
        let half = side / 2.0;
        let mut rectangles = vec![
            ([half, 0.0], [0.1, side]),
            ([-half, 0.0], [0.1, side]),
            ([0.0, half], [side, 0.1]),
            ([0.0, -half], [side, 0.1]),
        ];
        let mut poses = Vec::new();
        for i in 0..count {
            let (x, y) = (i as f64 % row, (i as f64 / row).floor());
            let (x, y) = ((x - (row - 1.0) / 2.0) * SPACING, (y - (row - 1.0) / 2.0) * SPACING);
            if i % 10 == 0 {
                rectangles.push(([x + 1.0, y + 1.0], [0.5, 0.5]));
            }
            poses.push(Pose { x, y, theta: (i * 7 % 6) as f64 });
        }
        let description = RobotDescription::load("pioneer_p3dx").expect("it comes with Slate");
        Self { rectangles, poses, half, description }
    }

    fn slate(&self) -> Simulation {
        let rectangles = self.rectangles.iter().enumerate();
        let bodies = rectangles.map(|(i, (center, size))| Body::rectangle(&format!("b{i}"), *center, *size));
        let bounds = Bounds { minimum: [-self.half; 2], maximum: [self.half; 2] };
        let world = World { name: "square".into(), bounds, bodies: bodies.collect() };
        let robots: Vec<_> = (self.poses.iter().enumerate())
            .map(|(i, pose)| Placement {
                name: format!("r{i}"),
                description: self.description.clone(),
                sonar: String::new(),
                pose: *pose,
                script: None,
            })
            .collect();
        let mut simulation = Simulation::new(&world, &robots, 1, STEP).expect("there is room for all");
        let laser = LaserDescription {
            mount: [0.0; 3],
            range_min: 0.0,
            range_max: RANGE,
            field_of_view: FIELD,
            beams: BEAMS,
            noise_constant: 0.0,
            noise_proportional: 0.0,
            dropout: 0.0,
            rate: None,
        };
        for robot in 0..robots.len() {
            simulation.mount_laser(robot, &laser, 1);
            simulation.command(robot, Wheels { left: WHEELS.0, right: WHEELS.1 });
        }
        simulation
    }

    fn rapier(&self) -> Rapier {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::new(0.0, 0.0);
        world.integration_parameters.dt = STEP as f64 * 1e-9;
        // As Slate has it, so that robots don't meet walls that end before them.
        world.integration_parameters.contact_recycling = false;
        for (center, size) in &self.rectangles {
            let body = RigidBodyBuilder::fixed().translation(Vector::new(center[0], center[1]));
            world.insert(body, ColliderBuilder::cuboid(size[0] / 2.0, size[1] / 2.0));
        }
        let outline: Vec<_> = self.description.footprint.iter().map(|[x, y]| Vector::new(*x, *y)).collect();
        let robots = self.poses.iter().map(|pose| {
            let body = RigidBodyBuilder::dynamic().translation(Vector::new(pose.x, pose.y));
            let body = body.rotation(pose.theta).can_sleep(false);
            let collider = ColliderBuilder::convex_hull(&outline).expect("the footprint is convex");
            world.insert(body, collider.friction(0.2)).0
        });
        let robots = robots.collect();
        Rapier { world, robots }
    }
}

struct Rapier {
    world: PhysicsWorld,
    robots: Vec<RigidBodyHandle>,
}

impl Rapier {
    fn step(&mut self) {
        // The radius of the wheels and the way between them, meters.
        let (speed, turn) = (0.0975 * (WHEELS.0 + WHEELS.1) / 2.0, 0.0975 * (WHEELS.1 - WHEELS.0) / 0.331);
        for robot in &self.robots {
            let body = &mut self.world.bodies[*robot];
            let rotation = body.position().rotation;
            body.set_linvel(Vector::new(rotation.re * speed, rotation.im * speed), true);
            body.set_angvel(turn, true);
        }
        self.world.step();
    }

    /// The sum of the ranges.
    fn scan(&self) -> f64 {
        let mut sum = 0.0;
        for robot in &self.robots {
            let position = self.world.bodies[*robot].position();
            let heading = position.rotation.angle();
            let others = QueryFilter::default().exclude_rigid_body(*robot);
            for beam in 0..BEAMS {
                let angle = heading - FIELD / 2.0 + FIELD / f64::from(BEAMS - 1) * f64::from(beam);
                let ray = Ray::new(position.translation, Vector::new(angle.cos(), angle.sin()));
                sum += self.world.cast_ray(&ray, RANGE, true, others).map_or(RANGE, |(_, range)| range);
            }
        }
        sum
    }
}
