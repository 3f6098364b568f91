//! Rough ground, which shakes what drives on it.

use serde::{Deserialize, Serialize};

use crate::geometry::Point;
use crate::scenery::Scenery;

/// Roughness of the ground by place, from 0 to 1; 0 where nothing is said.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RoughGround {
    elsewhere: f64,
    /// Least and greatest corner, and roughness; later ones lie on earlier ones.
    patches: Vec<([f64; 2], [f64; 2], f64)>,
}

impl RoughGround {
    /// The floor of a world.
    pub fn of(scenery: &Scenery) -> Self {
        let patches = scenery.floors.iter().map(|floor| {
            let corner = |side: f64| [0, 1].map(|axis| floor.center[axis] + side * floor.size[axis]);
            (corner(-0.5), corner(0.5), floor.roughness)
        });
        Self { elsewhere: scenery.floor_roughness.unwrap_or(0.0), patches: patches.collect() }
    }

    /// Returns true if no ground shakes.
    pub fn is_even(&self) -> bool {
        self.elsewhere == 0.0 && self.patches.iter().all(|(.., roughness)| *roughness == 0.0)
    }

    /// Returns the shaking of a robot at a point: roughness times speed, m/s.
    pub fn shaking(&self, at: Point, speed: f64) -> f64 {
        let is_on = |(least, most, _): &&([f64; 2], [f64; 2], f64)| {
            (least[0]..=most[0]).contains(&at.x) && (least[1]..=most[1]).contains(&at.y)
        };
        let patch = self.patches.iter().rev().find(is_on);
        patch.map_or(self.elsewhere, |(.., roughness)| *roughness) * speed
    }
}
