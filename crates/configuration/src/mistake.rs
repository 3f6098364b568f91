//! Kinds of mistakes. Each has a code that stays, so that it can be looked up, however its message is worded.

use std::fmt;

use slate_blackboard::BoardError;
use slate_blackboard::interface::AccessError;

/// A kind of mistake; `slate explain` says what each means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mistake {
    /// A file can't be read as a configuration.
    Syntax,
    /// A key that means nothing.
    Key,
    /// A module has no such parameter.
    Parameter,
    /// There is nothing of that name.
    Name,
    /// No plugin brings such a module.
    Kind,
    /// The two ends of a link don't fit.
    Ends,
    /// A circle of modules or plugins that wait for each other.
    Circle,
    /// An input has two sources.
    TwoSources,
    /// A service is missing.
    Service,
    /// There may be one of these.
    Second,
    /// A command goes past its gate.
    PastGate,
    /// The time source is not there.
    TimeSource,
    /// It is another agent's.
    OtherAgent,
    /// A library does not fit.
    Library,
    /// A value does not fit.
    Value,
    /// A link bypasses the architecture.
    Attachment,
    /// A RobotModel is not that of its robot.
    Hardware,
    /// A feature is not built in.
    Feature,
    /// A setting does not fit, in a way that has no kind of its own.
    Setting,
    /// No agent is reached.
    NoAgent,
    /// It has to be said which agent.
    WhichAgent,
    /// The agent does not answer.
    Silent,
    /// The agent speaks another version.
    Version,
    /// A property has one writer.
    OneWriter,
    /// A link fills it.
    Linked,
    /// It takes messages, and has no value.
    Messages,
    /// Somebody else has it.
    Held,
    /// The run of the agent is over.
    RunOver,
    /// A port leads nowhere.
    Loose,
    /// A block without which its robot does nothing is switched off.
    SwitchedOff,
    /// A block drives another robot.
    OtherRobot,
    /// The input of a driver is not reserved for commands that passed the gate.
    Unguarded,
    /// The limits of a gate are wider than those of the robot.
    WideLimits,
    /// A robot has no modules.
    EmptyRobot,
    /// No module uses a plugin.
    UnusedPlugin,
    /// A property to record does not exist.
    Unrecorded,
}

impl Mistake {
    /// All of them, in the order of their codes.
    pub const ALL: [Self; 36] = [
        Self::Syntax,
        Self::Key,
        Self::Parameter,
        Self::Name,
        Self::Kind,
        Self::Ends,
        Self::Circle,
        Self::TwoSources,
        Self::Service,
        Self::Second,
        Self::PastGate,
        Self::TimeSource,
        Self::OtherAgent,
        Self::Library,
        Self::Value,
        Self::Attachment,
        Self::Hardware,
        Self::Feature,
        Self::Setting,
        Self::NoAgent,
        Self::WhichAgent,
        Self::Silent,
        Self::Version,
        Self::OneWriter,
        Self::Linked,
        Self::Messages,
        Self::Held,
        Self::RunOver,
        Self::Loose,
        Self::SwitchedOff,
        Self::OtherRobot,
        Self::Unguarded,
        Self::WideLimits,
        Self::EmptyRobot,
        Self::UnusedPlugin,
        Self::Unrecorded,
    ];

    /// Its code. One is never used for another kind.
    pub fn code(self) -> &'static str {
        match self {
            Self::Syntax => "S001",
            Self::Key => "S002",
            Self::Parameter => "S003",
            Self::Name => "S004",
            Self::Kind => "S005",
            Self::Ends => "S006",
            Self::Circle => "S007",
            Self::TwoSources => "S008",
            Self::Service => "S009",
            Self::Second => "S010",
            Self::PastGate => "S011",
            Self::TimeSource => "S012",
            Self::OtherAgent => "S013",
            Self::Library => "S014",
            Self::Value => "S015",
            Self::Attachment => "S016",
            Self::Hardware => "S017",
            Self::Feature => "S018",
            Self::Setting => "S019",
            Self::NoAgent => "S101",
            Self::WhichAgent => "S102",
            Self::Silent => "S103",
            Self::Version => "S104",
            Self::OneWriter => "S105",
            Self::Linked => "S106",
            Self::Messages => "S107",
            Self::Held => "S108",
            Self::RunOver => "S109",
            Self::Loose => "S201",
            Self::SwitchedOff => "S202",
            Self::OtherRobot => "S203",
            Self::Unguarded => "S204",
            Self::WideLimits => "S205",
            Self::EmptyRobot => "S206",
            Self::UnusedPlugin => "S207",
            Self::Unrecorded => "S208",
        }
    }

    /// The kind of a code.
    pub fn from_code(code: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mistake| mistake.code().eq_ignore_ascii_case(code))
    }

    /// A message of this kind.
    pub fn of(self, text: impl Into<String>) -> Message {
        Message { text: text.into(), mistake: Some(self) }
    }
}

/// The words of a message, and the kind of the mistake, if it has one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The words.
    pub text: String,
    /// The kind.
    pub mistake: Option<Mistake>,
}

impl From<String> for Message {
    fn from(text: String) -> Self {
        Self { text, mistake: None }
    }
}

impl From<&str> for Message {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl From<&BoardError> for Message {
    fn from(error: &BoardError) -> Self {
        let mistake = match error {
            BoardError::Unknown { .. } => Some(Mistake::Name),
            BoardError::Access { error: AccessError::UnknownField { .. }, .. } => Some(Mistake::Name),
            BoardError::ReadOnly { .. } => Some(Mistake::OneWriter),
            BoardError::Linked { .. } => Some(Mistake::Linked),
            BoardError::Access { .. } | BoardError::Misfit { .. } => Some(Mistake::Value),
            BoardError::OtherAgent { .. } => Some(Mistake::OtherAgent),
            BoardError::Exists { .. } | BoardError::Link { .. } => None,
        };
        Self { text: error.to_string(), mistake }
    }
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
