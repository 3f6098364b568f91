//! Thrusters of the vehicle, behind their gate.

use slate_plugin::mapek::driver_actuator;

use crate::interfaces::ThrusterForces;

driver_actuator!(
    Thrusters("suave_thrusters", "Six thrusters of the vehicle."),
    ThrusterPorts { thrust: ThrusterForces }
);
