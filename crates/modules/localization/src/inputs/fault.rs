//! Faults of inputs.

use std::fmt;

use serde::{Deserialize, Serialize};
use slate_module::{Text, Tick};

/// An input that is bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FaultyInput {
    /// A scan.
    Scan,
    /// No scan for too long: apart from a bad one, so that the log names both.
    StoppedScan,
    /// The odometry.
    Odometry,
    /// The map.
    Map,
    /// A parameter.
    Parameter,
}

impl FaultyInput {
    /// Name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scan | Self::StoppedScan => "`scan`",
            Self::Odometry => "`odometry`",
            Self::Map => "`map`",
            Self::Parameter => "the configuration",
        }
    }
}

/// Which input is bad, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputFault {
    input: FaultyInput,
    #[serde(skip)]
    reason: Text<92>,
}

impl InputFault {
    /// Makes a fault with a reason.
    pub fn new(input: FaultyInput, reason: &str) -> Self {
        Self { input, reason: Text::new(reason) }
    }

    /// Makes a fault with a reason that has numbers.
    pub fn with(input: FaultyInput, reason: fmt::Arguments<'_>) -> Self {
        let mut text = FaultText::default();
        // What does not fit is cut.
        let _ = fmt::write(&mut text, reason);
        Self { input, reason: Text::new(std::str::from_utf8(&text.bytes[..text.length]).unwrap_or_default()) }
    }

    /// Makes the fault of an invalid parameter.
    pub fn parameter(error: impl fmt::Display) -> Self {
        Self::with(FaultyInput::Parameter, format_args!("is invalid: {error}"))
    }

    /// Returns the input that is bad.
    pub fn input(&self) -> FaultyInput {
        self.input
    }

    /// Logs a fault that begins, and its end.
    pub fn log_change(before: Option<&Self>, fault: Option<&Self>, now: &Tick) {
        if before.map(Self::input) == fault.map(Self::input) {
            return;
        }
        match (fault, before) {
            (Some(fault), _) => now.warn(format_args!("{fault}; the pose is stale until it has recovered")),
            (None, Some(before)) => now.info(format_args!("{} has recovered", before.input().name())),
            (None, None) => {}
        }
    }
}

impl fmt::Display for InputFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.input.name(), self.reason.as_str())
    }
}

/// Text without an allocation, as a tick has none.
struct FaultText {
    bytes: [u8; 92],
    length: usize,
}

impl Default for FaultText {
    fn default() -> Self {
        Self { bytes: [0; 92], length: 0 }
    }
}

impl fmt::Write for FaultText {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for character in text.chars() {
            let Some(place) = self.bytes.get_mut(self.length..self.length + character.len_utf8()) else {
                return Err(fmt::Error);
            };
            character.encode_utf8(place);
            self.length += character.len_utf8();
        }
        Ok(())
    }
}
