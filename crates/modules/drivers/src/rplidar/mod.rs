//! Laser scanners of Slamtec: RPLIDAR A1, A2 and their kin, with standard scans.
//!
//! Slamtec, *RPLIDAR Interface Protocol and Application Notes* (LR001).

pub mod packet;
pub mod session;
pub mod sweep;

use slate_device_line::LineAddress;
use slate_module::prelude::*;

use self::session::{RplidarOptions, RplidarSession};
use crate::driver::{DriverIo, DriverStart, DriverState, device, step};
use crate::scan::{LaserScannerIo, SweepReading};

/// Port of scanners behind a serial server.
const PORT: u16 = 20108;

/// Parameters of [`Rplidar`]; a change restarts the connection.
#[params]
#[derive(PartialEq)]
pub struct RplidarParams {
    #[param(
        default = "/dev/ttyUSB0",
        doc = "serial device, preferably of /dev/serial/by-id, or `tcp://HOST`"
    )]
    device: Text<252>,
    #[param(default = 115_200, range = 115_200..=1_000_000, unit = "baud", doc = "baud rate: 115200; A3 and S1 256000")]
    baud: u64,
    #[param(default = 360, range = 90..=2048, doc = "beams of a scan")]
    beams: u64,
    #[param(default = 0.15, range = 0.0..=1.0, unit = "m", doc = "minimum range")]
    range_min: f64,
    #[param(default = 12.0, range = 1.0..=50.0, unit = "m", doc = "maximum range; longer ones are no echo")]
    range_max: f64,
    #[param(default = 660, range = 0..=1023, doc = "speed of the motor; an A1 has one speed")]
    motor: u64,
}

impl DriverStart for RplidarParams {
    type DriverReading = SweepReading;
    type DeviceProtocol = RplidarSession;

    fn start(&self) -> Result<(LineAddress, RplidarSession), Refusal> {
        let address = LineAddress::parse(self.device.as_str(), self.baud as u32, PORT)
            .map_err(|error| device(&error))?;
        let options = RplidarOptions {
            beams: self.beams as usize,
            range_min: self.range_min,
            range_max: self.range_max,
            motor: self.motor as u16,
        };
        Ok((address, RplidarSession::new(options)))
    }
}

/// Reads an RPLIDAR of Slamtec.
///
/// A thread owns the line; the tick takes its scans, and never blocks.
pub struct Rplidar;

#[module(stage = SensorAcquire)]
impl Module for Rplidar {
    type Io = (DriverIo, LaserScannerIo);
    type Params = RplidarParams;
    type State = DriverState<RplidarParams>;

    fn create(_: &Setup<'_>, params: &RplidarParams) -> Result<Self::State, Refusal> {
        params.check().map(|()| DriverState::default())
    }

    fn tick(state: &mut Self::State, io: &Self::Io, params: &RplidarParams, now: &Tick) -> Outcome {
        step(state, &io.0, params, now, |sweep| io.1.publish(sweep))
    }
}
