//! Faults of inputs.

use std::fmt;

use serde::{Deserialize, Serialize};
use slate_module::{Text, Tick};

/// Input that is bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FaultyInput {
    /// Scan.
    Scan,
    /// Timeout of scans.
    /// It is apart from a bad scan, so that the log names both.
    StoppedScan,
    /// Odometry.
    Odometry,
    /// Timeout of odometry.
    StoppedOdometry,
    /// Map.
    Map,
    /// Parameter.
    Parameter,
    /// Inertial measurement.
    Imu,
    /// Timeout of inertial measurements.
    StoppedImu,
    /// Heading.
    Orientation,
    /// Position.
    Position,
    /// Satellite fix.
    Fix,
    /// Detected landmarks.
    Landmarks,
    /// Places of landmarks.
    LandmarkMap,
}

impl FaultyInput {
    /// Returns the name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scan | Self::StoppedScan => "`scan`",
            Self::Odometry | Self::StoppedOdometry => "`odometry`",
            Self::Map => "`map`",
            Self::Parameter => "the configuration",
            Self::Imu | Self::StoppedImu => "`imu`",
            Self::Orientation => "`orientation`",
            Self::Position => "`position`",
            Self::Fix => "`fix`",
            Self::Landmarks => "`landmarks`",
            Self::LandmarkMap => "`landmark_map`",
        }
    }
}

/// Invalid input, and the reason.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputFault {
    input: FaultyInput,
    #[serde(skip)]
    reason: Text<92>,
}

impl InputFault {
    /// Returns a fault with a reason.
    pub fn new(input: FaultyInput, reason: &str) -> Self {
        Self { input, reason: Text::new(reason) }
    }

    /// Returns a fault with a reason that has numbers.
    pub fn with(input: FaultyInput, reason: fmt::Arguments<'_>) -> Self {
        let mut text = Text::default();
        // A text that does not fit is cut.
        let _ = fmt::write(&mut text, reason);
        Self { input, reason: text }
    }

    /// Returns the fault of an invalid parameter.
    pub fn parameter(error: impl fmt::Display) -> Self {
        Self::with(FaultyInput::Parameter, format_args!("is invalid: {error}"))
    }

    /// Returns the input that is bad.
    pub fn input(&self) -> FaultyInput {
        self.input
    }

    /// Replaces the newest fault, and logs one that begins, and its end.
    pub fn report(newest: &mut Option<Self>, fault: Option<Self>, now: &Tick) {
        if newest.as_ref().map(Self::input) != fault.as_ref().map(Self::input) {
            match (&fault, &newest) {
                (Some(fault), _) => {
                    now.warn(format_args!("{fault}; the pose is stale until it has recovered"));
                }
                (None, Some(before)) => now.info(format_args!("{} has recovered", before.input().name())),
                (None, None) => {}
            }
        }
        *newest = fault;
    }
}

impl fmt::Display for InputFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.input.name(), self.reason.as_str())
    }
}
