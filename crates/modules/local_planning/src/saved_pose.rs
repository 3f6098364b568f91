//! Poses as state, which interfaces are not by themselves.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use slate_interfaces::Pose2;

/// Pose, for `#[serde(with)]`.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Pose2")]
pub(crate) struct ProgressPose {
    x: f64,
    y: f64,
    theta: f64,
}

#[derive(Serialize, Deserialize)]
struct TimedProgress(#[serde(with = "ProgressPose")] Pose2, f64);

/// Pose and its time, if it is known, for `#[serde(with)]`.
pub(crate) struct ProgressPoseTime;

impl ProgressPoseTime {
    pub fn serialize<S: Serializer>(newest: &Option<(Pose2, f64)>, serializer: S) -> Result<S::Ok, S::Error> {
        newest.map(|(pose, time)| TimedProgress(pose, time)).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<(Pose2, f64)>, D::Error> {
        let newest = Option::<TimedProgress>::deserialize(deserializer)?;
        Ok(newest.map(|TimedProgress(pose, time)| (pose, time)))
    }
}
