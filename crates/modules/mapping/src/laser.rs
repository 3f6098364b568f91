//! Monitor of a laser scanner, which hands on every scan with one copy.

use slate_interfaces::LaserScan;
use slate_mapek::prelude::*;
use slate_module::prelude::*;

/// Laser scanner of a robot.
#[ports]
pub struct LaserSensors {
    /// Scans of the laser.
    #[stale(after = "500ms")]
    laser: Sensed<LaserScan>,
    /// Percept of the laser.
    #[capacity(2048)]
    percept: Percept<LaserScan>,
}

/// Monitors the laser scanner.
pub struct LaserMonitor;

impl Monitor for LaserMonitor {
    const NAME: &'static str = "laser_monitor";
    const DOC: &'static str = "Monitors the laser scanner.";
    type Sensors = LaserSensors;
    type Params = ();
    type State = ();
    type Value = InPlace<LaserScan>;

    fn interpret(_: &mut (), sensors: &LaserSensors, _: &(), _: &Tick) -> Option<InPlace<LaserScan>> {
        sensors.laser.fresh()?;
        Some(sensors.percept.copy(&sensors.laser))
    }
}
