//! Conversion of a value from a property to a port of another type, or to a field.
//! Inexact conversions are refused before anything runs.

mod filter;
mod number;
mod place;
mod program;
mod unit;

pub use filter::Filter;
pub use place::{FieldPlace, NoField};
pub use program::Program;
