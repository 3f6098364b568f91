use serde::{Deserialize, Serialize};
use slate_blackboard::interface::Descriptor;

use crate::{Hardware, Parameter};

/// Description of a module, which the host needs before it runs it.
#[derive(Clone, Debug)]
pub struct Description {
    /// Ports; a frame has a slot for each, in this order.
    pub ports: Vec<PortDescription>,
    /// Interface of the parameters.
    pub params: &'static Descriptor,
    /// Defaults and ranges of the parameters.
    pub parameters: Vec<Parameter>,
    /// Stage of the main loop.
    pub stage: Stage,
    /// Trigger.
    pub trigger: Trigger,
    /// Deadline of a tick, ns; a longer one counts as a miss.
    pub deadline: Option<u64>,
    /// Role of which a robot may have only one module, such as `plan`; empty for none.
    pub unique: String,
    /// True if its hardware depends on its parameters.
    /// It is then described again with them.
    pub describes_hardware: bool,
    /// Hardware of robots, as far as the setup determines it.
    pub hardware: Vec<Hardware>,
}

/// Port, as the host sees it.
#[derive(Clone, Debug)]
pub struct PortDescription {
    /// Name, the last part of its URL.
    pub name: String,
    /// Description of its values.
    pub doc: String,
    /// Direction and delivery.
    pub direction: Direction,
    /// Interface.
    pub descriptor: &'static Descriptor,
    /// Input: whether the module does not run before it has a value.
    pub required: bool,
    /// Role in an architecture; only matching roles may be linked. Empty for none.
    pub role: String,
    /// Input: nanoseconds after which the value counts as stale.
    pub stale_after: Option<u64>,
    /// Output: the value that the host sets after a hang, panic, crash or unload.
    pub safe: Option<Vec<u8>>,
    /// Room in the tail, for interfaces with one.
    pub capacity: usize,
    /// Queue: the longest window of a tick. Inbox and outbox: messages a tick.
    pub window: usize,
}

/// Direction of a port, and its delivery.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u32)]
pub enum Direction {
    /// Reads the newest value.
    Input,
    /// Reads every value in order.
    Queue,
    /// Writes a value.
    Output,
    /// Writes a value only while somebody reads it.
    Debug,
    /// Writes an actuator's command, which passes the gate.
    Command,
    /// Receives messages.
    Inbox,
    /// Sends messages.
    Outbox,
    /// Uses a service of the host or of another module.
    Aspect,
    /// Provides a service to other modules.
    Provider,
}

impl Direction {
    /// Returns the name as in the source.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Input => "Input",
            Self::Queue => "Queue",
            Self::Output => "Output",
            Self::Debug => "Debug",
            Self::Command => "Command",
            Self::Inbox => "Inbox",
            Self::Outbox => "Outbox",
            Self::Aspect => "Aspect",
            Self::Provider => "Provider",
        }
    }
}

/// Stages of the main loop (Fawkes, 4.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Stage {
    /// First stage.
    PreLoop,
    /// Reads the sensors.
    SensorAcquire,
    /// Brings their data into shape.
    SensorPrepare,
    /// Interprets them.
    SensorProcess,
    /// Updates the model of the world.
    WorldState,
    /// Decides.
    Think,
    /// Runs skills.
    Skill,
    /// Computes commands.
    Act,
    /// Sends them to the actuators.
    ActExec,
    /// Last stage.
    PostLoop,
}

impl Stage {
    /// All of them, in order.
    pub const ALL: [Self; 10] = [
        Self::PreLoop,
        Self::SensorAcquire,
        Self::SensorPrepare,
        Self::SensorProcess,
        Self::WorldState,
        Self::Think,
        Self::Skill,
        Self::Act,
        Self::ActExec,
        Self::PostLoop,
    ];

    /// Returns the name as in the source.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PreLoop => "PreLoop",
            Self::SensorAcquire => "SensorAcquire",
            Self::SensorPrepare => "SensorPrepare",
            Self::SensorProcess => "SensorProcess",
            Self::WorldState => "WorldState",
            Self::Think => "Think",
            Self::Skill => "Skill",
            Self::Act => "Act",
            Self::ActExec => "ActExec",
            Self::PostLoop => "PostLoop",
        }
    }

    /// Returns the stage of that name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| stage.name() == name)
    }
}

/// Trigger of a module.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Trigger {
    /// Every cycle of the main loop, in the module's stage.
    Stage,
    /// Period, ns.
    Every(u64),
    /// New values of one of these ports, or a time without any.
    On {
        /// Names of the ports.
        ports: Vec<String>,
        /// Longest time between two runs, ns.
        #[serde(default)]
        timeout: Option<u64>,
    },
}

/// Reads a duration such as `20ms` (`ns`, `us`, `ms`, `s`, `min`) as nanoseconds.
pub fn parse_duration(text: &str) -> Option<u64> {
    let text = text.trim();
    let split = text.find(|c: char| c.is_ascii_alphabetic())?;
    let number: f64 = text[..split].trim().parse().ok()?;
    let unit = match &text[split..] {
        "ns" => 1.0,
        "us" => 1e3,
        "ms" => 1e6,
        "s" => 1e9,
        "min" => 60e9,
        _ => return None,
    };
    let nanoseconds = number * unit;
    (0.0..9e18).contains(&nanoseconds).then(|| libm::round(nanoseconds) as u64)
}
