//! Simulation of worlds with robots in virtual time.

mod moving;
mod robot;
mod sensing;

use rapier2d_f64::prelude::{ColliderBuilder, PhysicsWorld, Pose as BodyPose, RigidBodyBuilder, Vector};
use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::{atan2, wrap_angle};
use slate_sorted::SortedMap;

use crate::contact::{CAUSE_SPEED, Contact, Motion};
use crate::drive::{Drive, FourWheels, Velocity};
use crate::fault::Display;
use crate::geometry::{Gap, Point, Polygon, Pose};
use crate::positioning::{Fix, PositioningSystem};
use crate::robot::{
    ImuDescription, OdometryDescription, PositioningDescription, RobotDescription, RobotSensorDescription,
};
use crate::robot_sensor::RobotSensor;
use crate::rough_ground::RoughGround;
use crate::script::{RandomWalk, Wanderer};
use crate::sensors::Sensors;
use crate::sonar::SonarRing;
use crate::surroundings::{Hull, Nearby, Surroundings};
use crate::touching::{BumperContacts, Touching};
use crate::world::{Body, DescriptionError, World};
use moving::Moving;
pub use moving::MovingBodies;
use robot::SimulatedRobot;

/// Robot to be placed in a world.
#[derive(Clone, Debug)]
pub struct Placement {
    /// Name.
    pub name: String,
    /// Description of the robot.
    /// Of the profiles of the sensor that sees other robots it has that with the sonars' name, or else the only one; of
    /// those of the positioning system and of the odometry the only one.
    pub description: RobotDescription,
    /// Profile of the sonars; empty for none.
    pub sonar: String,
    /// Pose.
    pub pose: Pose,
    /// Script of a robot that ignores commands.
    pub script: Option<RandomWalk>,
}

impl Placement {
    /// Returns the profile of the sensor that sees other robots, if any.
    pub fn robot_sensor(&self) -> Option<&RobotSensorDescription> {
        let profiles = &self.description.robot_sensor;
        let only = profiles.values().next().filter(|_| profiles.len() == 1);
        profiles.get(&self.sonar).or(only)
    }

    /// Returns the profile of the positioning system.
    /// An exact one unless the description has one profile.
    pub fn positioning(&self) -> PositioningDescription {
        only(&self.description.positioning)
    }

    /// Returns the profile of the inertial measurement unit, if it carries one.
    /// An exact one unless the description has one profile.
    pub fn imu(&self) -> ImuDescription {
        only(&self.description.imu)
    }

    /// Returns the profile of the odometry.
    /// Without one, errors are those of the wheels only.
    pub fn odometry(&self) -> OdometryDescription {
        only(&self.description.odometry)
    }
}

/// Returns the only profile, or an exact one.
fn only<T: Copy + Default>(profiles: &SortedMap<String, T>) -> T {
    profiles.values().next().filter(|_| profiles.len() == 1).copied().unwrap_or_default()
}

/// Simulation of robots among static bodies.
#[derive(Serialize, Deserialize)]
pub struct Simulation {
    #[serde(with = "slate_sim_state")]
    physics: PhysicsWorld,
    surroundings: Surroundings,
    robots: Vec<SimulatedRobot>,
    /// Sensors of each robot.
    sensors: Vec<Sensors>,
    /// Virtual time, ns.
    now: u64,
    step: u64,
    contacts: Vec<Contact>,
    touching: Touching,
    /// People and doors.
    #[serde(default, skip_serializing_if = "Moving::is_empty")]
    moving: Moving,
    /// Shaking of the robots by the ground.
    #[serde(default, skip_serializing_if = "RoughGround::is_even")]
    ground: RoughGround,
    /// Contacts that each robot feels.
    #[serde(rename = "felt")]
    bumper_contacts: Vec<BumperContacts>,
    /// Scratch memory for the neighborhood of a robot, one per thread.
    /// The number of threads is not part of the state.
    #[serde(skip, default = "one_thread")]
    nearby: Vec<Nearby>,
}

fn one_thread() -> Vec<Nearby> {
    vec![Nearby::default()]
}

impl std::fmt::Debug for Simulation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Simulation")
            .field("now", &self.now)
            .field("robots", &self.robots.len())
            .finish_non_exhaustive()
    }
}

impl Simulation {
    /// Creates a world with robots at time 0.
    /// `step` is the physics step, ns.
    ///
    /// # Errors
    /// If a robot's sensor profile is unknown, a robot is in collision, or its script needs other sensors.
    pub fn new(world: &World, robots: &[Placement], seed: u64, step: u64) -> Result<Self, DescriptionError> {
        Self::with_moving(world, robots, &MovingBodies::default(), seed, step)
    }

    /// Creates a world with robots, people and doors.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_moving(
        world: &World,
        robots: &[Placement],
        moving: &MovingBodies,
        seed: u64,
        step: u64,
    ) -> Result<Self, DescriptionError> {
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
            surroundings: Surroundings::new(bodies, world.map.clone()),
            robots: Vec::new(),
            sensors: Vec::new(),
            now: 0,
            step,
            contacts: Vec::new(),
            touching: Touching::default(),
            moving: Moving::default(),
            ground: RoughGround::of(&world.scenery),
            bumper_contacts: vec![BumperContacts::default(); robots.len()],
            nearby: one_thread(),
        };
        for placement in robots {
            simulation.place(placement, seed)?;
        }
        simulation.add_moving(moving, seed)?;
        simulation.surroundings.arrange();
        simulation.sense();
        Ok(simulation)
    }

    fn place(&mut self, placement: &Placement, seed: u64) -> Result<(), DescriptionError> {
        let Placement { name, description, sonar, pose, script } = placement;
        let wrong = |message: String| DescriptionError::new(&description.name, message);
        let stream = |sensor: &str| Random::new(seed, &format!("simulation/{name}/{sensor}"));
        let ring = match description.sonar.get(sonar) {
            Some(profile) => Some(profile),
            None if sonar.is_empty() => None,
            None => {
                let known: Vec<_> = description.sonar.keys().map(String::as_str).collect();
                return Err(wrong(match known[..] {
                    [] => format!("no sonar profile `{sonar}`: the robot has no sonars"),
                    _ => format!("no sonar profile `{sonar}`; there are {}", known.join(", ")),
                }));
            }
        };
        let frame = pose.frame();
        let hull = Hull::new(description.outline(), frame);
        self.find_room(name, &hull).map_err(wrong)?;
        let area = area(&description.outline());
        let number = self.surroundings.bodies().len() + self.robots.len();
        let collider = collider(&description.outline())
            .ok_or_else(|| wrong("the footprint is not convex".into()))?
            .density(description.mass / area)
            .friction(0.2)
            .user_data(number as u128)
            .build();
        let properties = collider.mass_properties();
        let center = Point::new(properties.local_com.x, properties.local_com.y);
        let body = RigidBodyBuilder::dynamic()
            .pose(BodyPose::new(Vector::new(pose.x, pose.y), pose.theta))
            .can_sleep(false);
        let (handle, _) = self.physics.insert(body, collider);
        let script = script.map(|walk| Wanderer::new(walk, ring, stream("script")));
        let mut drive =
            Drive::new(&description.drive, &description.noise, description.mass, center, stream("drive"));
        drive.set_odometry_bias(&placement.odometry(), stream("odometry"));
        self.robots.push(SimulatedRobot {
            name: name.clone(),
            handle,
            mass: description.mass,
            moment: properties.principal_inertia(),
            center,
            pose: *pose,
            velocity: Point::default(),
            turn: 0.0,
            motion: Motion { origin: pose.point(), ..Motion::default() },
            drive,
            script: script.transpose().map_err(|message| wrong(format!("`{name}`: {message}")))?,
            bumper: description.bumper,
            positioning: PositioningSystem::new(placement.positioning(), stream("pose")),
        });
        self.sensors.push(Sensors {
            sonar: ring.map(|profile| SonarRing::new(profile, stream("sonar"))),
            echoes: Vec::with_capacity(16),
            laser: None,
            sonar_display: Display::default(),
            laser_display: Display::default(),
            position_display: Display::default(),
            orientation_display: Display::default(),
            odometry_display: Display::default(),
            sightings_display: Display::default(),
            imu: None,
            camera: None,
            robot_sensor: placement
                .robot_sensor()
                .map(|profile| RobotSensor::new(profile, stream("robot_sensor"))),
        });
        self.surroundings.add(hull);
        Ok(())
    }

    /// Refuses a robot in collision.
    fn find_room(&self, name: &str, hull: &Hull) -> Result<(), String> {
        let statics = self.surroundings.bodies().len();
        for number in 0..statics + self.robots.len() {
            let (center, radius) = self.surroundings.circle(number);
            if center.minus(hull.frame().origin).norm() > radius + hull.radius() {
                continue;
            }
            if hull.outline().gap(self.surroundings.outline(number)).distance <= 0.0 {
                let other = match number.checked_sub(statics) {
                    Some(robot) => &self.robots[robot].name,
                    None => &self.surroundings.bodies()[number].0,
                };
                return Err(format!("`{name}` stands in `{other}`"));
            }
        }
        Ok(())
    }

    /// Sets the number of measuring threads; 1 by default. Results are the same.
    pub fn set_threads(&mut self, threads: usize) {
        self.nearby.resize_with(threads.max(1), Nearby::default);
    }

    /// Takes over a decoded state of another simulation of the same world and robots.
    pub fn resume(&mut self, mut state: Self) {
        state.set_map_of(self);
        *self = state;
    }

    /// Takes over the parts that are no state from a simulation of the same world.
    fn set_map_of(&mut self, other: &Self) {
        self.surroundings.set_map(other.surroundings.map().cloned());
        self.moving.set_paths_of(&other.moving);
        for (own, other) in self.sensors.iter_mut().zip(&other.sensors) {
            if let (Some(own), Some(other)) = (&mut own.camera, &other.camera) {
                own.set_world_of(other);
            }
        }
    }

    /// Returns the virtual time, ns.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Returns the physics step, ns.
    pub fn step_time(&self) -> u64 {
        self.step
    }

    /// Returns the number of a robot.
    pub fn robot(&self, name: &str) -> Option<usize> {
        self.robots.iter().position(|robot| robot.name == name)
    }

    /// Returns the name of a robot.
    pub fn name(&self, robot: usize) -> &str {
        &self.robots[robot].name
    }

    /// Returns the number of robots.
    pub fn robot_count(&self) -> usize {
        self.robots.len()
    }

    /// Sets the wheel speeds of a robot: those of its two sides, or each of four.
    /// A scripted robot follows its script instead.
    pub fn command(&mut self, robot: usize, wheels: impl Into<FourWheels>) {
        if let Some(robot) = self.robots.get_mut(robot).filter(|robot| robot.script.is_none()) {
            robot.drive.command(wheels.into());
        }
    }

    /// Sets the wheel speeds of a robot with omni wheels, in their order, rad/s.
    pub fn command_omni(&mut self, robot: usize, speeds: impl IntoIterator<Item = f64>) {
        if let Some(robot) = self.robots.get_mut(robot).filter(|robot| robot.script.is_none()) {
            robot.drive.command_omni(speeds);
        }
    }

    /// Sets the velocity of a robot with omni wheels.
    pub fn command_velocity(&mut self, robot: usize, velocity: Velocity) {
        if let Some(robot) = self.robots.get_mut(robot).filter(|robot| robot.script.is_none()) {
            robot.drive.command_velocity(velocity);
        }
    }

    /// Advances virtual time by one step, without sensing.
    pub fn step(&mut self) {
        let step = self.step as f64 * 1e-9;
        for ((robot, sensors), bumper_contacts) in
            self.robots.iter_mut().zip(&self.sensors).zip(&self.bumper_contacts)
        {
            robot.drive(&sensors.echoes, *bumper_contacts, step);
            let body = &mut self.physics.bodies[robot.handle];
            body.set_linvel(Vector::new(robot.velocity.x, robot.velocity.y), true);
            body.set_angvel(robot.turn, true);
        }
        self.sensors.iter_mut().filter_map(|own| own.camera.as_mut()).for_each(|camera| camera.advance(step));
        self.decide_moving(step);
        self.physics.step();
        self.now += self.step;
        for (robot, hull) in self.robots.iter_mut().zip(self.surroundings.hulls_mut()) {
            let body = &self.physics.bodies[robot.handle];
            let (position, velocity) = (body.position(), body.linvel());
            let rotation = position.rotation;
            robot.pose = Pose {
                x: position.translation.x,
                y: position.translation.y,
                theta: wrap_angle(atan2(rotation.im, rotation.re)),
            };
            (robot.velocity, robot.turn) = (Point::new(velocity.x, velocity.y), body.angvel());
            hull.place(robot.pose.frame());
        }
        self.place_moving();
        self.surroundings.arrange();
        self.touch();
    }

    /// Finds contacts that begin, and the state of the bumpers.
    fn touch(&mut self) {
        let Self { physics, surroundings, robots, moving, bumper_contacts, touching, contacts, now, .. } =
            self;
        let statics = surroundings.bodies().len();
        let begin = |(i, j): (usize, usize), towards: Point, gap: Gap| {
            let robot = &robots[i];
            let (other, motion) = match j.checked_sub(statics) {
                None => (surroundings.bodies()[j].0.as_str(), None),
                Some(mover) => match robots.get(mover) {
                    Some(other) => (other.name.as_str(), Some(other.motion)),
                    None => {
                        let (name, motion) = moving.mover(mover - robots.len());
                        (name, Some(motion))
                    }
                },
            };
            let own = robot.motion.towards(gap.from, towards);
            let theirs = motion.map_or(0.0, |motion| -motion.towards(gap.to, towards));
            contacts.push(Contact {
                time: *now,
                robot: robot.name.clone(),
                other: other.into(),
                caused: own > CAUSE_SPEED,
                caused_by_other: theirs > CAUSE_SPEED,
                approach: own + theirs,
            });
        };
        bumper_contacts.fill(BumperContacts::default());
        let feel = |(i, j): (usize, usize), gap: Gap| {
            bumper_contacts[i].press(surroundings.robots()[i].frame().local(gap.from), robots[i].bumper);
            if let Some(other) = j.checked_sub(statics).filter(|mover| *mover < robots.len()) {
                bumper_contacts[other]
                    .press(surroundings.robots()[other].frame().local(gap.to), robots[other].bumper);
            }
        };
        touching.update(physics, surroundings, *now, begin, feel);
    }

    /// Returns the contacts that the robot feels.
    pub fn bumper_contacts(&self, robot: usize) -> BumperContacts {
        self.bumper_contacts[robot]
    }

    /// Returns whether the robot has bumpers.
    pub fn has_bumper(&self, robot: usize) -> bool {
        self.robots[robot].bumper.is_some()
    }

    /// Returns whether the robot touches something.
    pub fn touches(&self, robot: usize) -> bool {
        self.bumper_contacts[robot].anywhere
    }

    /// Takes the contacts that began since the last call.
    pub fn take_contacts(&mut self) -> Vec<Contact> {
        std::mem::take(&mut self.contacts)
    }

    /// Returns the true pose of a robot.
    pub fn pose(&self, robot: usize) -> Pose {
        self.robots[robot].pose
    }

    /// Measures with the robot's positioning system and compass, if due.
    pub fn fix(&mut self, robot: usize) -> Fix {
        let SimulatedRobot { positioning, pose, .. } = &mut self.robots[robot];
        positioning.measure(*pose, self.now)
    }

    /// Returns pose and twist (m/s, rad/s) by odometry.
    pub fn odometry(&self, robot: usize) -> (Pose, (f64, f64)) {
        self.robots[robot].drive.odometry()
    }

    /// Returns the distance from the robot's body to the nearest other one, m.
    pub fn clearance(&self, robot: usize) -> f64 {
        self.surroundings.clearance(robot)
    }

    /// Returns the static bodies with their outlines.
    pub fn bodies(&self) -> &[(String, Polygon)] {
        self.surroundings.bodies()
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
