//! Views of a mission, and orders of a developer.

pub mod activity;
pub mod drawing;
pub mod golog;
pub mod net;
pub mod order;
mod shown;
#[cfg(feature = "lua")]
pub mod skills;
pub mod tree;

pub use activity::{ActivityWriter, MissionActivity, MissionItem, MissionItemStatus, MissionSight};
pub use drawing::{
    MissionDrawing, MissionElement, MissionElementKind, MissionGraph, MissionMark, MissionNotation,
    NO_ELEMENT,
};
pub use order::{ForcedOutcome, Forcing, MissionCommand, MissionOrder, MissionRobot};
pub use shown::{MissionView, SavedView};
