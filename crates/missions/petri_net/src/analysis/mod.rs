//! Analysis of nets before they run.

mod check;
mod space;

pub use check::{CheckLimits, FindingKind, NetFinding, NetReport, check_net};
pub use space::{FiringPath, StateSpace, state_space};
