//! Analysis of nets before they run.

mod check;
mod joint;
mod space;

pub use check::{CheckLimits, FindingKind, NetFinding, NetReport, check_net};
pub use joint::check_joint;
pub use space::{FiringPath, StateSpace, state_space};
