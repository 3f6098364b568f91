//! Tracks of other robots.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Point2, Pose2, Sighting, Sightings};
use slate_plugin::prelude::*;

/// Track of another robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// Name of the robot.
    #[serde(with = "name")]
    pub name: Text<28>,
    /// x in the map frame, meters.
    pub x: f64,
    /// y in the map frame, meters.
    pub y: f64,
    /// Velocity in the map frame, m/s.
    pub velocity: [f64; 2],
    /// Time of the newest detection, seconds.
    pub time: f64,
}

/// Returns the position of a robot detected from `pose`.
pub fn position_of(pose: Pose2, seen: &Sighting) -> Point2 {
    let direction = pose.theta + seen.bearing;
    Point2 { x: pose.x + seen.range * math::cos(direction), y: pose.y + seen.range * math::sin(direction) }
}

/// Tracks of all robots in sight.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tracks {
    list: [Option<Track>; 8],
}

/// Time constant of the velocity filter, seconds.
const SMOOTHING: f64 = 0.3;
/// Age after which a track is dropped, seconds.
const LOST: f64 = 1.0;

impl Tracks {
    /// Updates the tracks from detections at `pose` and `time` (seconds); skips NaN.
    pub fn update(&mut self, pose: Pose2, robots: &Sightings, time: f64) {
        for seen in robots.list.iter() {
            let Point2 { x, y } = position_of(pose, seen);
            if !(x.is_finite() && y.is_finite()) {
                continue;
            }
            let mut known = self.list.iter_mut().flatten();
            let Some(track) = known.find(|track| track.name == seen.name) else {
                if let Some(free) = self.list.iter_mut().find(|track| track.is_none()) {
                    *free = Some(Track { name: seen.name, x, y, velocity: [0.0; 2], time });
                }
                continue;
            };
            let elapsed = time - track.time;
            if elapsed > 0.0 {
                let part = elapsed / (SMOOTHING + elapsed);
                let [east, north] = track.velocity;
                let velocity = [
                    east + part * ((x - track.x) / elapsed - east),
                    north + part * ((y - track.y) / elapsed - north),
                ];
                (track.x, track.y, track.velocity, track.time) = (x, y, velocity, time);
            }
        }
        for track in &mut self.list {
            *track = track.filter(|track| time - track.time <= LOST);
        }
    }

    /// Iterates over the tracks.
    pub fn iter(&self) -> impl Iterator<Item = &Track> {
        self.list.iter().flatten()
    }
}

/// Serialization of a name as text.
mod name {
    use serde::{Deserialize, Deserializer, Serializer};
    use slate_plugin::prelude::Text;

    pub fn serialize<S: Serializer>(name: &Text<28>, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(name.as_str())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Text<28>, D::Error> {
        Ok(Text::new(&String::deserialize(deserializer)?))
    }
}
