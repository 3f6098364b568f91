//! Actions of a robot that navigates, with their decomposition.
//!
//! | action | decomposition |
//! |---|---|
//! | `NavigateTo` | `FollowPath`; `ClearCostmap`, `BackUp`, `Spin` or `Wait` while it is stuck |
//! | `FollowPath`, `Dock`, `BackUp`, `Spin`, `Wait`, `ClearCostmap`, `Halt` | atomic |

mod dock;
mod follow_path;
mod halt;
mod navigate_to;
mod recovery;

use slate_plugin::prelude::*;

use crate::body::NavigationBody;

pub use dock::{Dock, DockArguments};
pub use follow_path::FollowPath;
pub use halt::Halt;
pub use navigate_to::{NavigateTo, NavigateToArguments};
pub use recovery::{BackUp, ClearCostmap, Spin, Wait};

repertoire! {
    /// Actions of a navigating robot.
    pub enum NavigationActions for NavigationBody as "navigation_execute" {
        NavigateTo, FollowPath, Dock, BackUp, Spin, Wait, ClearCostmap, Halt
    }
}

pub(crate) use follow_path::GoalPose;
