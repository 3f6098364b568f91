//! Inertial measurement units of VectorNav, by their ASCII protocol.
//! VN-100 and later.
//!
//! VectorNav, *VN-100 User Manual* (UM001). Its protocol is public, a person can read it on the line, its checksum is that of
//! NMEA, and one message has all that an IMU measures: `VNYMR`, orientation, magnetic field, acceleration and angular velocity.

pub mod message;
pub mod session;

use slate_device_line::LineAddress;
use slate_interfaces::Imu;
use slate_module::prelude::*;

use self::session::{ImuOptions, ImuSession};
use crate::driver::{DriverIo, DriverStart, DriverState, device, reading, step};

/// Port of sensors behind a serial server.
const PORT: u16 = 4001;

/// Rates that a sensor supports, per second.
pub const RATES: [u64; 11] = [1, 2, 4, 5, 10, 20, 25, 40, 50, 100, 200];

/// Parameters of [`VectorNav`]; a change restarts the connection.
#[params]
#[derive(PartialEq)]
pub struct VectorNavParams {
    #[param(
        default = "/dev/ttyUSB0",
        doc = "serial device, preferably of /dev/serial/by-id, or `tcp://HOST`"
    )]
    device: Text<252>,
    #[param(default = 115_200, range = 9600..=921_600, unit = "baud", doc = "baud rate of the sensor")]
    baud: u64,
    #[param(default = 50, range = 1..=200, unit = "Hz", doc = "measurements in a second: 1, 2, 4, 5, 10, 20, 25, 40, 50, 100 or 200")]
    rate: u64,
    #[param(default = 0.0, range = 0.0..=3.2, unit = "rad", doc = "standard deviation of the orientation; 0: unknown")]
    orientation_stddev: f64,
    #[param(default = 0.0, range = 0.0..=10.0, unit = "rad/s", doc = "standard deviation of the angular velocity; 0: unknown")]
    angular_velocity_stddev: f64,
    #[param(default = 0.0, range = 0.0..=100.0, unit = "m/s^2", doc = "standard deviation of the acceleration; 0: unknown")]
    linear_acceleration_stddev: f64,
}

reading!(ImuReading, Imu);

impl DriverStart for VectorNavParams {
    type DriverReading = ImuReading;
    type DeviceProtocol = ImuSession;

    fn start(&self) -> Result<(LineAddress, ImuSession), Refusal> {
        let address = LineAddress::parse(self.device.as_str(), self.baud as u32, PORT)
            .map_err(|error| device(&error))?;
        if !RATES.contains(&self.rate) {
            let known = RATES.map(|rate| rate.to_string()).join(", ");
            return Err(Refusal(format!(
                "params.rate: a sensor has no rate of {} Hz; expected one of {known}",
                self.rate
            )));
        }
        let options = ImuOptions {
            rate: self.rate as u32,
            orientation_stddev: self.orientation_stddev,
            angular_velocity_stddev: self.angular_velocity_stddev,
            linear_acceleration_stddev: self.linear_acceleration_stddev,
        };
        Ok((address, ImuSession::new(options)))
    }
}

/// Port of [`VectorNav`].
#[ports]
pub struct VectorNavIo {
    /// Orientation, angular velocity and acceleration of the sensor.
    imu: Output<Imu>,
}

/// Reads an inertial measurement unit of VectorNav.
///
/// A thread owns the line; the tick takes its measurements, and never blocks. A cycle passes on the newest one.
pub struct VectorNav;

#[module(stage = SensorAcquire)]
impl Module for VectorNav {
    type Io = (DriverIo, VectorNavIo);
    type Params = VectorNavParams;
    type State = DriverState<VectorNavParams>;

    fn create(_: &Setup<'_>, params: &VectorNavParams) -> Result<Self::State, Refusal> {
        params.check().map(|()| DriverState::default())
    }

    fn tick(state: &mut Self::State, io: &Self::Io, params: &VectorNavParams, now: &Tick) -> Outcome {
        step(state, &io.0, params, now, |imu| io.1.imu.set(*imu))
    }
}
