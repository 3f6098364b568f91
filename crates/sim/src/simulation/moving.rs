//! People and doors among the robots.

use rapier2d_f64::prelude::{ColliderBuilder, Pose as BodyPose, RigidBodyBuilder, RigidBodyHandle, Vector};
use serde::{Deserialize, Serialize};
use slate_sorted::SortedMap;

use super::{Simulation, collider};
use crate::contact::Motion;
use crate::door::{Door, DoorDescription};
use crate::error::key;
use crate::geometry::{Point, Polygon, Pose};
use crate::people::{Crowd, PeopleLayout};
use crate::surroundings::{Hull, Mover};
use crate::world::DescriptionError;

/// Mass of a person, kg.
const MASS: f64 = 75.0;

/// People and doors of a world.
#[derive(Clone, Debug, Default)]
pub struct MovingBodies {
    /// The people, if there are any.
    pub people: Option<PeopleLayout>,
    /// The doors, by name.
    pub doors: SortedMap<String, DoorDescription>,
}

/// People and doors with their bodies.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Moving {
    crowd: Crowd,
    /// Body of each person.
    bodies: Vec<RigidBodyHandle>,
    doors: Vec<Door>,
    /// Scratch memory for the velocities of all movers.
    #[serde(skip)]
    velocities: Vec<Point>,
}

impl Moving {
    /// Returns whether the world has neither people nor doors.
    pub fn is_empty(&self) -> bool {
        self.crowd.is_empty() && self.doors.is_empty()
    }

    /// Takes over the parts that are no state from the same world.
    pub fn set_paths_of(&mut self, other: &Self) {
        self.crowd.set_paths_of(&other.crowd);
    }

    /// Returns name and motion of a mover, by its number after the robots.
    pub fn mover(&self, number: usize) -> (&str, Motion) {
        match number.checked_sub(self.crowd.people().len()) {
            None => {
                let person = &self.crowd.people()[number];
                (&person.name, person.motion)
            }
            Some(number) => {
                let door = &self.doors[number];
                let motion = Motion { origin: door.pose().point(), velocity: door.velocity, angular: 0.0 };
                (&door.name, motion)
            }
        }
    }
}

impl Simulation {
    /// Adds people and doors.
    pub(super) fn add_moving(&mut self, moving: &MovingBodies, seed: u64) -> Result<(), DescriptionError> {
        if let Some(people) = &moving.people {
            self.moving.crowd = Crowd::new(people, seed);
            let outline = people.outline();
            for (_, pose) in people.starts() {
                let body = RigidBodyBuilder::dynamic().lock_rotations().can_sleep(false);
                // A disc, so that the normal of a contact is that on which a person holds back.
                let disc = ColliderBuilder::ball(people.radius()).mass(MASS);
                let handle = self.add_mover(Mover::Person, body, disc, &outline, pose);
                self.moving.bodies.push(handle);
            }
        }
        for (name, door) in &moving.doors {
            let pose = door.leaf(door.opening_at_start());
            self.check_doorway(name, &Hull::new(door.outline(), pose.frame()))?;
            let body = RigidBodyBuilder::kinematic_position_based();
            let outline = door.outline();
            let leaf = collider(&outline).ok_or_else(|| {
                DescriptionError::new(&format!("world.doors.{}", key(name)), "the leaf has no convex outline")
            })?;
            let handle = self.add_mover(Mover::Door, body, leaf, &outline, pose);
            self.moving.doors.push(Door::new(name, handle, *door));
        }
        Ok(())
    }

    /// Refuses a door with a robot in its doorway.
    fn check_doorway(&self, name: &str, leaf: &Hull) -> Result<(), DescriptionError> {
        let hulls = self.surroundings.robots().iter();
        let mut robots = self.robots.iter().zip(hulls);
        match robots.find(|(_, hull)| hull.outline().gap(leaf.outline()).distance <= 0.0) {
            None => Ok(()),
            Some((robot, _)) => {
                let message = format!("the robot `{}` stands in the door; move one of them", robot.name);
                Err(DescriptionError::new(&format!("world.doors.{}", key(name)), message))
            }
        }
    }

    fn add_mover(
        &mut self,
        mover: Mover,
        body: RigidBodyBuilder,
        collider: ColliderBuilder,
        outline: &Polygon,
        pose: Pose,
    ) -> RigidBodyHandle {
        let number = self.surroundings.bodies().len() + self.surroundings.hulls().len();
        let body = body.pose(BodyPose::new(Vector::new(pose.x, pose.y), pose.theta));
        let (handle, _) = self.physics.insert(body, collider.friction(0.2).user_data(number as u128));
        self.surroundings.add_mover(mover, Hull::new(outline.clone(), pose.frame()));
        handle
    }

    /// Computes the motion of people and doors in the next `step` seconds.
    pub(super) fn decide_moving(&mut self, step: f64) {
        if self.moving.is_empty() {
            return;
        }
        let Moving { crowd, bodies, doors, velocities } = &mut self.moving;
        velocities.clear();
        velocities.extend(self.robots.iter().map(|robot| robot.velocity));
        velocities.extend(crowd.people().iter().map(|person| person.velocity));
        velocities.extend(doors.iter().map(|door| door.velocity));
        crowd.walk(&self.surroundings, velocities, self.now, step);
        for (person, handle) in crowd.people().iter().zip(bodies.iter()) {
            let Point { x, y } = person.motion.velocity;
            self.physics.bodies[*handle].set_linvel(Vector::new(x, y), true);
        }
        for door in doors {
            door.slide(&self.surroundings, self.now, step);
            let Pose { x, y, theta } = door.pose();
            let pose = BodyPose::new(Vector::new(x, y), theta);
            self.physics.bodies[door.handle].set_next_kinematic_position(pose);
        }
    }

    /// Updates people and doors from the physics.
    pub(super) fn place_moving(&mut self) {
        let robots = self.robots.len();
        let Moving { crowd, bodies, doors, .. } = &mut self.moving;
        let mut hulls = self.surroundings.hulls_mut()[robots..].iter_mut();
        for ((person, handle), hull) in crowd.people_mut().iter_mut().zip(bodies.iter()).zip(&mut hulls) {
            let body = &self.physics.bodies[*handle];
            let (place, velocity) = (body.translation(), body.linvel());
            person.moved(Point::new(place.x, place.y), Point::new(velocity.x, velocity.y));
            // A disc needs no heading.
            hull.place(Pose { theta: 0.0, ..person.pose() }.frame());
        }
        for (door, hull) in doors.iter().zip(hulls) {
            hull.place(door.pose().frame());
        }
    }

    /// Returns names and poses of the people.
    pub fn people(&self) -> impl Iterator<Item = (&str, Pose)> {
        self.moving.crowd.people().iter().map(|person| (person.name.as_str(), person.pose()))
    }

    /// Returns the doors: names, poses of their leaves, and open parts of the doorways.
    pub fn doors(&self) -> impl Iterator<Item = (&str, Pose, f64)> {
        self.moving.doors.iter().map(|door| (door.name.as_str(), door.pose(), door.opening))
    }
}
