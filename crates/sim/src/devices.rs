//! Blocks for the simulator's robots: Sensors and Actuators.

use slate_interfaces::{
    Bumper, FourWheelSpeeds, HolonomicTwist, Image, Imu, LaserScan, Odometry, OmniWheelSpeeds, Orientation,
    PanTiltState, Position, SensorAccuracy, Sightings, SonarScan, WheelSpeeds,
};
use slate_mapek::{driver_actuator, driver_sensors};

driver_sensors! {
    SimulatedSonar("simulated_sonar", "Sonars of a simulated robot."): SonarScan,
    SimulatedPosition("simulated_position", "Positioning system of a simulated robot."): Position,
    SimulatedOrientation("simulated_orientation", "Compass of a simulated robot."): Orientation,
    SimulatedOdometry("simulated_odometry", "Wheel encoders of a simulated robot."): Odometry,
    SimulatedLaser("simulated_laser", "Laser scanner of a simulated robot."): LaserScan,
    SimulatedBumper("simulated_bumper", "Bumpers of a simulated robot."): Bumper,
    SimulatedAccuracy("simulated_accuracy", "Errors of a simulated robot's sensors."): SensorAccuracy,
    SimulatedRobotSensor("simulated_robot_sensor", "Robot detector of a simulated robot."): Sightings,
    SimulatedCamera("simulated_camera", "Camera of a simulated robot."): Image,
    SimulatedPanTilt("simulated_pan_tilt", "Pan-tilt head of a simulated robot."): PanTiltState,
    SimulatedImu("simulated_imu", "Inertial measurement unit of a simulated robot."): Imu,
}
driver_actuator!(
    SimulatedWheels("simulated_wheels", "Two wheels of a simulated robot."),
    TwoWheelPorts { wheels: WheelSpeeds }
);
driver_actuator!(
    SimulatedOmniWheels("simulated_omni_wheels", "Omni wheels of a simulated robot."),
    OmniWheelPorts { wheels: OmniWheelSpeeds }
);
driver_actuator!(
    SimulatedOmniTwist("simulated_omni_twist", "Drive of a simulated robot with omni wheels."),
    OmniTwistPorts { twist: HolonomicTwist }
);
driver_actuator!(
    SimulatedSkidSteerWheels("simulated_skid_steer_wheels", "Four wheels of a simulated robot."),
    FourWheelPorts { wheels: FourWheelSpeeds }
);
