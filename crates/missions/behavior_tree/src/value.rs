//! Values of blackboards.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::model::Enumerations;

/// Numbers that differ by less are equal, as in BehaviorTree.CPP.
const TOLERANCE: f64 = f32::EPSILON as f64;

/// Value of a blackboard entry; a truth value is the number 1 or 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum BoardValue {
    /// Finite number.
    Number(f64),
    /// Text.
    Text(String),
}

impl BoardValue {
    /// Parses a literal: a number if it is valid as one, a text otherwise.
    pub fn parse(text: &str) -> Self {
        match parse_number(text) {
            Some(number) => Self::Number(number),
            None => Self::Text(text.into()),
        }
    }

    /// Returns the number, also of a text that is one; `true` and `false` are 1 and 0.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Text(text) => match text.as_str() {
                "true" => Some(1.0),
                "false" => Some(0.0),
                text => parse_number(text),
            },
        }
    }

    /// Returns the truth value: a number other than 0 is true.
    pub fn truth(&self) -> Option<bool> {
        self.number().map(|number| number != 0.0)
    }

    /// Returns the number, also of a text that is one or a name of one.
    pub(crate) fn number_in(&self, enumerations: &Enumerations) -> Option<f64> {
        let named = match self {
            Self::Text(text) => enumerations.get(text).copied(),
            Self::Number(_) => None,
        };
        named.or_else(|| self.number())
    }

    /// Returns whether both are the same text or the same number.
    pub(crate) fn is_same(&self, other: &Self, enumerations: &Enumerations) -> bool {
        match (self, other) {
            (Self::Text(own), Self::Text(other)) if own == other => true,
            _ => match (self.number_in(enumerations), other.number_in(enumerations)) {
                (Some(own), Some(other)) => is_same_number(own, other),
                _ => false,
            },
        }
    }
}

impl fmt::Display for BoardValue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(formatter, "{number}"),
            Self::Text(text) => formatter.write_str(text),
        }
    }
}

pub(crate) fn is_same_number(own: f64, other: f64) -> bool {
    (own - other).abs() <= TOLERANCE
}

fn parse_number(text: &str) -> Option<f64> {
    // Words such as `inf` are texts.
    let starts = text.bytes().any(|byte| byte.is_ascii_digit());
    text.parse().ok().filter(|number: &f64| starts && number.is_finite())
}
