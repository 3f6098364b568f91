//! Satellite receivers by NMEA 0183, of any system (GPS, GLONASS, Galileo, BeiDou).

pub mod message;
pub mod session;

use slate_device_line::LineAddress;
use slate_interfaces::NavSatFix;
use slate_module::prelude::*;

use self::session::{GpsOptions, GpsSession};
use crate::driver::{DriverIo, DriverStart, DriverState, device, reading, step};

/// Port of receivers with a network.
const PORT: u16 = 10110;

/// Parameters of [`Gps`]; a change restarts the connection.
#[params]
#[derive(PartialEq)]
pub struct GpsParams {
    #[param(
        default = "/dev/ttyACM0",
        doc = "serial device, preferably of /dev/serial/by-id, or `tcp://HOST`"
    )]
    device: Text<252>,
    #[param(default = 9600, range = 4800..=921_600, unit = "baud", doc = "baud rate; no matter by USB")]
    baud: u64,
    #[param(default = 1.0, range = 0.1..=50.0, unit = "Hz", doc = "fixes that the receiver sends in a second")]
    rate: f64,
    #[param(
        default = 4.0,
        range = 0.0..=100.0,
        unit = "m",
        doc = "standard deviation of a range to a satellite, for receivers without GST; 0 for no covariance"
    )]
    range_error_stddev: f64,
}

reading!(FixReading, NavSatFix);

impl DriverStart for GpsParams {
    type DriverReading = FixReading;
    type DeviceProtocol = GpsSession;

    fn start(&self) -> Result<(LineAddress, GpsSession), Refusal> {
        let address = LineAddress::parse(self.device.as_str(), self.baud as u32, PORT)
            .map_err(|error| device(&error))?;
        let options = GpsOptions { rate: self.rate, range_error_stddev: self.range_error_stddev };
        Ok((address, GpsSession::new(options)))
    }
}

/// Port of [`Gps`].
#[ports]
pub struct GpsIo {
    /// Position of the antenna; without a fix also that.
    fix: Output<NavSatFix>,
}

/// Reads a satellite receiver by NMEA 0183.
///
/// A thread owns the line; the tick takes its fixes, and never blocks.
pub struct Gps;

#[module(stage = SensorAcquire)]
impl Module for Gps {
    type Io = (DriverIo, GpsIo);
    type Params = GpsParams;
    type State = DriverState<GpsParams>;

    fn create(_: &Setup<'_>, params: &GpsParams) -> Result<Self::State, Refusal> {
        params.check().map(|()| DriverState::default())
    }

    fn tick(state: &mut Self::State, io: &Self::Io, params: &GpsParams, now: &Tick) -> Outcome {
        step(state, &io.0, params, now, |fix| io.1.fix.set(*fix))
    }
}
