//! Standard interfaces of robotics, with bounds.
//! They have the layout of their ROS messages where there is one.
//!
//! SI units and the frames of ROS's REP-103: meters, radians, x forward, y left, counter-clockwise.
//! Modules with these interfaces can be linked to each other.

mod accuracy;
mod april_tag;
mod camera;
mod chassis;
mod contact;
mod door;
mod drive;
mod driver;
mod fact;
mod gate;
mod image;
mod imu;
mod joystick;
mod map;
mod mission;
mod pose;
mod range;
mod satellite_fix;
mod sighting;
mod transform;

pub use accuracy::SensorAccuracy;
pub use april_tag::TAG16H5;
pub use camera::{CameraInfo, PanTiltCommand, PanTiltState};
pub use chassis::Chassis;
pub use contact::{Bumper, Contact, Contacts};
pub use door::DoorState;
pub use drive::{FourWheelSpeeds, HolonomicTwist, OmniWheelSpeeds, Twist2, WheelSpeeds};
pub use driver::DriverStatus;
pub use fact::{FactHead, FactTableHead};
pub use gate::{GateMode, GateState, LeasePriority, RefusalReason};
pub use image::{Image, ImageFormat};
pub use imu::{Imu, Vector3};
pub use joystick::Joy;
pub use map::{MapMark, MapStroke, OccupancyGrid, Path};
pub use mission::{MissionOutcome, MissionState, Verdict};
pub use pose::{Odometry, Orientation, Particle, ParticleCloud, Point2, Pose2, PoseEstimate, Position};
pub use range::{Clearance, Echo, LaserScan, SonarPlacement, SonarScan};
pub use satellite_fix::{FixStatus, NavSatFix};
pub use sighting::{Sighting, Sightings};
pub use transform::{FrameName, Quaternion, Transform};

use slate_module::blackboard::interface::{Descriptor, Interface};

/// Interfaces that most robots speak.
pub mod prelude {
    pub use crate::{
        Bumper, CameraInfo, Chassis, Clearance, DoorState, Echo, FourWheelSpeeds, Image, Imu, Joy, LaserScan,
        MissionOutcome, MissionState, NavSatFix, OccupancyGrid, Odometry, Orientation, PanTiltCommand,
        PanTiltState, Path, Point2, Pose2, PoseEstimate, Position, Quaternion, SensorAccuracy, Sighting,
        Sightings, SonarScan, Transform, Twist2, Verdict, WheelSpeeds,
    };
}

/// All interfaces, in the order of their names.
pub const ALL: &[&Descriptor] = &[
    Bumper::DESCRIPTOR,
    CameraInfo::DESCRIPTOR,
    Chassis::DESCRIPTOR,
    Clearance::DESCRIPTOR,
    Contact::DESCRIPTOR,
    Contacts::DESCRIPTOR,
    DoorState::DESCRIPTOR,
    DriverStatus::DESCRIPTOR,
    Echo::DESCRIPTOR,
    FactHead::DESCRIPTOR,
    FactTableHead::DESCRIPTOR,
    FourWheelSpeeds::DESCRIPTOR,
    GateState::DESCRIPTOR,
    HolonomicTwist::DESCRIPTOR,
    Image::DESCRIPTOR,
    Imu::DESCRIPTOR,
    Joy::DESCRIPTOR,
    LaserScan::DESCRIPTOR,
    MapStroke::DESCRIPTOR,
    NavSatFix::DESCRIPTOR,
    OccupancyGrid::DESCRIPTOR,
    Odometry::DESCRIPTOR,
    OmniWheelSpeeds::DESCRIPTOR,
    Orientation::DESCRIPTOR,
    PanTiltCommand::DESCRIPTOR,
    PanTiltState::DESCRIPTOR,
    Particle::DESCRIPTOR,
    ParticleCloud::DESCRIPTOR,
    Path::DESCRIPTOR,
    Point2::DESCRIPTOR,
    Pose2::DESCRIPTOR,
    PoseEstimate::DESCRIPTOR,
    Position::DESCRIPTOR,
    Quaternion::DESCRIPTOR,
    SensorAccuracy::DESCRIPTOR,
    Sighting::DESCRIPTOR,
    Sightings::DESCRIPTOR,
    SonarPlacement::DESCRIPTOR,
    SonarScan::DESCRIPTOR,
    Transform::DESCRIPTOR,
    Twist2::DESCRIPTOR,
    Vector3::DESCRIPTOR,
    Verdict::DESCRIPTOR,
    WheelSpeeds::DESCRIPTOR,
];
