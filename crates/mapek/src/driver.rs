//! Sensors and Actuators in front of a driver or a simulator.
//! The driver or simulator is one module for all devices of a robot.

use slate_interfaces::DriverStatus;
use slate_module::{Input, Interface, Outcome, ports};

use crate::in_place::InPlace;
use crate::port::Measurement;

/// Ports of a Sensor that passes on measurements of a driver or a simulator.
/// The measurements stay unchanged.
#[ports]
pub struct DriverPorts<T: Interface + ?Sized> {
    /// Output of the driver or the simulator.
    source: Input<T>,
    /// Measurement of the sensor.
    value: Measurement<T>,
}

impl<T: Interface + ?Sized> DriverPorts<T> {
    /// Forwards a new value of the driver, with one copy.
    pub fn forward(&self) -> Option<InPlace<T>> {
        self.source.is_new().then(|| self.value.copy(&self.source))
    }
}

/// Returns the outcome of an Actuator from the status of its driver.
/// It is degraded with a fault, or when the driver hangs.
#[doc(hidden)]
pub fn driver_outcome(status: &Input<DriverStatus>) -> Outcome {
    let is_faulty = status.get().is_some_and(|driver| driver.fault.get() || status.is_stale());
    if is_faulty { Outcome::Degraded } else { Outcome::Ok }
}

/// Defines [`Sensor`](crate::Sensor)s that pass on data of a driver or simulator.
/// `driver_sensors! { SimulatedSonar("simulated_sonar", "Sonars of the simulator."): SonarScan }`.
#[macro_export]
macro_rules! driver_sensors {
    ($($name:ident($kind:literal, $doc:literal): $value:ty),+ $(,)?) => {$(
        #[doc = $doc]
        #[derive(Debug)]
        pub struct $name;

        impl $crate::Sensor for $name {
            const NAME: &'static str = $kind;
            const DOC: &'static str = $doc;
            type Io = $crate::DriverPorts<$value>;
            type Params = ();
            type State = ();
            type Value = $crate::InPlace<$value>;

            fn get_data(
                (): &mut (),
                io: &$crate::DriverPorts<$value>,
                (): &(),
                _: &$crate::slate_module::Tick,
            ) -> Option<$crate::InPlace<$value>> {
                io.forward()
            }
        }
    )+};
}

/// Defines an [`Actuator`](crate::Actuator) in front of a driver or a simulator.
/// It passes the commands from the gate on, and reports the driver's faults:
/// `driver_actuator!(SimulatedWheels("simulated_wheels", "Wheels of the simulator."), TwoWheelPorts { wheels:
/// WheelSpeeds })`, where `wheels` is its output.
#[macro_export]
macro_rules! driver_actuator {
    ($name:ident($kind:literal, $doc:literal), $ports:ident { $port:ident: $command:ty }) => {
        #[doc = concat!("Ports of [`", stringify!($name), "`].")]
        #[$crate::slate_module::ports]
        pub struct $ports {
            /// Command for the driver or the simulator.
            #[safe(<$command>::ZERO)]
            $port: $crate::slate_module::Output<$command>,
            /// Status of the driver, if it has one.
            #[role("driver_status")]
            driver: $crate::slate_module::Input<$crate::DriverStatus>,
        }

        #[doc = $doc]
        #[derive(Debug)]
        pub struct $name;

        impl $crate::Actuator for $name {
            const NAME: &'static str = $kind;
            const DOC: &'static str = $doc;
            type Io = $ports;
            type Params = ();
            type State = ();
            type Command = $command;
            const SAFE: $command = <$command>::ZERO;

            fn apply(
                (): &mut (),
                command: &$command,
                io: &$ports,
                (): &(),
                _: &$crate::slate_module::Tick,
            ) -> $crate::slate_module::Outcome {
                io.$port.set(*command);
                $crate::driver_outcome(&io.driver)
            }
        }
    };
}
