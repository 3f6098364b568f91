//! Error codes.
//! Each has a stable code for look-ups, however its message is worded.

mod explanations;

use std::fmt;

use slate_blackboard::BoardError;
use slate_blackboard::interface::AccessError;

pub use explanations::{EXPLANATIONS, Explanation};

/// Code of an error.
/// Each has a code and an entry of [`EXPLANATIONS`], which `slate explain` prints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ErrorCode {
    /// Text that can't be read as a configuration.
    Syntax,
    /// Unknown key.
    Key,
    /// Unknown parameter of a module.
    Parameter,
    /// Unknown name.
    Name,
    /// Unknown kind of module.
    Kind,
    /// Incompatible ends of a link.
    Ends,
    /// Circle of modules or plugins that wait for each other.
    Circle,
    /// Input with two sources.
    TwoSources,
    /// Missing service.
    Service,
    /// Second one of a thing that may exist once.
    Second,
    /// Command that bypasses its gate.
    PastGate,
    /// Missing time source.
    TimeSource,
    /// Belongs to another agent.
    OtherAgent,
    /// Unsuitable library.
    Library,
    /// Invalid value.
    Value,
    /// Link that bypasses the architecture.
    Attachment,
    /// RobotModel of another robot.
    Hardware,
    /// A feature is not built in.
    Feature,
    /// A setting does not fit, in a way that has no kind of its own.
    Setting,
    /// Unreachable agent.
    NoAgent,
    /// Missing choice of an agent.
    WhichAgent,
    /// Agent that does not answer.
    Silent,
    /// Agent with another version.
    Version,
    /// Second writer of a property.
    OneWriter,
    /// Port that a link fills.
    Linked,
    /// Mailbox in place of a value.
    Messages,
    /// Taken already.
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
    /// Numbers of a command lack limits.
    PartialLimits,
}

impl ErrorCode {
    /// All kinds, in the order of their codes.
    pub const ALL: [Self; 37] = [
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
        Self::PartialLimits,
    ];

    /// Code of the kind; it is never used for another kind.
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
            Self::PartialLimits => "S209",
        }
    }

    /// Returns the kind of a code.
    pub fn from_code(code: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|error_code| error_code.code().eq_ignore_ascii_case(code))
    }

    /// Returns the explanation of the kind.
    pub fn explanation(self) -> Option<&'static Explanation> {
        EXPLANATIONS.iter().find(|explanation| explanation.error_code == self)
    }

    /// Makes a message of this kind.
    pub fn of(self, text: impl Into<String>) -> Message {
        Message { text: text.into(), error_code: Some(self) }
    }
}

/// Text of a message, and the error code, if any.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Text.
    pub text: String,
    /// The kind.
    pub error_code: Option<ErrorCode>,
}

impl From<String> for Message {
    fn from(text: String) -> Self {
        Self { text, error_code: None }
    }
}

impl From<&str> for Message {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl From<&BoardError> for Message {
    fn from(error: &BoardError) -> Self {
        let error_code = match error {
            BoardError::Unknown { .. } => Some(ErrorCode::Name),
            BoardError::Access { error: AccessError::UnknownField { .. }, .. } => Some(ErrorCode::Name),
            BoardError::ReadOnly { .. } => Some(ErrorCode::OneWriter),
            BoardError::Linked { .. } => Some(ErrorCode::Linked),
            BoardError::Access { .. } | BoardError::Mismatch { .. } => Some(ErrorCode::Value),
            BoardError::OtherAgent { .. } => Some(ErrorCode::OtherAgent),
            BoardError::Exists { .. } | BoardError::Link { .. } => None,
        };
        Self { text: error.to_string(), error_code }
    }
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_has_a_code_and_an_explanation_of_its_own() {
        for (error_code, explanation) in ErrorCode::ALL.into_iter().zip(EXPLANATIONS) {
            assert_eq!(explanation.error_code, error_code, "the order of the explanations");
            assert!(explanation.text.len() > 60, "{}", error_code.code());
            assert_eq!(error_code.explanation().map(|own| own.title), Some(explanation.title));
            assert_eq!(ErrorCode::from_code(&error_code.code().to_lowercase()), Some(error_code));
        }
        assert_eq!(EXPLANATIONS.len(), ErrorCode::ALL.len());
        assert!(ErrorCode::ALL.is_sorted_by_key(|error_code| error_code.code()));
    }
}
