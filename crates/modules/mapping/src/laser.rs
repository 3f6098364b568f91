//! Monitor of a laser scanner, which hands on every scan with one copy.

use slate_interfaces::LaserScan;
use slate_mapek::prelude::*;
use slate_mapek::{Device, RobotModel};
use slate_module::prelude::*;

/// Laser scanner of a robot.
#[ports]
pub struct LaserSensors {
    /// Scans of the laser.
    #[stale(after = "500ms")]
    laser: Sensed<LaserScan>,
    /// Robot model with the limits and the rate of the laser, from Knowledge.
    robot: Input<RobotModel>,
    /// Percept of the laser.
    #[capacity(2048)]
    percept: Percept<LaserScan>,
}

/// Monitors the laser scanner. Its minimum and maximum range are at most as wide as those of the device in the robot model, so
/// that ranges beyond them are no measurement.
pub struct LaserMonitor;

/// Name of the laser scanner in a robot model.
const LASER: &str = "laser";

impl LaserSensors {
    fn device(&self) -> Option<&Device> {
        self.robot.get()?.sensor(LASER)
    }
}

impl Monitor for LaserMonitor {
    const NAME: &'static str = "laser_monitor";
    const DOC: &'static str = "Monitors the laser scanner.";
    type Sensors = LaserSensors;
    type Params = ();
    type State = ();
    type Value = InPlace<LaserScan>;

    fn interpret(_: &mut (), sensors: &LaserSensors, _: &(), _: &Tick) -> Option<InPlace<LaserScan>> {
        let scan = sensors.laser.fresh()?;
        let Some(device) = sensors.device().filter(|device| device.maximum > 0.0) else {
            return Some(sensors.percept.copy(&sensors.laser));
        };
        Some(sensors.percept.write(scan.ranges.len(), |percept| {
            (percept.angle_min, percept.angle_increment) = (scan.angle_min, scan.angle_increment);
            percept.range_min = math::max(scan.range_min, device.minimum);
            percept.range_max = math::min(scan.range_max, device.maximum);
            percept.ranges.copy_from_slice(&scan.ranges);
        }))
    }

    fn device<'s>(sensors: &'s LaserSensors, _: &str) -> Option<&'s Device> {
        sensors.device()
    }
}
