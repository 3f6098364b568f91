//! Travel by odometry.

use serde::{Deserialize, Serialize};
use slate_interfaces::Pose2;

use crate::saved::SavedPose;
use crate::se2;

/// Odometry without its jumps, from wherever it began.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct OdometryTravel {
    #[serde(with = "SavedPose")]
    pose: Pose2,
    /// Newest pose of the odometry; unknown before the first.
    #[serde(with = "SavedPose")]
    newest: Pose2,
}

impl Default for OdometryTravel {
    fn default() -> Self {
        Self { pose: Pose2::default(), newest: Pose2::UNKNOWN }
    }
}

impl OdometryTravel {
    pub fn pose(&self) -> Pose2 {
        self.pose
    }

    /// Advances to a pose of the odometry.
    pub fn advance(&mut self, odometry: Pose2) {
        if self.newest.is_known() {
            self.pose = se2::compose(self.pose, se2::relative(self.newest, odometry));
        }
        self.newest = odometry;
    }

    /// Continues from an odometry pose without a motion.
    pub fn rebase(&mut self, odometry: Pose2) {
        self.newest = odometry;
    }

    /// Continues from another place.
    pub fn move_to(&mut self, pose: Pose2) {
        self.pose = pose;
    }
}
