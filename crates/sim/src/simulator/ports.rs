//! Ports of the simulator.
//! Their names begin with that of a robot, a person or a door.

use slate_interfaces::{
    Bumper, CameraInfo, Chassis, Clearance, Contacts, DoorState, FourWheelSpeeds, HolonomicTwist, Image, Imu,
    LaserScan, Odometry, OmniWheelSpeeds, Orientation, PanTiltCommand, PanTiltState, Pose2, Position,
    SensorAccuracy, Sightings, SonarScan, Transform, WheelSpeeds,
};
use slate_module::PortDescription;
use slate_module::prelude::*;

use crate::robot::{CameraDescription, DriveKind};
use crate::scenario::Scenario;
use crate::simulation::Placement;

/// Command of a robot's two wheels; names of ports begin with the robot's.
#[ports]
pub(super) struct TwoWheelsIo {
    /// Wheel command.
    #[role("actuation")]
    pub wheels: Input<WheelSpeeds>,
}

/// Command of a robot's four wheels.
#[ports]
pub(super) struct FourWheelsIo {
    /// Wheel command.
    #[role("actuation")]
    pub wheels: Input<FourWheelSpeeds>,
}

/// Commands of a robot with omni wheels; the newest one holds.
#[ports]
pub(super) struct OmniIo {
    /// Wheel command.
    #[role("actuation")]
    pub wheels: Input<OmniWheelSpeeds>,
    /// Velocity command.
    #[role("actuation")]
    pub twist: Input<HolonomicTwist>,
}

/// Knowledge of each robot about its own body.
#[ports]
pub(super) struct ChassisIo {
    /// Geometry and limits.
    pub chassis: Output<Chassis>,
    /// Errors of the sensors; none while they are exact.
    pub accuracy: Output<SensorAccuracy>,
}

/// Outputs of a robot with sonars.
#[ports]
pub(super) struct SonarIo {
    /// Scan of the sonars.
    pub sonar: Output<SonarScan>,
}

/// Outputs of each robot.
#[ports]
pub(super) struct RobotIo {
    /// Position of the positioning system.
    pub position: Output<Position>,
    /// Heading of the compass.
    pub orientation: Output<Orientation>,
    /// Odometry of the wheels.
    pub odometry: Output<Odometry>,
    /// True pose; for referees and reports, not for the robot.
    #[role("truth")]
    pub truth: Output<Pose2>,
    /// True clearance; for referees and reports, not for the robot.
    #[role("truth")]
    pub clearance: Output<Clearance>,
}

/// Outputs of a robot with bumpers.
#[ports]
pub(super) struct BumperIo {
    /// State of the bumpers.
    pub bumper: Output<Bumper>,
}

/// Outputs of a robot with a laser scanner.
#[ports]
pub(super) struct LaserIo {
    /// Scan of the laser scanner.
    pub laser: Output<LaserScan>,
    /// Pose of the laser scanner on the robot.
    pub laser_mount: Output<Transform>,
}

/// Outputs of a robot with a detector of robots.
#[ports]
pub(super) struct SightingsIo {
    /// Detected robots.
    pub sightings: Output<Sightings>,
}

/// Outputs of a robot with an inertial measurement unit.
#[ports]
pub(super) struct ImuIo {
    /// Measurement of the inertial measurement unit.
    pub imu: Output<Imu>,
    /// Pose of the inertial measurement unit on the robot.
    pub imu_mount: Output<Transform>,
}

/// Outputs of a robot with a camera.
/// Frames are `base_link`, `camera_base`, with a head `camera_pan` and `camera_tilt`, and `camera`, the optical frame.
#[ports]
pub(super) struct CameraIo {
    /// Image of the camera.
    pub camera: Output<Image>,
    /// Calibration of the camera.
    pub camera_info: Output<CameraInfo>,
    /// Pose of the camera or its head on the robot.
    pub camera_base: Output<Transform>,
    /// Pose of the camera's optical frame on its carrier.
    pub camera_mount: Output<Transform>,
}

/// Ports of a robot with a pan-tilt head.
#[ports]
pub(super) struct HeadIo {
    /// Command of the head's direction.
    pub pan_tilt_command: Input<PanTiltCommand>,
    /// State of the head.
    pub pan_tilt: Output<PanTiltState>,
    /// Transform of the pan joint.
    pub camera_pan: Output<Transform>,
    /// Transform of the tilt joint.
    pub camera_tilt: Output<Transform>,
}

/// Outputs of the world.
#[ports]
pub(super) struct WorldIo {
    /// Contacts that began in the last cycle; for referees, not for robots.
    #[role("truth")]
    pub contacts: Output<Contacts>,
}

/// Output of each person.
#[ports]
pub(super) struct PersonIo {
    /// True pose of the person; for referees and reports, not for robots.
    #[role("truth")]
    pub truth: Output<Pose2>,
}

/// Outputs of each door.
#[ports]
pub(super) struct DoorIo {
    /// State of the door.
    pub door: Output<DoorState>,
    /// True pose of its leaf; for reports, not for robots.
    #[role("truth")]
    pub truth: Output<Pose2>,
}

/// Available ports of a robot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Abilities {
    pub drive: DriveKind,
    pub sonar: bool,
    pub bumper: bool,
    pub laser: bool,
    pub robot_sensor: bool,
    pub imu: bool,
    /// Bytes of an image, if it has a camera.
    pub camera: Option<usize>,
    pub head: bool,
}

impl Abilities {
    pub fn of(scenario: &Scenario, placement: &Placement) -> Self {
        Self {
            drive: placement.description.drive.kind,
            sonar: !placement.sonar.is_empty(),
            bumper: placement.description.bumper.is_some(),
            laser: scenario.lasers.contains_key(&placement.name),
            robot_sensor: placement.robot_sensor().is_some(),
            imu: scenario.imus.contains(&placement.name),
            camera: scenario.cameras.get(&placement.name).map(CameraDescription::bytes),
            head: scenario.cameras.get(&placement.name).is_some_and(|camera| camera.head.is_some()),
        }
    }

    pub fn ports(self) -> Vec<PortDescription> {
        let mut ports = match self.drive {
            DriveKind::Differential => TwoWheelsIo::describe(),
            DriveKind::SkidSteer => FourWheelsIo::describe(),
            DriveKind::Omni => OmniIo::describe(),
        };
        ports.extend(ChassisIo::describe());
        if self.sonar {
            ports.extend(SonarIo::describe());
        }
        ports.extend(RobotIo::describe());
        if self.bumper {
            ports.extend(BumperIo::describe());
        }
        if self.laser {
            ports.extend(LaserIo::describe());
        }
        if self.robot_sensor {
            ports.extend(SightingsIo::describe());
        }
        if self.imu {
            ports.extend(ImuIo::describe());
        }
        if let Some(bytes) = self.camera {
            let mut own = CameraIo::describe();
            own.iter_mut()
                .filter(|port| port.descriptor == Image::DESCRIPTOR)
                .for_each(|port| port.capacity = bytes);
            ports.extend(own);
        }
        if self.head {
            ports.extend(HeadIo::describe());
        }
        ports
    }
}
