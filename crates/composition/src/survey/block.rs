//! Blocks of MAPE-K and the rules of reading among them (RoCS, 4.2 and 5.1).
//!
//! The roles of its ports make a module a block, in any language: no block reads a module without them.

use slate_blackboard::interface::{Descriptor, Kind};
use slate_module::role::{
    ACTUATION, ACTUATOR_STATUS, CHANGE, COMMAND, DRIVER_STATUS, FACT, GATE_STATE, HANDED_ON, MEASUREMENT,
    PERCEPT, PLAN, REFLEX, RULE, TRUTH,
};
use slate_module::{Description, Direction, PortDescription};

/// Advice for a fact with a source that not all blocks may read.
pub const FACT_HELP: &str =
    "a Plan reads facts: link it to an Analyze that interprets that, or make it an `Input` of Knowledge";

/// Name of the interface of a robot's model.
const ROBOT_MODEL: &str = "RobotModel";

/// Name of the part that writes commands which passed a gate.
pub const GATE: &str = "gate";

/// Block, as the ports of a module indicate it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Block {
    /// Source of measurements.
    Sensor,
    /// Interprets sensors.
    Monitor,
    /// Notices changes.
    Analyze,
    /// Decides.
    Plan,
    /// Performs actions.
    Execute,
    /// World, robot and strategy models, which all blocks may read.
    Knowledge,
    /// Reflex.
    Reactive,
    /// Device that acts.
    Actuator,
}

impl Block {
    const ALL: [Self; 8] = [
        Self::Sensor,
        Self::Monitor,
        Self::Analyze,
        Self::Plan,
        Self::Execute,
        Self::Knowledge,
        Self::Reactive,
        Self::Actuator,
    ];

    /// Returns the blocks that a module's ports indicate.
    /// More than one contradict each other.
    pub fn all(description: &Description) -> Vec<Self> {
        let has = |direction, role: &str| {
            description.ports.iter().any(|port| port.direction == direction && port.role == role)
        };
        let is = [
            (Self::Monitor, has(Direction::Output, PERCEPT) || has(Direction::Input, HANDED_ON)),
            (Self::Analyze, has(Direction::Output, CHANGE)),
            (Self::Plan, has(Direction::Outbox, PLAN)),
            (Self::Execute, has(Direction::Inbox, PLAN) || has(Direction::Inbox, REFLEX)),
            (Self::Reactive, has(Direction::Outbox, REFLEX)),
            (Self::Knowledge, description.unique == "knowledge" || has(Direction::Input, FACT)),
            (Self::Sensor, has(Direction::Output, MEASUREMENT)),
            (Self::Actuator, has(Direction::Input, COMMAND)),
        ];
        is.into_iter().filter(|(_, is)| *is).map(|(block, _)| block).collect()
    }

    /// Returns the block that a module implements.
    pub fn of(description: &Description) -> Option<Self> {
        Self::all(description).first().copied()
    }

    /// Returns its name in text for other agents.
    pub fn part(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Monitor => "monitor",
            Self::Analyze => "analyze",
            Self::Plan => "plan",
            Self::Execute => "execute",
            Self::Knowledge => "knowledge",
            Self::Reactive => "reactive",
            Self::Actuator => "actuator",
        }
    }

    /// Returns the block with such a name.
    fn of_part(part: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|block| block.part() == part)
    }

    /// Returns its name with an article.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sensor => "a Sensor",
            Self::Monitor => "a Monitor",
            Self::Analyze => "an Analyze",
            Self::Plan => "a Plan",
            Self::Execute => "Execute",
            Self::Knowledge => "Knowledge",
            Self::Reactive => "a ReactiveModel",
            Self::Actuator => "an Actuator",
        }
    }

    /// Returns the permitted sources of the block, for messages.
    pub fn reads(self) -> &'static str {
        match self {
            Self::Sensor => "a Sensor reads devices, other Sensors and what Actuators report",
            Self::Monitor => "a Monitor reads Sensors and Knowledge",
            Self::Analyze => "an Analyze reads Monitors and Knowledge",
            Self::Plan => "a Plan reads Analyzes, Knowledge and Execute's status",
            Self::Execute => "Execute reads Plan, ReactiveModels, Sensors and Knowledge",
            Self::Knowledge => {
                "Knowledge learns from Sensors, Monitors, Analyzes, Plan, ReactiveModels, Execute and other robots' Knowledge"
            }
            Self::Reactive => "a ReactiveModel reads Sensors, and of Knowledge its rules and RobotModel",
            Self::Actuator => {
                "an Actuator reads the command that passed the gate, the gate's state, its driver's status and Knowledge"
            }
        }
    }

    /// Returns whether the block may read a value of that origin.
    /// `is_own` is true for a module of the block's own robot.
    pub fn may_read(self, origin: Provenance, is_own: bool) -> bool {
        use Block::{Actuator, Analyze, Execute, Knowledge, Monitor, Plan, Reactive, Sensor};
        match (self, origin) {
            (_, Provenance::Truth) => false,
            // A belief or decision of its own robot is not a measurement; another robot is part of the world.
            (Sensor, Provenance::Block(block)) => !is_own || matches!(block, Sensor | Actuator),
            (Sensor, Provenance::Rule) => !is_own,
            (Sensor, _) | (_, Provenance::Hand | Provenance::Unknown | Provenance::Rule) => true,
            // A reflex knows no goal and no map.
            (block, Provenance::Block(Knowledge)) => block != Reactive,
            (Monitor | Reactive | Execute | Knowledge, Provenance::Block(Sensor)) => true,
            (Monitor | Knowledge, Provenance::Health) | (Knowledge, Provenance::Block(Actuator)) => true,
            (Analyze | Knowledge, Provenance::Block(Monitor)) => true,
            (Plan | Knowledge, Provenance::Block(Analyze | Execute)) => true,
            (Execute | Knowledge, Provenance::Block(Plan | Reactive)) => true,
            (Actuator, Provenance::Gate | Provenance::GateState) => true,
            (Monitor | Knowledge, Provenance::GateState) => true,
            _ => false,
        }
    }

    /// Returns whether the block may read a value that another robot's block writes.
    /// [`Self::may_read`] must permit it, too.
    pub fn may_read_other_robot(self, origin: Provenance) -> bool {
        match (self, origin) {
            // To a Sensor, another robot is a part of the world; robots tell each other facts through Knowledge.
            (Self::Sensor, _) | (Self::Knowledge, Provenance::Block(Self::Knowledge) | Provenance::Rule) => {
                true
            }
            (_, origin) => !matches!(origin, Provenance::Block(_) | Provenance::Rule),
        }
    }

    /// Returns help for a value that the block may not read.
    pub fn help(self, origin: Provenance) -> &'static str {
        match (self, origin) {
            (Self::Sensor, _) => {
                "link it to a driver, a simulator, another Sensor or an Actuator; other blocks read the robot's own blocks"
            }
            (Self::Monitor | Self::Reactive | Self::Execute | Self::Knowledge, Provenance::Module) => {
                "give it a Sensor, which reads that"
            }
            (Self::Analyze, Provenance::Module | Provenance::Health | Provenance::GateState) => {
                "give it a Sensor and a Monitor, and observe that"
            }
            (Self::Analyze, Provenance::Block(Self::Sensor)) => "give it a Monitor, and observe that",
            (Self::Analyze, Provenance::Block(Self::Analyze)) => {
                "make it a fact of Knowledge, `fact: Known<T>`, and read that: in the same cycle, without a copy"
            }
            (Self::Plan, Provenance::Module | Provenance::Health | Provenance::GateState) => {
                "give it a Sensor, a Monitor and an Analyze"
            }
            (Self::Plan, Provenance::Block(Self::Sensor)) => "give it a Monitor and an Analyze",
            (Self::Plan, Provenance::Block(Self::Monitor)) => "give it an Analyze",
            (Self::Reactive, Provenance::Block(Self::Knowledge)) => {
                "a reflex knows no goal and no map: a threshold is an output of Knowledge with the role `rule`"
            }
            (Self::Reactive, _) => {
                "a reflex maps measurements to an action: other knowledge belongs to Knowledge"
            }
            (Self::Actuator, _) => "link it to a gate: \"/robot/wheels/command\"",
            _ => "let Knowledge have it, and read Knowledge",
        }
    }
}

/// Origin of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Provenance {
    /// A block of any robot.
    Block(Block),
    /// The RobotModel of any robot's Knowledge, or rules that it has for reflexes.
    Rule,
    /// A module that is not a block.
    Module,
    /// Ground truth of a simulator.
    Truth,
    /// Condition of a module, of the main loop or of the log.
    Health,
    /// The command that an actuator's gate passed.
    Gate,
    /// The state of an actuator's gate.
    GateState,
    /// The configuration or a person: a parameter, or an input without a link.
    Hand,
    /// Unknown until the source is loaded, or played from a recording.
    Unknown,
}

impl Provenance {
    /// Returns the origin of a value that a port writes.
    /// All outputs of a referee count as truth, which it reads.
    pub fn of_port(description: &Description, port: &PortDescription) -> Self {
        if port.role == TRUTH {
            return Self::Truth;
        }
        match Block::of(description) {
            Some(Block::Knowledge) if is_for_reflexes(port) => Self::Rule,
            Some(block) => Self::Block(block),
            None if is_referee(description) => Self::Truth,
            None => Self::Module,
        }
    }

    /// Returns its name for other agents; empty for [`Provenance::Module`].
    pub fn part(self) -> &'static str {
        match self {
            Self::Truth => TRUTH,
            Self::Gate => GATE,
            Self::Rule => RULE,
            Self::Block(block) => block.part(),
            _ => "",
        }
    }

    /// Returns the origin of such a name in another agent.
    pub fn of_part(part: &str) -> Self {
        match part {
            "" => Self::Module,
            TRUTH => Self::Truth,
            GATE => Self::Gate,
            RULE => Self::Rule,
            part => Block::of_part(part).map_or(Self::Unknown, Self::Block),
        }
    }

    /// Returns its description in words.
    pub fn name(self) -> String {
        match self {
            Self::Block(block) => format!("of {}", block.name()),
            Self::Rule => format!("of {}", Block::Knowledge.name()),
            Self::Module => {
                "an output of a module that is not a block, such as a simulator or a driver".into()
            }
            Self::Truth => "ground truth".into(),
            Self::Health => "the condition of a module or of the loop".into(),
            Self::Gate => "a command that passed its gate".into(),
            Self::GateState => "the state of a gate".into(),
            Self::Hand | Self::Unknown => "set by hand".into(),
        }
    }
}

/// Returns whether a module is a referee: it is not a block and reads ground truth.
pub fn is_referee(description: &Description) -> bool {
    let reads_truth = |port: &PortDescription| {
        matches!(port.direction, Direction::Input | Direction::Queue | Direction::Inbox) && port.role == TRUTH
    };
    description.ports.iter().any(reads_truth) && Block::of(description).is_none()
}

/// Returns whether a port is a fact.
/// Reading a fact counts as reading Knowledge, regardless of the source of its link.
pub fn is_fact(port: &PortDescription) -> bool {
    port.direction == Direction::Input && port.role == FACT
}

/// Returns whether an input is the percept of a Monitor.
/// Reading it counts as reading the Monitor, regardless of the source of its link.
pub fn is_handed_on(port: &PortDescription) -> bool {
    port.direction == Direction::Input && port.role == HANDED_ON
}

/// Returns whether a port carries the percept of a Monitor.
pub fn is_percept(port: &PortDescription) -> bool {
    port.direction == Direction::Output && port.role == PERCEPT || is_handed_on(port)
}

/// Returns whether ports of a role read only Sensors.
pub fn is_sensed(role: &str) -> bool {
    matches!(role, MEASUREMENT | HANDED_ON)
}

/// Returns whether reflexes may read an output of Knowledge.
pub fn is_for_reflexes(port: &PortDescription) -> bool {
    port.direction == Direction::Output && (port.role == RULE || has_robot_model(port.descriptor))
}

/// Returns whether an interface is a RobotModel or has one as a field.
pub fn has_robot_model(descriptor: &Descriptor) -> bool {
    let is_model = |kind: &Kind| matches!(kind, Kind::Nested(nested) if nested.name == ROBOT_MODEL);
    descriptor.name == ROBOT_MODEL || descriptor.fields.iter().any(|field| is_model(&field.kind))
}

/// Returns whether a port of a role may read a value of that origin.
/// The rules of its block apply separately.
pub fn role_permits(role: &str, origin: Provenance) -> bool {
    match role {
        COMMAND => matches!(origin, Provenance::Gate | Provenance::Unknown),
        GATE_STATE => matches!(origin, Provenance::GateState | Provenance::Unknown),
        MEASUREMENT | HANDED_ON => matches!(origin, Provenance::Block(Block::Sensor) | Provenance::Unknown),
        // All blocks read a fact, so a Plan would read what fills it.
        FACT => !matches!(
            origin,
            Provenance::Block(Block::Sensor | Block::Monitor | Block::Actuator)
                | Provenance::Module
                | Provenance::Health
                | Provenance::GateState
        ),
        _ => true,
    }
}

/// Returns whether a role restricts the ports that may be linked to it.
/// True for roles of traffic between blocks, and for roles that Slate does not define.
pub fn binds(role: &str) -> bool {
    !matches!(
        role,
        "" | TRUTH
            | ACTUATION
            | FACT
            | RULE
            | MEASUREMENT
            | HANDED_ON
            | COMMAND
            | GATE_STATE
            | ACTUATOR_STATUS
            | DRIVER_STATUS
    )
}

/// Returns the only block that sends to inboxes of a role.
fn sender_of(role: &str) -> Option<Block> {
    match role {
        PLAN => Some(Block::Plan),
        REFLEX => Some(Block::Reactive),
        _ => None,
    }
}

/// Returns the only block that sends messages of an interface to other agents.
/// Other agents do not announce the roles of their inboxes.
pub fn remote_sender(descriptor: &Descriptor) -> Option<Block> {
    match descriptor.name {
        "Planned" => Some(Block::Plan),
        "Reflex" => Some(Block::Reactive),
        _ => None,
    }
}

/// Returns the name of the only block that sends to an inbox; empty for any sender.
/// Tools know the block by it, also that of an outbox with the same role.
pub fn inbox_part(port: &PortDescription) -> &'static str {
    sender_of(&port.role).map_or("", Block::part)
}

/// Returns the name of the block that writes a port, for other agents.
/// Empty for a module that is not a block.
pub fn part(description: &Description, port: &PortDescription) -> &'static str {
    Provenance::of_port(description, port).part()
}
