//! Poses in saved states.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use slate_interfaces::Pose2;

/// Pose, for `#[serde(with)]`.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Pose2")]
pub(crate) struct SavedPose {
    x: f64,
    y: f64,
    theta: f64,
}

#[derive(Serialize, Deserialize)]
struct PoseItem(#[serde(with = "SavedPose")] Pose2);

/// Poses, for `#[serde(with)]`.
pub(crate) mod poses {
    use super::*;

    pub fn serialize<S: Serializer>(poses: &[Pose2], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(poses.iter().map(|pose| PoseItem(*pose)))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Pose2>, D::Error> {
        Ok(Vec::<PoseItem>::deserialize(deserializer)?.into_iter().map(|item| item.0).collect())
    }
}
