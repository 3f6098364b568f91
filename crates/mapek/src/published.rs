use slate_module::blackboard::interface::Descriptor;
use slate_module::role;
use slate_module::{Direction, Interface, Outcome, PortDescription, Ports, Refusal, Tick, ports};

use crate::in_place::InPlace;
use crate::port::{Change, Measurement, Percept};

/// Value that a Sensor, a Monitor or an Analyze publishes.
///
/// A small value is returned, as `Option<T>`. A value of any size, such as a scan or a map, is written in place: the block
/// has the port itself, `value: Measurement<T>`, `percept: Percept<T>` or `change: Change<T>`, and returns the
/// [`InPlace`] that writing gives.
pub trait Published {
    /// Published interface.
    type Interface: Interface + ?Sized;
    /// Port of a Sensor that the framework adds.
    #[doc(hidden)]
    type Measurement: Ports;
    /// Port of a Monitor that the framework adds.
    #[doc(hidden)]
    type Percept: Ports;
    /// Port of an Analyze that the framework adds.
    #[doc(hidden)]
    type Change: Ports;
    /// True for a value written in place: the block itself has the port.
    #[doc(hidden)]
    const IN_PLACE: bool;

    #[doc(hidden)]
    fn measure(self, own: &Self::Measurement, now: &Tick) -> Outcome;
    #[doc(hidden)]
    fn perceive(self, own: &Self::Percept, now: &Tick) -> Outcome;
    #[doc(hidden)]
    fn notify(self, own: &Self::Change, now: &Tick) -> Outcome;
}

/// Additional ports of a Sensor.
#[ports]
pub struct SensorPorts<T: Interface> {
    /// Measurement of the sensor.
    value: Measurement<T>,
}

/// Additional ports of a Monitor.
#[ports]
pub struct MonitorPorts<T: Interface> {
    /// Percept of the Monitor.
    percept: Percept<T>,
}

/// Additional ports of an Analyze.
#[ports]
pub struct AnalyzePorts<T: Interface> {
    /// Relevant change.
    change: Change<T>,
}

impl<T: Interface + Copy> Published for T {
    type Interface = T;
    type Measurement = SensorPorts<T>;
    type Percept = MonitorPorts<T>;
    type Change = AnalyzePorts<T>;
    const IN_PLACE: bool = false;

    fn measure(self, own: &SensorPorts<T>, _: &Tick) -> Outcome {
        own.value.0.set(self);
        Outcome::Ok
    }

    fn perceive(self, own: &MonitorPorts<T>, _: &Tick) -> Outcome {
        own.percept.0.set(self);
        Outcome::Ok
    }

    fn notify(self, own: &AnalyzePorts<T>, _: &Tick) -> Outcome {
        own.change.0.set(self);
        Outcome::Ok
    }
}

impl<T: Interface + ?Sized> Published for InPlace<T> {
    type Interface = T;
    type Measurement = ();
    type Percept = ();
    type Change = ();
    const IN_PLACE: bool = true;

    fn measure(self, (): &(), now: &Tick) -> Outcome {
        self.outcome("value", now)
    }

    fn perceive(self, (): &(), now: &Tick) -> Outcome {
        self.outcome("percept", now)
    }

    fn notify(self, (): &(), now: &Tick) -> Outcome {
        self.outcome("change", now)
    }
}

/// Refuses a block that writes in place and has no such port.
pub(crate) fn has_place<V: Published, P: Ports>(role: &str) -> Result<(), Refusal> {
    if V::IN_PLACE { has_place_for(V::Interface::DESCRIPTOR, &P::describe(), role) } else { Ok(()) }
}

/// Refuses ports without a place for a value that is written in place.
/// Compiled once, and not for each block.
fn has_place_for(interface: &Descriptor, ports: &[PortDescription], role: &str) -> Result<(), Refusal> {
    let (name, port) = match role {
        role::MEASUREMENT => ("value", "Measurement"),
        role::PERCEPT => ("percept", "Percept"),
        _ => ("change", "Change"),
    };
    let has = ports.iter().any(|port| {
        let is_place = match port.direction {
            Direction::Output => port.role == role,
            Direction::Input => role == role::PERCEPT && port.role == role::HANDED_ON,
            _ => false,
        };
        is_place && port.name == name && port.descriptor.hash == interface.hash
    });
    if !has {
        let what = interface.name;
        return Err(format!(
            "it writes {what} in place and has no port for it: add `{name}: {port}<{what}>` to its ports"
        )
        .into());
    }
    Ok(())
}
