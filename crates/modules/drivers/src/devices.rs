//! Devices as a robot's blocks see them: Sensors in front of the drivers.

use slate_interfaces::{Imu, Joy, LaserScan, NavSatFix};
use slate_mapek::driver_sensors;
use slate_mapek::prelude::*;
use slate_module::prelude::*;

driver_sensors! {
    GpsDevice("gps_device", "Satellite receiver behind a driver."): NavSatFix,
    ImuDevice("imu_device", "Inertial measurement unit behind a driver."): Imu,
    JoystickDevice("joystick_device", "Joystick behind a driver."): Joy,
}

/// Ports of [`LaserDevice`].
/// They have room for the beams of any scanner that has a driver.
#[ports]
pub struct LaserDeviceIo {
    /// Output of the driver.
    source: Input<LaserScan>,
    /// Measurement of the sensor.
    #[capacity(2048)]
    value: Measurement<LaserScan>,
}

/// Laser scanner behind a driver.
#[derive(Debug)]
pub struct LaserDevice;

impl Sensor for LaserDevice {
    const NAME: &'static str = "laser_device";
    const DOC: &'static str = "Laser scanner behind a driver.";
    type Io = LaserDeviceIo;
    type Params = ();
    type State = ();
    type Value = InPlace<LaserScan>;

    fn get_data((): &mut (), io: &LaserDeviceIo, (): &(), _: &Tick) -> Option<InPlace<LaserScan>> {
        io.source.is_new().then(|| io.value.copy(&io.source))
    }
}
