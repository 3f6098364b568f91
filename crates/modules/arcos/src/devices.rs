//! Sensors and an Actuator for a Pioneer.
//! They stand in front of the driver, which owns the serial line.

use slate_interfaces::{Bumper, Odometry, SonarScan, WheelSpeeds};
use slate_mapek::{driver_actuator, driver_sensors};

driver_sensors! {
    PioneerSonar("pioneer_sonar", "Sonars of a Pioneer."): SonarScan,
    PioneerOdometry("pioneer_odometry", "Wheel encoders of a Pioneer."): Odometry,
    PioneerBumper("pioneer_bumper", "Bumpers of a Pioneer."): Bumper,
}
driver_actuator!(PioneerWheels("pioneer_wheels", "Wheels of a Pioneer."), WheelPorts { wheels: WheelSpeeds });
