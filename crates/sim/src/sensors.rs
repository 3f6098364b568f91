//! Exteroceptive sensors of a robot.

use serde::{Deserialize, Serialize};

use crate::camera::CameraSensor;
use crate::contact::Motion;
use crate::fault::{Display, Measurement};
use crate::geometry::{Point, Pose};
use crate::inertial::InertialSensor;
use crate::laser::LaserScanner;
use crate::robot_sensor::{RobotSensor, Sighting};
use crate::sonar::{Echo, SonarRing};
use crate::surroundings::{Nearby, Surroundings};

/// Sensors of a robot, with their measurements.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Sensors {
    pub sonar: Option<SonarRing>,
    pub echoes: Vec<Echo>,
    #[serde(default)]
    pub laser: Option<LaserScanner>,
    pub robot_sensor: Option<RobotSensor>,
    /// Faults between the sonars and their readers.
    #[serde(default)]
    pub sonar_display: Display<Vec<Echo>>,
    /// Faults between the laser and its readers.
    #[serde(default)]
    pub laser_display: Display<Vec<f32>>,
    /// Faults between the positioning system and its readers.
    #[serde(default)]
    pub position_display: Display<Option<Point>>,
    /// Faults between the compass and its readers.
    #[serde(default)]
    pub orientation_display: Display<Option<f64>>,
    /// Faults between the wheel encoders and their readers.
    #[serde(default)]
    pub odometry_display: Display<Option<Travel>>,
    /// Faults between the sensor for robots and its readers.
    #[serde(default)]
    pub sightings_display: Display<Vec<Sighting>>,
    /// Inertial measurement unit, with its faults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imu: Option<InertialSensor>,
    /// Camera, with its faults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraSensor>,
}

/// Pose and twist (m/s, rad/s) by odometry.
pub(crate) type Travel = (Pose, (f64, f64));

impl Measurement for Option<Point> {
    fn is_none(&self) -> bool {
        Self::is_none(self)
    }

    fn spoil(&mut self) {
        *self = Some(Point::new(f64::NAN, f64::NAN));
    }
}

impl Measurement for Option<f64> {
    fn is_none(&self) -> bool {
        Self::is_none(self)
    }

    fn spoil(&mut self) {
        *self = Some(f64::NAN);
    }
}

impl Measurement for Option<Travel> {
    fn is_none(&self) -> bool {
        Self::is_none(self)
    }

    fn spoil(&mut self) {
        *self = Some((Pose { x: f64::NAN, y: f64::NAN, theta: f64::NAN }, (f64::NAN, f64::NAN)));
    }
}

impl Measurement for Vec<Sighting> {
    /// Returns false, as no robot in view is a measurement, too.
    fn is_none(&self) -> bool {
        false
    }

    fn spoil(&mut self) {
        for sighting in self {
            (sighting.range, sighting.bearing) = (f64::NAN, f64::NAN);
        }
    }
}

impl Measurement for Vec<Echo> {
    fn is_none(&self) -> bool {
        self.is_empty()
    }

    fn spoil(&mut self) {
        self.fill(Echo { range: f64::NAN, heard: true });
    }
}

impl Measurement for Vec<f32> {
    fn is_none(&self) -> bool {
        self.is_empty()
    }

    fn spoil(&mut self) {
        self.fill(f32::NAN);
    }
}

impl Sensors {
    /// Measures with all sensors of robot number `own`.
    /// Its body moves and is shaken so; `nearby` is scratch memory that many robots share.
    pub fn sense(
        &mut self,
        own: usize,
        (body, shaking): (Motion, f64),
        surroundings: &Surroundings,
        now: u64,
        nearby: &mut Nearby,
    ) {
        if let Some(ring) = &mut self.sonar {
            let sounding = ring.sound(now);
            if sounding != 0 {
                surroundings.find_near(own, ring.description().range_max, ring.aside(), nearby);
                ring.sweep(sounding, surroundings.robots()[own].frame(), nearby, &mut self.echoes);
            }
        }
        if let Some(laser) = &mut self.laser {
            laser.measure(own, surroundings, now, nearby);
        }
        if let Some(sensor) = &mut self.robot_sensor {
            sensor.measure(own, surroundings, now);
        }
        if let Some(camera) = &mut self.camera {
            camera.measure(own, (body, shaking), surroundings, now);
        }
    }
}
