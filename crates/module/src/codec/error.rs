//! Errors of reading and writing CBOR.

use std::fmt::Display;

use serde::{de, ser};

/// Error of reading or writing CBOR.
#[derive(Debug, thiserror::Error)]
pub enum CodecError {
    /// The bytes end within an item.
    #[error("it ends too early")]
    Short,
    /// A byte, counted from 0, begins no item.
    #[error("byte {0} is no CBOR")]
    Syntax(usize),
    /// Arrays and maps are nested more than 256 levels deep.
    #[error("it is nested too deeply")]
    Deep,
    /// The items don't fit the type.
    #[error("{0}")]
    Unfit(String),
}

impl ser::Error for CodecError {
    fn custom<T: Display>(problem: T) -> Self {
        Self::Unfit(problem.to_string())
    }
}

impl de::Error for CodecError {
    fn custom<T: Display>(problem: T) -> Self {
        Self::Unfit(problem.to_string())
    }
}
