use slate_blackboard::interface::Descriptor;

use super::Service;

/// Service of the host, with its effect.
pub trait HostedService: Service {
    /// Effect past the links of the module that uses it.
    const EFFECT: Effect;
}

/// Effect of a service of the host past the links of its user.
/// The rules of attachment decide by it which blocks may have the service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Concerns the module itself, the log, or the order and time of ticks.
    None,
    /// Reads properties of other modules.
    Reads,
    /// Reads and writes properties of other modules.
    ReadsAndWrites,
    /// Commands actuators, or changes modules of the agent.
    Acts,
    /// Exchanges data with the outside of the agent.
    Communicates,
}

/// Description of a service of the host, for a catalogue.
#[derive(Clone, Copy, Debug)]
pub struct ServiceDescription {
    /// Name, version and purpose.
    pub descriptor: &'static Descriptor,
    /// Effect past the links of the module that uses it.
    pub effect: Effect,
}

impl ServiceDescription {
    /// Returns the description of a service.
    pub const fn of<S: HostedService>() -> Self {
        Self { descriptor: S::DESCRIPTOR, effect: S::EFFECT }
    }
}
