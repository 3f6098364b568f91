//! Worlds as TOML: static bodies between which robots move.

use serde::{Deserialize, Serialize};

use crate::geometry::{Point, Polygon};

/// A world, or a robot, that can't be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{source_name}: {message}")]
pub struct DescriptionError {
    /// Which file.
    pub source_name: String,
    /// What is wrong with it, where, and what was expected.
    pub message: String,
}

impl DescriptionError {
    pub(crate) fn new(source_name: &str, message: impl Into<String>) -> Self {
        Self { source_name: source_name.into(), message: message.into() }
    }
}

/// Static bodies and the area that they stand in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct World {
    /// What it is called.
    pub name: String,
    /// The area that is shown.
    pub bounds: Bounds,
    /// What stands in it.
    #[serde(default)]
    pub bodies: Vec<Body>,
}

/// A rectangle along the axes, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// The corner in the south-west.
    pub minimum: [f64; 2],
    /// The corner in the north-east.
    pub maximum: [f64; 2],
}

/// Something that does not move: a rectangle by `center`, `size` and `theta`, or a convex polygon by `points`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// What it is called.
    pub name: String,
    /// Centre of a rectangle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center: Option<[f64; 2]>,
    /// Extent of a rectangle along its axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 2]>,
    /// Turn of a rectangle, radians.
    #[serde(default)]
    pub theta: f64,
    /// Corners of a convex polygon, counter-clockwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 2]>,
}

impl Body {
    /// A rectangle along the axes.
    pub fn rectangle(name: &str, center: [f64; 2], size: [f64; 2]) -> Self {
        Self { name: name.into(), center: Some(center), size: Some(size), theta: 0.0, points: Vec::new() }
    }

    /// Its outline; nothing when it is not described as one of the two shapes.
    pub fn polygon(&self) -> Option<Polygon> {
        let polygon = match (self.center, self.size, self.points.is_empty()) {
            (Some([x, y]), Some([width, height]), true) if width > 0.0 && height > 0.0 => {
                let mut placed = Polygon::default();
                let pose = crate::geometry::Pose { x, y, theta: self.theta };
                Polygon::rectangle(Point::default(), width, height).place(&pose.frame(), &mut placed);
                placed
            }
            (None, None, false) => {
                Polygon { points: self.points.iter().map(|[x, y]| Point::new(*x, *y)).collect() }
            }
            _ => return None,
        };
        let finite = polygon.points.iter().all(|point| point.x.is_finite() && point.y.is_finite());
        (finite && polygon.is_convex()).then_some(polygon)
    }
}

impl World {
    /// A world that comes with the simulator.
    pub fn named(name: &str) -> Option<Result<Self, DescriptionError>> {
        let text = match name {
            "rocs_arena" => include_str!("../../../worlds/rocs_arena.toml"),
            _ => return None,
        };
        Some(Self::parse(&format!("worlds/{name}.toml"), text))
    }

    /// Reads a world.
    ///
    /// # Errors
    /// Names the file, the line and what was expected.
    pub fn parse(source_name: &str, text: &str) -> Result<Self, DescriptionError> {
        let world: Self = toml_edit::de::from_str(text)
            .map_err(|error| DescriptionError::new(source_name, error.to_string()))?;
        for body in &world.bodies {
            if body.polygon().is_none() {
                return Err(DescriptionError::new(
                    source_name,
                    format!(
                        "body `{}` is neither a rectangle (`center` and a positive `size`) nor a convex, \
                         counter-clockwise polygon (`points`)",
                        body.name
                    ),
                ));
            }
        }
        Ok(world)
    }
}
