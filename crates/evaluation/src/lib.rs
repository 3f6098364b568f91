//! Algorithms of Slate measured on public datasets: what `slate evaluate` prints.
//!
//! Each evaluation reads a folder of data as its authors publish it, and returns rows of figures with what is to be
//! reached.

pub mod barn;
mod error;
pub mod exploration;
mod figures;
pub mod local_planning;
pub mod localization;
pub mod movingai;
pub mod mrclam;
pub mod planning;
pub mod slam;
mod trials;

pub use error::DataError;
pub use figures::{Evaluation, Figure, FigureGoal};
