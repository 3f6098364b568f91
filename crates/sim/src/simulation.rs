//! Worlds with robots in virtual time.

use rapier2d_f64::prelude::{
    ColliderBuilder, PhysicsWorld, Pose as BodyPose, RigidBodyBuilder, RigidBodyHandle, Vector,
};
use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{atan2, max, wrap_angle};

use crate::contact::{APART, Contact, Motion, TOUCH, Touching, moves_in};
use crate::drive::{Drive, Wheels};
use crate::geometry::{Frame, Gap, Point, Polygon, Pose};
use crate::robot::{NoiseDescription, RobotDescription};
use crate::script::{RandomWalk, Wanderer};
use crate::sonar::{Echo, SonarRing};
use crate::world::{Body, DescriptionError, World};

/// A robot to be put into a world.
#[derive(Clone, Debug)]
pub struct Placement {
    /// What it is called.
    pub name: String,
    /// What it is.
    pub description: RobotDescription,
    /// Which profile its sonars have; empty for none.
    pub sonar: String,
    /// Where it stands.
    pub pose: Pose,
    /// Its script, if it does not obey commands.
    pub script: Option<RandomWalk>,
}

/// Robots among static bodies.
#[derive(Serialize, Deserialize)]
pub struct Simulation {
    physics: PhysicsWorld,
    /// Static bodies with their outlines.
    bodies: Vec<(String, Polygon)>,
    robots: Vec<Robot>,
    /// Nanoseconds.
    now: u64,
    step: u64,
    contacts: Vec<Contact>,
    /// Per robot and other body: when they touched last.
    touching: Vec<Option<Touching>>,
}

impl std::fmt::Debug for Simulation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Simulation").field("now", &self.now).field("robots", &self.robots.len()).finish_non_exhaustive()
    }
}

#[derive(Serialize, Deserialize)]
struct Robot {
    name: String,
    handle: RigidBodyHandle,
    outline: Polygon,
    radius: f64,
    placed: Polygon,
    pose: Pose,
    motion: Motion,
    drive: Drive,
    sonar: Option<SonarRing>,
    echoes: Vec<Echo>,
    script: Option<Wanderer>,
    noise: NoiseDescription,
    sensors: Random,
    clearance: f64,
}

impl Simulation {
    /// A world with robots at time 0; `step` is the time of a physics step in nanoseconds.
    ///
    /// # Errors
    /// When a robot's sonar profile is unknown or it does not fit where it stands.
    pub fn new(world: &World, robots: &[Placement], seed: u64, step: u64) -> Result<Self, DescriptionError> {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::new(0.0, 0.0);
        physics.integration_parameters.dt = step as f64 * 1e-9;
        let mut bodies = Vec::new();
        for body in &world.bodies {
            let polygon = outline_of(&world.name, body)?;
            let collider = collider(&polygon).ok_or_else(|| DescriptionError::new(&world.name, format!("body `{}` is not convex", body.name)))?;
            physics.insert(RigidBodyBuilder::fixed(), collider);
            bodies.push((body.name.clone(), polygon));
        }
        let mut simulation =
            Self { physics, bodies, robots: Vec::new(), now: 0, step, contacts: Vec::new(), touching: Vec::new() };
        for placement in robots {
            simulation.place(placement, seed)?;
        }
        let others = simulation.bodies.len() + simulation.robots.len();
        simulation.touching = vec![None; simulation.robots.len() * others];
        simulation.sense();
        Ok(simulation)
    }

    fn place(&mut self, placement: &Placement, seed: u64) -> Result<(), DescriptionError> {
        let Placement { name, description, sonar, pose, script } = placement;
        let wrong = |message: String| DescriptionError::new(&description.name, message);
        let stream = |sensor: &str| Random::new(seed, &format!("simulation/{name}/{sensor}"));
        let ring = match description.sonar.get(sonar) {
            Some(profile) => Some(SonarRing::new(profile, stream("sonar"))),
            None if sonar.is_empty() => None,
            None => {
                let known: Vec<_> = description.sonar.keys().map(String::as_str).collect();
                return Err(wrong(format!("no sonar profile `{sonar}`; there are {}", known.join(", "))));
            }
        };
        let outline = description.outline();
        let frame = pose.frame();
        let mut placed = Polygon::default();
        outline.place(&frame, &mut placed);
        let others = self.bodies.iter().map(|(name, polygon)| (name, polygon)).chain(self.robots.iter().map(|robot| (&robot.name, &robot.placed)));
        for (other, polygon) in others {
            if placed.gap(polygon).distance <= 0.0 {
                return Err(wrong(format!("`{name}` stands in `{other}`")));
            }
        }
        let area = area(&outline);
        let collider = collider(&outline).ok_or_else(|| wrong("the footprint is not convex".into()))?;
        let body = RigidBodyBuilder::dynamic().pose(BodyPose::new(Vector::new(pose.x, pose.y), pose.theta)).can_sleep(false);
        let (handle, _) = self.physics.insert(body, collider.density(description.mass / area).friction(0.2));
        self.robots.push(Robot {
            name: name.clone(),
            handle,
            radius: outline.radius(),
            outline,
            placed,
            pose: *pose,
            motion: Motion { origin: pose.point(), ..Motion::default() },
            drive: Drive::new(description.drive, &description.noise, stream("drive")),
            sonar: ring,
            echoes: Vec::with_capacity(16),
            script: script.map(|walk| Wanderer::new(walk, stream("script"))),
            noise: description.noise,
            sensors: stream("pose"),
            clearance: f64::INFINITY,
        });
        Ok(())
    }

    /// Virtual time, nanoseconds.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// The time of a physics step, nanoseconds.
    pub fn step_time(&self) -> u64 {
        self.step
    }

    /// Which number a robot has.
    pub fn robot(&self, name: &str) -> Option<usize> {
        self.robots.iter().position(|robot| robot.name == name)
    }

    /// How many robots there are.
    pub fn robot_count(&self) -> usize {
        self.robots.len()
    }

    /// Tells a robot how fast its wheels should turn. A scripted robot does what its script says.
    pub fn command(&mut self, robot: usize, wheels: Wheels) {
        if let Some(robot) = self.robots.get_mut(robot).filter(|robot| robot.script.is_none()) {
            robot.drive.command(wheels);
        }
    }

    /// Lets virtual time pass by one step, without sensing.
    pub fn step(&mut self) {
        let step = self.step as f64 * 1e-9;
        for robot in &mut self.robots {
            if let Some(script) = &mut robot.script {
                let wheels = script.decide(&robot.echoes, step);
                robot.drive.command(wheels);
            }
            let (linear, angular) = robot.drive.advance(step);
            let Frame { cos, sin, .. } = robot.pose.frame();
            let velocity = Point::new(linear * cos, linear * sin);
            robot.motion = Motion { origin: robot.pose.point(), velocity, angular };
            let body = &mut self.physics.bodies[robot.handle];
            body.set_linvel(self::velocity_of_mass(body, &robot.motion), true);
            body.set_angvel(angular, true);
        }
        self.physics.step();
        self.now += self.step;
        for robot in &mut self.robots {
            let position = self.physics.bodies[robot.handle].position();
            let rotation = position.rotation;
            robot.pose = Pose { x: position.translation.x, y: position.translation.y, theta: wrap_angle(atan2(rotation.im, rotation.re)) };
            robot.outline.place(&robot.pose.frame(), &mut robot.placed);
        }
        self.touch();
    }

    /// Lets the sonars hear.
    pub fn sense(&mut self) {
        for i in 0..self.robots.len() {
            let (mut sonar, mut echoes) = (self.robots[i].sonar.take(), std::mem::take(&mut self.robots[i].echoes));
            if let Some(ring) = &mut sonar {
                let frame = self.robots[i].pose.frame();
                let others = self.robots.iter().enumerate().filter(|(other, _)| *other != i).map(|(_, robot)| &robot.placed);
                ring.sweep(&frame, self.bodies.iter().map(|(_, polygon)| polygon).chain(others), &mut echoes);
            }
            self.robots[i].sonar = sonar;
            self.robots[i].echoes = echoes;
        }
    }

    /// Finds the contacts and the clearances.
    fn touch(&mut self) {
        let others = self.bodies.len() + self.robots.len();
        for i in 0..self.robots.len() {
            let mut clearance = f64::INFINITY;
            for j in 0..others {
                let Some(gap) = self.gap(i, j) else { continue };
                clearance = slate_module::math::min(clearance, gap.distance);
                // A pair of robots is looked at once, from the first.
                if gap.distance < TOUCH && (j < self.bodies.len() || j - self.bodies.len() > i) {
                    self.touched(i, j, &gap);
                }
            }
            self.robots[i].clearance = clearance;
        }
    }

    /// The gap between a robot and another body, as far as it may matter.
    fn gap(&self, i: usize, j: usize) -> Option<Gap> {
        let robot = &self.robots[i];
        if let Some((_, polygon)) = self.bodies.get(j) {
            return Some(robot.placed.gap(polygon));
        }
        let other = &self.robots[j - self.bodies.len()];
        let far = other.pose.point().minus(robot.pose.point()).norm() - other.radius - robot.radius;
        if j - self.bodies.len() == i {
            return None;
        }
        if far > 1.0 {
            // Far enough that only the order of magnitude matters.
            return Some(Gap { distance: far, from: robot.pose.point(), to: other.pose.point() });
        }
        Some(robot.placed.gap(&other.placed))
    }

    fn touched(&mut self, i: usize, j: usize, gap: &Gap) {
        let others = self.bodies.len() + self.robots.len();
        let before = self.touching[i * others + j].replace(Touching { last: self.now });
        if before.is_some_and(|touching| self.now - touching.last <= APART) {
            return;
        }
        let robot = &self.robots[i];
        let other = j.checked_sub(self.bodies.len()).map(|other| &self.robots[other]);
        let middle = match other {
            Some(other) => other.pose.point(),
            None => center(&self.bodies[j].1),
        };
        let towards = middle.minus(robot.pose.point());
        let back = Gap { distance: gap.distance, from: gap.to, to: gap.from };
        let caused_by_other = other.is_some_and(|other| {
            moves_in(&other.motion, gap.to, &back, Point::default().plus(towards, -1.0))
        });
        let contact = Contact {
            time: self.now,
            robot: robot.name.clone(),
            other: other.map_or_else(|| self.bodies[j].0.clone(), |other| other.name.clone()),
            caused: moves_in(&robot.motion, gap.from, gap, towards),
            caused_by_other,
        };
        self.contacts.push(contact);
    }

    /// The contacts that began since they were taken last.
    pub fn take_contacts(&mut self) -> Vec<Contact> {
        std::mem::take(&mut self.contacts)
    }

    /// Where a robot really is.
    pub fn pose(&self, robot: usize) -> Pose {
        self.robots[robot].pose
    }

    /// Where the robot's position and orientation sensors say it is.
    pub fn measured_pose(&mut self, robot: usize) -> Pose {
        let robot = &mut self.robots[robot];
        let NoiseDescription { position, orientation, .. } = robot.noise;
        let mut pose = robot.pose;
        if position > 0.0 || orientation > 0.0 {
            pose.x += position * robot.sensors.normal();
            pose.y += position * robot.sensors.normal();
            pose.theta = wrap_angle(pose.theta + orientation * robot.sensors.normal());
        }
        pose
    }

    /// Where the robot's wheels say it is, and how it moves (m/s, rad/s).
    pub fn odometry(&self, robot: usize) -> (Pose, (f64, f64)) {
        self.robots[robot].drive.odometry()
    }

    /// What the robot's sonars heard, and what they are.
    pub fn sonar(&self, robot: usize) -> Option<(&[Echo], &SonarRing)> {
        let robot = &self.robots[robot];
        robot.sonar.as_ref().map(|ring| (robot.echoes.as_slice(), ring))
    }

    /// The distance from the robot's body to the nearest other one, metres.
    pub fn clearance(&self, robot: usize) -> f64 {
        max(self.robots[robot].clearance, 0.0)
    }

    /// Static bodies with their outlines.
    pub fn bodies(&self) -> &[(String, Polygon)] {
        &self.bodies
    }
}

fn outline_of(world: &str, body: &Body) -> Result<Polygon, DescriptionError> {
    body.polygon().ok_or_else(|| DescriptionError::new(world, format!("body `{}` has no convex outline", body.name)))
}

fn collider(polygon: &Polygon) -> Option<ColliderBuilder> {
    let points: Vec<_> = polygon.points.iter().map(|point| Vector::new(point.x, point.y)).collect();
    ColliderBuilder::convex_hull(&points)
}

fn area(polygon: &Polygon) -> f64 {
    polygon.edges().map(|(a, b)| a.cross(b)).sum::<f64>() / 2.0
}

fn center(polygon: &Polygon) -> Point {
    let count = polygon.points.len() as f64;
    polygon.points.iter().fold(Point::default(), |sum, point| sum.plus(*point, 1.0 / count))
}

/// The velocity of the centre of mass, which the physics engine wants, of a body that turns around its axle.
fn velocity_of_mass(body: &rapier2d_f64::prelude::RigidBody, motion: &Motion) -> Vector {
    let center = body.center_of_mass();
    let velocity = motion.at(Point::new(center.x, center.y));
    Vector::new(velocity.x, velocity.y)
}
