//! What becomes of a value on its way from a property to a port of another type, or to a part of one: it is converted
//! where that is exact, and refused before anything runs where it is not.

mod filter;
mod number;
mod place;
mod program;
mod unit;

pub use filter::Filter;
pub use place::{FieldPlace, NoField};
pub use program::Program;
