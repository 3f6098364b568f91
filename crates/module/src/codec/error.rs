//! Errors of reading and writing CBOR.

use std::fmt::Display;

use serde::{de, ser};

#[derive(Debug, thiserror::Error)]
pub enum CodecError {
    #[error("it ends too early")]
    Short,
    #[error("byte {0} is no CBOR")]
    Syntax(usize),
    #[error("it is nested too deeply")]
    Deep,
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
