//! Worlds with robots in virtual time.

use std::collections::BTreeMap;

use rapier2d_f64::prelude::{
    ColliderBuilder, PhysicsWorld, Pose as BodyPose, RigidBodyBuilder, RigidBodyHandle, Vector,
};
use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{atan2, min, wrap_angle};

use crate::contact::{APART, CAUSE_SPEED, Contact, GRAZE, Motion, TOUCH};
use crate::drive::{Drive, Wheels};
use crate::geometry::{Extent, Frame, Point, Polygon, Pose, nearest_on};
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
    /// Where the static bodies are, roughly.
    extents: Vec<Extent>,
    robots: Vec<Robot>,
    /// Nanoseconds.
    now: u64,
    step: u64,
    contacts: Vec<Contact>,
    /// Robots and other bodies in contact, and when they touched last, nanoseconds.
    touching: BTreeMap<(usize, usize), u64>,
    /// Memory for the edges around a robot.
    #[serde(skip)]
    edges: Vec<(Point, Point)>,
}

impl std::fmt::Debug for Simulation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Simulation")
            .field("now", &self.now)
            .field("robots", &self.robots.len())
            .finish_non_exhaustive()
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
        // By default rapier keeps contacts while bodies move by up to 5 cm, so that a robot would meet walls that end
        // before it.
        physics.integration_parameters.contact_recycling = false;
        let mut bodies = Vec::new();
        for body in &world.bodies {
            let polygon = outline_of(&world.name, body)?;
            let collider = collider(&polygon).ok_or_else(|| {
                DescriptionError::new(&world.name, format!("body `{}` is not convex", body.name))
            })?;
            physics.insert(RigidBodyBuilder::fixed(), collider.user_data(bodies.len() as u128));
            bodies.push((body.name.clone(), polygon));
        }
        let mut simulation = Self {
            physics,
            extents: bodies.iter().map(|(_, polygon)| polygon.extent()).collect(),
            bodies,
            robots: Vec::new(),
            now: 0,
            step,
            contacts: Vec::new(),
            touching: BTreeMap::new(),
            edges: Vec::new(),
        };
        for placement in robots {
            simulation.place(placement, seed)?;
        }
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
        let others = self
            .bodies
            .iter()
            .map(|(name, polygon)| (name, polygon))
            .chain(self.robots.iter().map(|robot| (&robot.name, &robot.placed)));
        for (other, polygon) in others {
            if placed.gap(polygon).distance <= 0.0 {
                return Err(wrong(format!("`{name}` stands in `{other}`")));
            }
        }
        let area = area(&outline);
        let number = self.bodies.len() + self.robots.len();
        let collider = collider(&outline).ok_or_else(|| wrong("the footprint is not convex".into()))?;
        let body = RigidBodyBuilder::dynamic()
            .pose(BodyPose::new(Vector::new(pose.x, pose.y), pose.theta))
            .can_sleep(false);
        let (handle, _) = self
            .physics
            .insert(body, collider.density(description.mass / area).friction(0.2).user_data(number as u128));
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
            // A turning robot goes along the chord of its arc.
            let middle = Pose { theta: robot.pose.theta + angular * step / 2.0, ..robot.pose }.frame();
            let Frame { cos, sin, .. } = middle;
            let velocity = Point::new(linear * cos, linear * sin);
            robot.motion = Motion { origin: robot.pose.point(), velocity, angular };
            let body = &mut self.physics.bodies[robot.handle];
            let center = body.local_center_of_mass();
            let velocity = robot.motion.at(middle.apply(Point::new(center.x, center.y)));
            body.set_linvel(Vector::new(velocity.x, velocity.y), true);
            body.set_angvel(angular, true);
        }
        self.physics.step();
        self.now += self.step;
        for robot in &mut self.robots {
            let position = self.physics.bodies[robot.handle].position();
            let rotation = position.rotation;
            robot.pose = Pose {
                x: position.translation.x,
                y: position.translation.y,
                theta: wrap_angle(atan2(rotation.im, rotation.re)),
            };
            robot.outline.place(&robot.pose.frame(), &mut robot.placed);
        }
        self.touch();
    }

    /// Lets the sonars hear.
    pub fn sense(&mut self) {
        for i in 0..self.robots.len() {
            let (mut sonar, mut echoes) =
                (self.robots[i].sonar.take(), std::mem::take(&mut self.robots[i].echoes));
            if let Some(ring) = &mut sonar {
                self.gather(i, ring.reach());
                ring.sweep(&self.robots[i].pose.frame(), &self.edges, &mut echoes);
            }
            self.robots[i].sonar = sonar;
            self.robots[i].echoes = echoes;
        }
    }

    /// Gathers the edges of other bodies within `reach` of a robot.
    fn gather(&mut self, i: usize, reach: f64) {
        let center = self.robots[i].pose.point();
        let bodies =
            self.bodies.iter().zip(&self.extents).filter(|(_, extent)| extent.distance(center) <= reach);
        let robots = self.robots.iter().enumerate().filter(|(other, robot)| {
            *other != i && robot.pose.point().minus(center).norm() <= reach + robot.radius
        });
        let polygons = bodies.map(|((_, polygon), _)| polygon).chain(robots.map(|(_, robot)| &robot.placed));
        self.edges.clear();
        self.edges.extend(
            polygons
                .flat_map(Polygon::edges)
                .filter(|(a, b)| nearest_on(*a, *b, center).minus(center).norm() <= reach),
        );
    }

    /// Finds which contacts begin, last and end.
    fn touch(&mut self) {
        let mut pressing = Vec::new();
        for pair in self.physics.narrow_phase.contact_pairs().filter(|pair| pair.has_any_active_contact()) {
            let (impulse, normal) = pair.max_impulse();
            let number =
                |handle| self.physics.colliders.get(handle).map(|collider| collider.user_data as usize);
            let (Some(first), Some(second)) = (number(pair.collider1), number(pair.collider2)) else {
                continue;
            };
            if impulse > 0.0 {
                let normal = Point::new(normal.x, normal.y);
                // The robot, or of two robots the first, looks at the other.
                pressing.push(match self.first_robot(first, second) {
                    true => ((first - self.bodies.len(), second), normal),
                    false => ((second - self.bodies.len(), first), Point::default().minus(normal)),
                });
            }
        }
        pressing.sort_by_key(|(pair, _)| *pair);
        for ((i, j), towards) in pressing {
            // The solver also presses on what would meet within the step; where a corner only grazed another, the
            // bodies are still apart afterwards.
            if !self.touching.contains_key(&(i, j))
                && self.robots[i].placed.gap(self.outline(j)).distance > GRAZE
            {
                continue;
            }
            if self.touching.insert((i, j), self.now).is_none() {
                self.begin(i, j, towards);
            }
        }
        let mut touching = std::mem::take(&mut self.touching);
        touching.retain(|(i, j), last| {
            if *last != self.now && self.robots[*i].placed.gap(self.outline(*j)).distance < TOUCH {
                *last = self.now;
            }
            self.now - *last < APART
        });
        self.touching = touching;
    }

    /// Whether the first of two bodies is the robot that looks at the other: walls do not, and robots do in order.
    fn first_robot(&self, first: usize, second: usize) -> bool {
        first >= self.bodies.len() && (second < self.bodies.len() || first < second)
    }

    /// The outline of a static body or, after those, of a robot.
    fn outline(&self, number: usize) -> &Polygon {
        match number.checked_sub(self.bodies.len()) {
            Some(robot) => &self.robots[robot].placed,
            None => &self.bodies[number].1,
        }
    }

    fn begin(&mut self, i: usize, j: usize, towards: Point) {
        let robot = &self.robots[i];
        let other = j.checked_sub(self.bodies.len()).map(|other| &self.robots[other]);
        let gap = robot.placed.gap(self.outline(j));
        let own = robot.motion.towards(gap.from, towards);
        let theirs = other.map_or(0.0, |other| -other.motion.towards(gap.to, towards));
        self.contacts.push(Contact {
            time: self.now,
            robot: robot.name.clone(),
            other: other.map_or_else(|| self.bodies[j].0.clone(), |other| other.name.clone()),
            caused: own > CAUSE_SPEED,
            caused_by_other: theirs > CAUSE_SPEED,
            approach: own + theirs,
        });
    }

    /// Whether the robot touches something: its bumper.
    pub fn touches(&self, robot: usize) -> bool {
        let other = self.bodies.len() + robot;
        self.touching.iter().any(|((i, j), last)| *last == self.now && (*i == robot || *j == other))
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
        let Robot { placed, pose, radius, .. } = &self.robots[robot];
        let center = pose.point();
        let bodies = self.bodies.iter().zip(&self.extents);
        let bodies = bodies.map(|((_, polygon), extent)| (extent.distance(center) - radius, polygon));
        let others = self.robots.iter().enumerate().filter(|(other, _)| *other != robot);
        let robots = others.map(|(_, other)| {
            (other.pose.point().minus(center).norm() - other.radius - radius, &other.placed)
        });
        bodies.chain(robots).fold(f64::INFINITY, |nearest, (at_least, polygon)| {
            if at_least >= nearest { nearest } else { min(nearest, placed.gap(polygon).distance) }
        })
    }

    /// Static bodies with their outlines.
    pub fn bodies(&self) -> &[(String, Polygon)] {
        &self.bodies
    }
}

fn outline_of(world: &str, body: &Body) -> Result<Polygon, DescriptionError> {
    body.polygon()
        .ok_or_else(|| DescriptionError::new(world, format!("body `{}` has no convex outline", body.name)))
}

fn collider(polygon: &Polygon) -> Option<ColliderBuilder> {
    let points: Vec<_> = polygon.points.iter().map(|point| Vector::new(point.x, point.y)).collect();
    ColliderBuilder::convex_hull(&points)
}

fn area(polygon: &Polygon) -> f64 {
    polygon.edges().map(|(a, b)| a.cross(b)).sum::<f64>() / 2.0
}
