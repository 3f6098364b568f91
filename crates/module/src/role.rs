//! Names of the roles of ports in an architecture of blocks.
//! They determine the block that a module is, and thereby its permitted readers.

/// Measurements, from Sensor to Monitor, ReactiveModel, Execute and Knowledge.
pub const MEASUREMENT: &str = "measurement";

/// Percepts, from Monitor to Analyze.
pub const PERCEPT: &str = "percept";

/// Input of a Monitor, of a Sensor, whose value is its percept, without a copy.
pub const HANDED_ON: &str = "handed_on";

/// Changes, from Analyze to Plan.
pub const CHANGE: &str = "change";

/// Planned actions, from Plan to Execute.
pub const PLAN: &str = "plan";

/// Reflexes, from ReactiveModel to Execute.
pub const REFLEX: &str = "reflex";

/// State of a gate, for the Actuator behind it.
pub const GATE_STATE: &str = "gate_state";

/// Status of an Actuator, for Knowledge.
/// Its port has the name of the gate, such as `wheels`.
pub const ACTUATOR_STATUS: &str = "actuator_status";

/// Status of a driver, for the Actuators in front of it.
pub const DRIVER_STATUS: &str = "driver_status";

/// Commands that have passed the gate, for Actuators.
pub const COMMAND: &str = "command";

/// Inputs of a driver or a simulator that move a robot, for Actuators and gates.
pub const ACTUATION: &str = "actuation";

/// Outputs of Knowledge that a ReactiveModel may read besides the RobotModel.
/// They are its thresholds.
pub const RULE: &str = "rule";

/// Facts of Knowledge, for all blocks but ReactiveModels.
pub const FACT: &str = "fact";

/// Ground truth that simulators write and only referees read.
pub const TRUTH: &str = "truth";
