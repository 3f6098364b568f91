//! Error codes.
//! Each has a stable code for look-ups, however its message is worded.

mod explanations;

use std::fmt;

use slate_blackboard::BoardError;
use slate_blackboard::interface::AccessError;

pub use explanations::{EXPLANATIONS, Explanation};

/// Defines [`ErrorCode`] by the list of its kinds, in the order of their codes.
macro_rules! error_codes {
    ($($(#[$doc:meta])* $kind:ident = $code:literal,)+) => {
        /// Code of an error.
        /// Each has a code and an entry of [`EXPLANATIONS`], which `slate explain` prints.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum ErrorCode {
            $($(#[$doc])* $kind,)+
        }

        impl ErrorCode {
            /// All kinds, in the order of their codes.
            pub const ALL: &'static [Self] = &[$(Self::$kind,)+];

            /// Code of the kind; it is never used for another kind.
            pub fn code(self) -> &'static str {
                match self {
                    $(Self::$kind => $code,)+
                }
            }
        }
    };
}

error_codes! {
    /// Text that can't be read as a configuration.
    Syntax = "S001",
    /// Unknown key.
    Key = "S002",
    /// Unknown parameter of a module.
    Parameter = "S003",
    /// Unknown name.
    Name = "S004",
    /// Unknown kind of module.
    Kind = "S005",
    /// Incompatible ends of a link.
    Ends = "S006",
    /// Circle of modules or plugins that wait for each other.
    Circle = "S007",
    /// Input with two sources.
    TwoSources = "S008",
    /// Missing service.
    Service = "S009",
    /// Second one of a thing that may exist once.
    Second = "S010",
    /// Command that bypasses its gate.
    PastGate = "S011",
    /// Missing time source.
    TimeSource = "S012",
    /// Belongs to another agent.
    OtherAgent = "S013",
    /// Unsuitable library.
    Library = "S014",
    /// Invalid value.
    Value = "S015",
    /// Link that bypasses the architecture.
    Attachment = "S016",
    /// RobotModel of another robot.
    Hardware = "S017",
    /// A feature is not built in.
    Feature = "S018",
    /// A setting does not fit, in a way that has no kind of its own.
    Setting = "S019",
    /// Unreachable agent.
    NoAgent = "S101",
    /// Missing choice of an agent.
    WhichAgent = "S102",
    /// Agent that does not answer.
    Silent = "S103",
    /// Agent with another version.
    Version = "S104",
    /// Second writer of a property.
    OneWriter = "S105",
    /// Port that a link fills.
    Linked = "S106",
    /// Mailbox in place of a value.
    Messages = "S107",
    /// Taken already.
    Held = "S108",
    /// The run of the agent is over.
    RunOver = "S109",
    /// A port leads nowhere.
    Loose = "S201",
    /// A block without which its robot does nothing is switched off.
    SwitchedOff = "S202",
    /// A block drives another robot.
    OtherRobot = "S203",
    /// The input of a driver is not reserved for commands that passed the gate.
    Unguarded = "S204",
    /// The limits of a gate are wider than those of the robot.
    WideLimits = "S205",
    /// A robot has no modules.
    EmptyRobot = "S206",
    /// No module uses a plugin.
    UnusedPlugin = "S207",
    /// A property to record does not exist.
    Unrecorded = "S208",
    /// Numbers of a command lack limits.
    PartialLimits = "S209",
}

impl ErrorCode {
    /// Returns the kind of a code.
    pub fn from_code(code: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|error_code| error_code.code().eq_ignore_ascii_case(code))
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
        for (error_code, explanation) in ErrorCode::ALL.iter().copied().zip(EXPLANATIONS) {
            assert_eq!(explanation.error_code, error_code, "the order of the explanations");
            assert!(explanation.text.len() > 60, "{}", error_code.code());
            assert_eq!(error_code.explanation().map(|own| own.title), Some(explanation.title));
            assert_eq!(ErrorCode::from_code(&error_code.code().to_lowercase()), Some(error_code));
        }
        assert_eq!(EXPLANATIONS.len(), ErrorCode::ALL.len());
        assert!(ErrorCode::ALL.is_sorted_by_key(|error_code| error_code.code()));
    }
}
