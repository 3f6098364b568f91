//! Algorithms of Slate measured on published data: what `slate evaluate` prints.
//!
//! Each evaluation reads a folder of data as its authors publish it, and returns rows of figures with what is to be
//! reached.

mod error;
mod figures;
pub mod localization;
pub mod movingai;
pub mod planning;

pub use error::DataError;
pub use figures::{Evaluation, Figure, FigureGoal};
