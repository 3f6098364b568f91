//! How other robots move, from where they are seen.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Point2, Pose2, Sighting, Sightings};
use slate_plugin::prelude::*;

/// Another robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// Which one.
    #[serde(with = "name")]
    pub name: Text<28>,
    /// In the world, metres.
    pub x: f64,
    /// In the world, metres.
    pub y: f64,
    /// In the world, m/s.
    pub velocity: [f64; 2],
    /// When it was seen last, seconds.
    pub time: f64,
}

/// Where a robot is that is seen from `pose`.
pub fn placed(pose: Pose2, seen: &Sighting) -> Point2 {
    let direction = pose.theta + seen.bearing;
    Point2 { x: pose.x + seen.range * math::cos(direction), y: pose.y + seen.range * math::sin(direction) }
}

/// The robots that are seen, and how they move: as many as a sensor can tell of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tracks {
    list: [Option<Track>; 8],
}

/// A velocity follows what is seen with this time constant, seconds.
const SMOOTHING: f64 = 0.3;
/// Who was not seen for so long is forgotten, seconds.
const LOST: f64 = 1.0;

impl Tracks {
    /// Takes in what is seen from `pose` at `time` (seconds). What is no number is left out.
    pub fn see(&mut self, pose: Pose2, robots: &Sightings, time: f64) {
        for seen in robots.list.iter() {
            let Point2 { x, y } = placed(pose, seen);
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

    /// The robots.
    pub fn iter(&self) -> impl Iterator<Item = &Track> {
        self.list.iter().flatten()
    }
}

/// A name, saved as text.
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
