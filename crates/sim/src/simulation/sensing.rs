//! What the robots measure, and what their sensors show of it.

use slate_module::Random;

use super::Simulation;
use crate::fault::{Fault, FaultySensor};
use crate::laser::LaserScanner;
use crate::robot::LaserDescription;
use crate::robot_sensor::RobotSensor;
use crate::sensors::Sensors;
use crate::sonar::{Echo, SonarRing};
use crate::workers;

impl Simulation {
    /// Mounts a laser scanner on a robot. It looks from the next time on at which robots measure.
    pub fn mount_laser(&mut self, robot: usize, laser: &LaserDescription, seed: u64) {
        let random = Random::new(seed, &format!("simulation/{}/laser", self.robots[robot].name));
        self.sensors[robot].laser = Some(LaserScanner::new(laser, random));
    }

    /// Says what goes wrong with the sensors of a robot, and when.
    pub fn set_faults(&mut self, robot: usize, faults: &[Fault]) {
        let sensors = &mut self.sensors[robot];
        sensors.sonar_display.set_faults(FaultySensor::Sonar, faults);
        sensors.laser_display.set_faults(FaultySensor::Laser, faults);
    }

    /// Lets the robots measure what is around them.
    pub fn sense(&mut self) {
        let Self { sensors, surroundings, now, nearby, .. } = self;
        workers::each(sensors, nearby, |robot, sensors, nearby| {
            sensors.sense(robot, surroundings, *now, nearby);
        });
    }

    /// What the robot's sonars heard, and what they are.
    pub fn sonar(&self, robot: usize) -> Option<(&[Echo], &SonarRing)> {
        let sensors = &self.sensors[robot];
        sensors.sonar.as_ref().map(|ring| (sensors.echoes.as_slice(), ring))
    }

    /// What the robot's sonars show now, which is what they heard unless they fail; nothing when they show nothing new.
    pub fn shown_sonar(&mut self, robot: usize) -> Option<&[Echo]> {
        let Sensors { sonar, echoes, sonar_display, .. } = &mut self.sensors[robot];
        sonar.as_ref().and_then(|_| sonar_display.show(echoes, self.now)).map(Vec::as_slice)
    }

    /// The robot's laser scanner, if it carries one.
    pub fn laser(&self, robot: usize) -> Option<&LaserScanner> {
        self.sensors[robot].laser.as_ref()
    }

    /// What the robot's laser scanner shows now, in metres from its first beam on; nothing when it shows nothing new.
    pub fn shown_laser(&mut self, robot: usize) -> Option<(&[f32], &LaserDescription)> {
        let Sensors { laser, laser_display, .. } = &mut self.sensors[robot];
        let laser = laser.as_ref().filter(|laser| laser.last() == Some(self.now))?;
        let ranges = laser_display.show(laser.ranges(), self.now)?;
        Some((ranges, laser.description()))
    }

    /// The sensor that sees other robots, and what it saw.
    pub fn robot_sensor(&self, robot: usize) -> Option<&RobotSensor> {
        self.sensors[robot].robot_sensor.as_ref()
    }
}
