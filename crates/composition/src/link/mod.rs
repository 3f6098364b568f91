//! Conversion of a value from a property to a port of another type, or to a field.
//! Inexact conversions are refused before anything runs.

mod field_place;
mod filter;
mod number;
mod program;
mod unit;

pub use field_place::{FieldPlace, NoField};
pub use filter::Filter;
pub use program::Program;
