//! Poses as state, which interfaces are not by themselves.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use slate_interfaces::Pose2;

/// A pose, for `#[serde(with)]`.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Pose2")]
pub(crate) struct SavedPose {
    x: f64,
    y: f64,
    theta: f64,
}

#[derive(Serialize, Deserialize)]
struct TimedPose(#[serde(with = "SavedPose")] Pose2, f64);

/// A pose and its time, if it is known, for `#[serde(with)]`.
pub(crate) struct SavedPoseTime;

impl SavedPoseTime {
    pub fn serialize<S: Serializer>(newest: &Option<(Pose2, f64)>, serializer: S) -> Result<S::Ok, S::Error> {
        newest.map(|(pose, time)| TimedPose(pose, time)).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<(Pose2, f64)>, D::Error> {
        let newest = Option::<TimedPose>::deserialize(deserializer)?;
        Ok(newest.map(|TimedPose(pose, time)| (pose, time)))
    }
}
