//! Monitor of a laser scanner, which hands on every scan without a copy.

use slate_interfaces::LaserScan;
use slate_mapek::prelude::*;
use slate_mapek::{Device, RobotModel};
use slate_module::prelude::*;

/// Laser scanner of a robot.
#[ports]
pub struct LaserSensors {
    /// Scans of the laser, which the Analyzes read where the Sensor has written them.
    #[stale(after = "500ms")]
    percept: HandedOn<LaserScan>,
    /// Robot model with the rate of the laser, from Knowledge.
    robot: Input<RobotModel>,
}

/// Monitor of the laser scanner.
/// It is degraded when it has stopped, by the rate of the device in the robot model.
pub struct LaserMonitor;

/// Name of the laser scanner in a robot model.
const LASER: &str = "laser";

impl Monitor for LaserMonitor {
    const NAME: &'static str = "laser_monitor";
    const DOC: &'static str = "Monitors the laser scanner.";
    type Sensors = LaserSensors;
    type Params = ();
    type State = ();
    type Value = InPlace<LaserScan>;

    fn interpret(_: &mut (), sensors: &LaserSensors, _: &(), _: &Tick) -> Option<InPlace<LaserScan>> {
        Some(sensors.percept.as_it_is())
    }

    fn device<'s>(sensors: &'s LaserSensors, _: &str) -> Option<&'s Device> {
        sensors.robot.get()?.sensor(LASER)
    }
}
