//! Measurements of the robots, with the faults of their sensors.

use std::sync::Arc;

use slate_module::Random;

use super::Simulation;
use crate::camera::CameraSensor;
use crate::fault::{Fault, FaultySensor};
use crate::geometry::Pose;
use crate::inertial::{InertialReading, InertialSensor};
use crate::laser::LaserScanner;
use crate::positioning::Fix;
use crate::render::RenderedWorld;
use crate::robot::{CameraDescription, ImuDescription, LaserDescription};
use crate::robot_sensor::{RobotSensor, Sighting};
use crate::sensors::Sensors;
use crate::sonar::{Echo, SonarRing};
use crate::workers;

impl Simulation {
    /// Mounts a laser scanner on a robot.
    /// It measures from the next measurement of the robots on.
    pub fn mount_laser(&mut self, robot: usize, laser: &LaserDescription, seed: u64) {
        let random = Random::new(seed, &format!("simulation/{}/laser", self.robots[robot].name));
        self.sensors[robot].laser = Some(LaserScanner::new(laser, random));
    }

    /// Mounts a camera that sees `world` on a robot.
    /// It takes images from the next measurement of the robots on.
    pub fn mount_camera(
        &mut self,
        robot: usize,
        camera: &CameraDescription,
        world: &Arc<RenderedWorld>,
        seed: u64,
    ) {
        let random = Random::new(seed, &format!("simulation/{}/camera", self.robots[robot].name));
        self.sensors[robot].camera = Some(CameraSensor::new(camera, world.clone(), random));
    }

    /// Returns the description of a robot's camera, if any.
    pub fn camera(&self, robot: usize) -> Option<&CameraDescription> {
        self.sensors[robot].camera.as_ref().map(CameraSensor::description)
    }

    /// Returns the newest image of a robot's camera; empty before the first.
    /// Red, green and blue of each pixel, row by row from the top.
    pub fn image(&self, robot: usize) -> &[u8] {
        self.sensors[robot].camera.as_ref().map_or(&[], CameraSensor::pixels)
    }

    /// Returns the new image of a robot's camera, with faults, if any.
    pub fn shown_image(&mut self, robot: usize) -> Option<&[u8]> {
        let now = self.now;
        self.sensors[robot].camera.as_mut().filter(|camera| camera.last() == Some(now))?.shown(now)
    }

    /// Sets pan and tilt of a camera's head, rad, within the limits.
    /// NaN keeps the previous setpoint.
    pub fn command_head(&mut self, robot: usize, angles: [f64; 2]) {
        if let Some(camera) = &mut self.sensors[robot].camera {
            camera.command(angles);
        }
    }

    /// Returns pan and tilt of a camera's head, rad, and their rates, rad/s.
    pub fn head(&self, robot: usize) -> Option<([f64; 2], [f64; 2])> {
        self.sensors[robot].camera.as_ref().and_then(CameraSensor::head)
    }

    /// Mounts an inertial measurement unit on a robot.
    pub fn mount_imu(&mut self, robot: usize, imu: ImuDescription, seed: u64) {
        let random = Random::new(seed, &format!("simulation/{}/imu", self.robots[robot].name));
        self.sensors[robot].imu = Some(InertialSensor::new(imu, random));
    }

    /// Returns mount and errors of a robot's inertial measurement unit, if any.
    pub fn imu(&self, robot: usize) -> Option<&ImuDescription> {
        self.sensors[robot].imu.as_ref().map(InertialSensor::description)
    }

    /// Returns a new reading of a robot's inertial measurement unit, if due.
    /// It includes faults.
    pub fn shown_imu(&mut self, robot: usize) -> Option<InertialReading> {
        let own = &self.robots[robot];
        let body = own.body_motion();
        let shaking = self.ground.shaking(own.pose.point(), own.velocity.norm());
        let imu = self.sensors[robot].imu.as_mut()?;
        let reading = imu.measure(own.pose, body, shaking, self.now)?;
        *imu.display.show(&Some(reading), self.now)?
    }

    /// Sets the faults of a robot's sensors.
    pub fn set_faults(&mut self, robot: usize, faults: &[Fault]) {
        let sensors = &mut self.sensors[robot];
        sensors.sonar_display.set_faults(FaultySensor::Sonar, faults);
        sensors.laser_display.set_faults(FaultySensor::Laser, faults);
        sensors.position_display.set_faults(FaultySensor::Position, faults);
        sensors.orientation_display.set_faults(FaultySensor::Orientation, faults);
        sensors.odometry_display.set_faults(FaultySensor::Odometry, faults);
        sensors.sightings_display.set_faults(FaultySensor::RobotSensor, faults);
        if let Some(camera) = &mut sensors.camera {
            camera.display.set_faults(FaultySensor::Camera, faults);
        }
        if let Some(imu) = &mut sensors.imu {
            imu.display.set_faults(FaultySensor::Imu, faults);
        }
    }

    /// Measures with all sensors of all robots.
    pub fn sense(&mut self) {
        let Self { sensors, surroundings, robots, ground, now, nearby, .. } = self;
        let robots: &[_] = robots;
        workers::each(sensors, nearby, |robot, sensors, nearby| {
            let own = &robots[robot];
            let shaking = ground.shaking(own.pose.point(), own.velocity.norm());
            sensors.sense(robot, (own.body_motion(), shaking), surroundings, *now, nearby);
        });
    }

    /// Returns echoes and sonars of a robot.
    pub fn sonar(&self, robot: usize) -> Option<(&[Echo], &SonarRing)> {
        let sensors = &self.sensors[robot];
        sensors.sonar.as_ref().map(|ring| (sensors.echoes.as_slice(), ring))
    }

    /// Returns new echoes of a robot's sonars, with faults, if any.
    pub fn shown_sonar(&mut self, robot: usize) -> Option<&[Echo]> {
        let Sensors { sonar, echoes, sonar_display, .. } = &mut self.sensors[robot];
        sonar.as_ref().and_then(|_| sonar_display.show(echoes, self.now)).map(Vec::as_slice)
    }

    /// Returns the robot's laser scanner, if any.
    pub fn laser(&self, robot: usize) -> Option<&LaserScanner> {
        self.sensors[robot].laser.as_ref()
    }

    /// Returns new ranges of a robot's laser, meters, with faults, if any.
    pub fn shown_laser(&mut self, robot: usize) -> Option<(&[f32], &LaserDescription)> {
        let Sensors { laser, laser_display, .. } = &mut self.sensors[robot];
        let laser = laser.as_ref().filter(|laser| laser.last() == Some(self.now))?;
        let ranges = laser_display.show(laser.ranges(), self.now)?;
        Some((ranges, laser.description()))
    }

    /// Returns a new fix of a robot's positioning system and compass, if due.
    /// It includes faults.
    pub fn shown_fix(&mut self, robot: usize) -> Fix {
        let Fix { position, orientation } = self.fix(robot);
        let Sensors { position_display, orientation_display, .. } = &mut self.sensors[robot];
        let now = self.now;
        Fix {
            position: position.and_then(|position| *position_display.show(&Some(position), now)?),
            orientation: orientation
                .and_then(|orientation| *orientation_display.show(&Some(orientation), now)?),
        }
    }

    /// Returns new pose and twist (m/s, rad/s) by odometry, with faults, if any.
    pub fn shown_odometry(&mut self, robot: usize) -> Option<(Pose, (f64, f64))> {
        let travel = self.odometry(robot);
        *self.sensors[robot].odometry_display.show(&Some(travel), self.now)?
    }

    /// Returns new detections of other robots, with faults, if any.
    pub fn shown_sightings(&mut self, robot: usize) -> Option<&[Sighting]> {
        let Sensors { robot_sensor, sightings_display, .. } = &mut self.sensors[robot];
        let sensor = robot_sensor.as_ref().filter(|sensor| sensor.measured_at() == Some(self.now))?;
        sightings_display.show(sensor.newest(), self.now).map(Vec::as_slice)
    }

    /// Returns the detector of robots, and its detections.
    pub fn robot_sensor(&self, robot: usize) -> Option<&RobotSensor> {
        self.sensors[robot].robot_sensor.as_ref()
    }
}
