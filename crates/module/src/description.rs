use serde::{Deserialize, Serialize};
use slate_blackboard::interface::Descriptor;

use crate::{Hardware, Parameter};

/// What the host must know of a module before it runs it.
#[derive(Clone, Debug)]
pub struct Description {
    /// The module's ports; a frame has a slot for each, in this order.
    pub ports: Vec<PortDescription>,
    /// The interface of the parameters.
    pub params: &'static Descriptor,
    /// Defaults and ranges of the parameters.
    pub parameters: Vec<Parameter>,
    /// The step of the main loop that it belongs to.
    pub stage: Stage,
    /// When it runs.
    pub trigger: Trigger,
    /// How long a tick may take, nanoseconds; beyond it a miss is counted.
    pub deadline: Option<u64>,
    /// What only one module of a robot may be, such as `plan`; empty for nothing.
    pub unique: String,
    /// Whether it is described again with its parameters, of which its hardware depends.
    pub describes_hardware: bool,
    /// Hardware of robots, as far as the setup says it.
    pub hardware: Vec<Hardware>,
}

/// A port, as the host sees it.
#[derive(Clone, Debug)]
pub struct PortDescription {
    /// Name, the last part of its URL.
    pub name: String,
    /// What goes through it.
    pub doc: String,
    /// Which way, and how.
    pub direction: Direction,
    /// What it carries.
    pub descriptor: &'static Descriptor,
    /// Input: whether the module does not run before it has a value.
    pub required: bool,
    /// The part it plays in an architecture; only matching roles may be linked. Empty for none.
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

/// Which way a port goes, and how it delivers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u32)]
pub enum Direction {
    /// Reads the newest value.
    Input,
    /// Reads every value in order.
    Queue,
    /// Writes a value.
    Output,
    /// Writes a value only while somebody watches.
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
    /// The name as in the source.
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

/// The steps of the main loop (Fawkes, 4.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Stage {
    /// Before everything.
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
    /// After everything.
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

    /// The name as in the source.
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

    /// The stage of that name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| stage.name() == name)
    }
}

/// When a module runs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Trigger {
    /// In every cycle of the main loop, in its stage.
    Stage,
    /// Once a period, nanoseconds.
    Every(u64),
    /// When one of these ports has something new, or none for so many nanoseconds.
    On {
        /// Names of the ports.
        ports: Vec<String>,
        /// Runs at least this often, nanoseconds.
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
