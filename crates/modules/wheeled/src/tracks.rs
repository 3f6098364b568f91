//! How other robots move, from where they are seen.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Point2, Pose2, Sighting, Sightings};
use slate_plugin::prelude::*;

/// Another robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// Which one.
    pub name: String,
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

/// The robots that are seen, and how they move.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tracks {
    list: Vec<Track>,
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
            let Some(track) = self.list.iter_mut().find(|track| track.name == seen.name.as_str()) else {
                self.list.push(Track { name: seen.name.as_str().into(), x, y, velocity: [0.0; 2], time });
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
        self.list.retain(|track| time - track.time <= LOST);
    }

    /// The robots.
    pub fn iter(&self) -> impl Iterator<Item = &Track> {
        self.list.iter()
    }
}
