//! Drivers of laser scanners, GNSS receivers, IMUs and joysticks.
//!
//! | module | device | measures |
//! |---|---|---|
//! | [`Hokuyo`](hokuyo::Hokuyo) | laser scanners of Hokuyo, by SCIP 2.0 | `LaserScan` |
//! | [`Rplidar`](rplidar::Rplidar) | RPLIDAR A1, A2 and their kin | `LaserScan` |
//! | [`Gps`](gps::Gps) | satellite receivers, by NMEA 0183 | `NavSatFix` |
//! | [`VectorNav`](imu::VectorNav) | inertial measurement units of VectorNav | `Imu` |
//! | [`Joystick`](joystick::Joystick) | joysticks and gamepads of Linux | `Joy` |
//!
//! A driver takes the place of the simulator, and the Sensors of [`devices`] that of the simulated ones: nothing else of
//! a robot changes.
//!
//! ```toml
//! [modules.hokuyo]
//! params.device = "tcp://192.168.0.10"
//! [robots.r2.modules]
//! laser = { kind = "laser_device" }
//! ```
//!
//! Each driver is a parser of bytes, a [`DeviceProtocol`] without a line and without a clock, and a module in front of
//! both; [`simulated`] has the other ends of the conversations.

pub mod devices;
mod driver;
pub mod gps;
pub mod hokuyo;
pub mod imu;
pub mod joystick;
pub mod rplidar;
pub mod scan;
pub mod sentence;
pub mod simulated;
mod status;

use slate_mapek::SensorBlock;

pub use driver::{DeviceFault, DeviceProtocol, DriverIo, DriverState};
pub use status::DeviceStatus;

slate_module::plugin!(
    hokuyo::Hokuyo,
    rplidar::Rplidar,
    gps::Gps,
    imu::VectorNav,
    joystick::Joystick,
    joystick::JoystickTeleop,
    joystick::JoystickWheels,
    SensorBlock<devices::LaserDevice>,
    SensorBlock<devices::GpsDevice>,
    SensorBlock<devices::ImuDevice>,
    SensorBlock<devices::JoystickDevice>,
);
