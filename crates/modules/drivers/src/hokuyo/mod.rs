//! Laser scanners of Hokuyo, by SCIP 2.0.
//! URG, UTM and UST at a serial line, by USB, or at a network.
//!
//! Hokuyo, *Communication Protocol Specification for SCIP2.0 Standard*. The commands in use are `QT`, `PP`, `VV`, `BM`
//! and `MD`; [`scan`] reads `ME`, too.

pub mod encoding;
pub mod response;
pub mod scan;
pub mod session;
pub mod specification;

use slate_device_line::LineAddress;
use slate_module::prelude::*;

use self::session::{HokuyoOptions, HokuyoSession};
use crate::driver::{DriverIo, DriverStart, DriverState, device, step};
use crate::scan::{LaserScannerIo, SweepReading};

/// Port of scanners with a network.
pub const PORT: u16 = 10940;

/// Parameters of [`Hokuyo`]; a change restarts the connection.
#[params]
#[derive(PartialEq)]
pub struct HokuyoParams {
    #[param(default = "/dev/ttyACM0", doc = "serial device, or `tcp://HOST` for a scanner with a network")]
    device: Text<252>,
    #[param(default = 115_200, range = 19_200..=750_000, unit = "baud", doc = "baud rate; no matter by USB")]
    baud: u64,
    #[param(default = -3.2, range = -3.2..=3.2, unit = "rad", doc = "first direction that is measured")]
    angle_min: f64,
    #[param(default = 3.2, range = -3.2..=3.2, unit = "rad", doc = "last direction that is measured")]
    angle_max: f64,
    #[param(default = 1, range = 1..=99, doc = "steps measured as one, of which the shortest range counts")]
    cluster: u64,
    #[param(default = 0, range = 0..=9, doc = "scans left out after each one")]
    skip: u64,
}

impl DriverStart for HokuyoParams {
    type DriverReading = SweepReading;
    type DeviceProtocol = HokuyoSession;

    fn start(&self) -> Result<(LineAddress, HokuyoSession), Refusal> {
        let address = LineAddress::parse(self.device.as_str(), self.baud as u32, PORT)
            .map_err(|error| device(&error))?;
        if self.angle_min > self.angle_max {
            let (first, last) = (self.angle_min, self.angle_max);
            return Err(Refusal(format!(
                "params.angle_min: {first} rad is beyond `angle_max`, {last} rad; angles grow counter-clockwise"
            )));
        }
        let options = HokuyoOptions {
            angle_min: self.angle_min,
            angle_max: self.angle_max,
            cluster: self.cluster as u8,
            skip: self.skip as u8,
        };
        Ok((address, HokuyoSession::new(options)))
    }
}

/// Reads a laser scanner of Hokuyo by SCIP 2.0.
///
/// A thread owns the line; the tick takes its scans, and never blocks.
pub struct Hokuyo;

#[module(stage = SensorAcquire)]
impl Module for Hokuyo {
    type Io = (DriverIo, LaserScannerIo);
    type Params = HokuyoParams;
    type State = DriverState<HokuyoParams>;

    fn create(_: &Setup<'_>, params: &HokuyoParams) -> Result<Self::State, Refusal> {
        params.check().map(|()| DriverState::default())
    }

    fn tick(state: &mut Self::State, io: &Self::Io, params: &HokuyoParams, now: &Tick) -> Outcome {
        step(state, &io.0, params, now, |sweep| io.1.publish(sweep))
    }
}
