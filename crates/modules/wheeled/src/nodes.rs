//! Sensors and Actuators whose device is elsewhere, such as a node of ROS.
//! `SensorNode` and `ActuatorNode` of the paper (Figure 10).

use slate_plugin::interfaces::{
    Bumper, LaserScan, Odometry, Orientation, Position, SonarScan, Twist2, WheelSpeeds,
};
use slate_plugin::mapek::{driver_actuator, driver_sensors};
use slate_plugin::prelude::*;

driver_sensors! {
    SonarNode("sonar_node", "Sonars of a node."): SonarScan,
    PositionNode("position_node", "Positioning system of a node."): Position,
    OrientationNode("orientation_node", "Compass of a node."): Orientation,
    OdometryNode("odometry_node", "Wheel encoders of a node."): Odometry,
    BumperNode("bumper_node", "Bumpers of a node."): Bumper,
}
driver_actuator!(WheelsNode("wheels_node", "Two wheels of a node."), WheelsNodePorts { wheels: WheelSpeeds });

/// Ports of [`LaserNode`].
#[ports]
pub struct LaserNodePorts {
    /// Scan of the node.
    #[capacity(2048)]
    source: Input<LaserScan>,
    /// Measurement of the sensor.
    #[capacity(2048)]
    value: Measurement<LaserScan>,
}

/// Laser scanner of a node.
#[derive(Debug)]
pub struct LaserNode;

impl Sensor for LaserNode {
    const NAME: &'static str = "laser_node";
    const DOC: &'static str = "Laser scanner of a node.";
    type Io = LaserNodePorts;
    type Params = ();
    type State = ();
    type Value = InPlace<LaserScan>;

    fn get_data((): &mut (), io: &LaserNodePorts, (): &(), _: &Tick) -> Option<InPlace<LaserScan>> {
        io.source.is_new().then(|| io.value.copy(&io.source))
    }
}

/// Command for a node that drives by twists.
#[ports]
pub struct TwistNodePorts {
    /// Twist, such as that of `/cmd_vel`.
    #[safe(Twist2::ZERO)]
    twist: Output<Twist2>,
}

/// Drive of the base.
#[params]
pub struct TwistNodeParams {
    #[param(default = 0.0975, range = 0.001..=10.0, unit = "m", doc = "radius of the wheels")]
    wheel_radius: f64,
    #[param(default = 0.331, range = 0.001..=10.0, unit = "m", doc = "distance between left and right wheels")]
    track: f64,
}

/// Actuator of a two-wheeled node with a twist command.
/// Wheel speeds pass the gate, which limits them there.
#[derive(Debug)]
pub struct TwistNode;

impl Actuator for TwistNode {
    const NAME: &'static str = "twist_node";
    const DOC: &'static str = "Two wheels of a node with a twist command.";
    type Io = TwistNodePorts;
    type Params = TwistNodeParams;
    type State = ();
    type Command = WheelSpeeds;
    const SAFE: WheelSpeeds = WheelSpeeds::ZERO;

    fn apply(
        _: &mut (),
        command: &WheelSpeeds,
        io: &TwistNodePorts,
        params: &TwistNodeParams,
        _: &Tick,
    ) -> Outcome {
        io.twist.set(Twist2 {
            linear: params.wheel_radius * (command.left + command.right) / 2.0,
            angular: params.wheel_radius * (command.right - command.left) / params.track,
        });
        Outcome::Ok
    }
}
