use rapier2d_f64::prelude::RigidBodyHandle;
use serde::{Deserialize, Serialize};

use crate::contact::Motion;
use crate::drive::{Drive, Mass, Velocity};
use crate::geometry::{Frame, Point, Pose};
use crate::positioning::PositioningSystem;
use crate::robot::BumperDescription;
use crate::script::Wanderer;
use crate::sonar::Echo;
use crate::touching::BumperContacts;

/// Robot with its motion.
#[derive(Serialize, Deserialize)]
pub(super) struct SimulatedRobot {
    pub name: String,
    pub handle: RigidBodyHandle,
    pub mass: f64,
    /// Moment of inertia about the center of mass, kg m².
    pub moment: f64,
    /// Center of mass in the robot's frame.
    pub center: Point,
    pub pose: Pose,
    /// Velocity of the center of mass in the world, m/s.
    pub velocity: Point,
    pub turn: f64,
    /// Motion by the drive.
    pub motion: Motion,
    pub drive: Drive,
    pub script: Option<Wanderer>,
    pub bumper: Option<BumperDescription>,
    pub positioning: PositioningSystem,
}

impl SimulatedRobot {
    /// Returns the motion of its body, by its drive or pushed.
    pub fn body_motion(&self) -> Motion {
        let center = self.pose.frame().apply(self.center);
        Motion { origin: center, velocity: self.velocity, angular: self.turn }
    }

    /// Computes the robot's motion in the next `step` seconds.
    pub fn drive(&mut self, echoes: &[Echo], bumper_contacts: BumperContacts, step: f64) {
        if let Some(script) = &mut self.script {
            self.drive.command(script.decide(echoes, step).into());
        }
        let origin = self.pose.point();
        match &mut self.drive {
            Drive::Differential(drive) => {
                let (linear, angular) = drive.advance(step);
                // A turning robot goes along the chord of its arc.
                let middle = Pose { theta: self.pose.theta + angular * step / 2.0, ..self.pose }.frame();
                let Frame { cos, sin, .. } = middle;
                let velocity = Point::new(linear * cos, linear * sin);
                self.motion = Motion { origin, velocity, angular };
                (self.velocity, self.turn) = (self.motion.at(middle.apply(self.center)), angular);
            }
            Drive::Omni(drive) => {
                let Velocity { forward, left, turn } = drive.advance(step);
                let middle = Pose { theta: self.pose.theta + turn * step / 2.0, ..self.pose }.frame();
                let velocity = middle.rotate(Point::new(forward, left));
                self.motion = Motion { origin, velocity, angular: turn };
                (self.velocity, self.turn) = (self.motion.at(middle.apply(self.center)), turn);
            }
            Drive::SkidSteer(drive) => {
                drive.follow(step);
                let middle = Pose { theta: self.pose.theta + self.turn * step / 2.0, ..self.pose }.frame();
                let Point { x, y } = middle.turn_back(self.velocity);
                let body = Mass { mass: self.mass, moment: self.moment };
                let Velocity { forward, left, turn } =
                    drive.rub(body, Velocity { forward: x, left: y, turn: self.turn }, step);
                self.velocity = middle.rotate(Point::new(forward, left));
                self.turn = turn;
                // A robot that others push does not move itself.
                let pushed = bumper_contacts.anywhere && drive.stands();
                let whole =
                    Motion { origin: middle.apply(self.center), velocity: self.velocity, angular: turn };
                self.motion = match pushed {
                    true => Motion { origin, ..Motion::default() },
                    false => Motion { origin, velocity: whole.at(origin), angular: turn },
                };
            }
        }
    }
}
