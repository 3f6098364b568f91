use serde::{Deserialize, Serialize};

/// Another robot as a disc.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Other {
    /// x in the map frame, meters.
    pub x: f64,
    /// y in the map frame, meters.
    pub y: f64,
    /// Radius, meters.
    pub radius: f64,
    /// Velocity in the map frame, m/s.
    pub velocity: [f64; 2],
}

impl Other {
    /// Points of its outline, closer together than any obstacle.
    pub(crate) fn outline(&self) -> impl Iterator<Item = (f64, f64)> {
        let Self { x, y, radius, .. } = *self;
        ROUND.iter().map(move |(east, north)| (x + east * radius, y + north * radius))
    }
}

/// Points of a circle of radius 1.
const ROUND: [(f64, f64); 12] = [
    (1.0, 0.0),
    (0.866, 0.5),
    (0.5, 0.866),
    (0.0, 1.0),
    (-0.5, 0.866),
    (-0.866, 0.5),
    (-1.0, 0.0),
    (-0.866, -0.5),
    (-0.5, -0.866),
    (0.0, -1.0),
    (0.5, -0.866),
    (0.866, -0.5),
];
