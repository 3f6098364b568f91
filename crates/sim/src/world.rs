//! Worlds in TOML: static bodies between which robots move.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_module::math::{cos, sin};
use slate_worlds::WORLDS;

pub use crate::error::DescriptionError;
use crate::error::{DocumentStep, text_of};
use crate::geometry::{Point, Polygon};
pub use crate::scenery::{
    DecoyDescription, DecoyShape, FireDescription, FloorDescription, Material, Posture, Scenery,
    SignDescription, VictimDescription,
};
use crate::wall_map::WorldMap;

/// Static bodies and their bounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct World {
    /// Name.
    pub name: String,
    /// Area that is shown.
    pub bounds: Bounds,
    /// Static bodies.
    #[serde(default)]
    pub bodies: Vec<Body>,
    /// Scenery for cameras, in addition to bodies.
    #[serde(default)]
    pub scenery: Scenery,
    /// Map whose walls are the first bodies, for a world from a map.
    #[serde(skip)]
    pub map: Option<Arc<WorldMap>>,
}

/// Axis-aligned rectangle, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// South-west corner.
    pub minimum: [f64; 2],
    /// North-east corner.
    pub maximum: [f64; 2],
}

/// Corners of the polygon of a circle.
/// They are on the circle, and the middle of a side is 0.5 % of the radius inside.
const CIRCLE_CORNERS: usize = 32;

/// Static body: rectangle, circle or convex polygon.
/// A rectangle has `center`, `size` and `theta`, a circle `center` and `radius`, a polygon `points`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name.
    pub name: String,
    /// Center of a rectangle or circle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center: Option<[f64; 2]>,
    /// Extent of a rectangle along its axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 2]>,
    /// Radius of a circle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Rotation of a rectangle, rad.
    #[serde(default)]
    pub theta: f64,
    /// Corners of a convex polygon, counter-clockwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 2]>,
    /// Height in camera images, m; that of the scenery by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height: Option<f64>,
    /// Material in camera images; that of the scenery by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<Material>,
}

impl Body {
    /// Creates an axis-aligned rectangle.
    pub fn rectangle(name: &str, center: [f64; 2], size: [f64; 2]) -> Self {
        Self {
            name: name.into(),
            center: Some(center),
            size: Some(size),
            radius: None,
            theta: 0.0,
            points: Vec::new(),
            height: None,
            material: None,
        }
    }

    /// Creates a circle.
    pub fn circle(name: &str, center: [f64; 2], radius: f64) -> Self {
        Self {
            name: name.into(),
            center: Some(center),
            size: None,
            radius: Some(radius),
            theta: 0.0,
            points: Vec::new(),
            height: None,
            material: None,
        }
    }

    /// Returns whether its height, if it has one, can be seen.
    pub(crate) fn has_usable_height(&self) -> bool {
        self.height.is_none_or(|height| height > 0.0 && height <= 100.0)
    }

    /// Returns the outline; `None` without one of the three shapes.
    pub fn polygon(&self) -> Option<Polygon> {
        let polygon = match (self.center, self.size, self.radius, self.points.is_empty()) {
            (Some([x, y]), Some([width, height]), None, true) if width > 0.0 && height > 0.0 => {
                let mut placed = Polygon::default();
                let pose = crate::geometry::Pose { x, y, theta: self.theta };
                Polygon::rectangle(Point::default(), width, height).place(&pose.frame(), &mut placed);
                placed
            }
            (Some([x, y]), None, Some(radius), true) if radius > 0.0 => {
                let corner = |k: usize| {
                    let angle = k as f64 * (2.0 * std::f64::consts::PI / CIRCLE_CORNERS as f64);
                    Point::new(x + radius * cos(angle), y + radius * sin(angle))
                };
                Polygon { points: (0..CIRCLE_CORNERS).map(corner).collect() }
            }
            (None, None, None, false) => {
                Polygon { points: self.points.iter().map(|[x, y]| Point::new(*x, *y)).collect() }
            }
            _ => return None,
        };
        let finite = polygon.points.iter().all(|point| point.x.is_finite() && point.y.is_finite());
        (finite && polygon.is_convex()).then_some(polygon)
    }
}

impl World {
    /// Returns a built-in world.
    pub fn named(name: &str) -> Option<Result<Self, DescriptionError>> {
        WORLDS.iter().any(|(known, _)| *known == name).then(|| Self::load(name))
    }

    /// Loads a world by the name of a built-in one, or by the path of a file.
    /// The file is a description, or a map of ROS with the extension `yaml`.
    ///
    /// # Errors
    /// If it does not exist, and as [`parse`](Self::parse).
    pub fn load(name: &str) -> Result<Self, DescriptionError> {
        if name.ends_with(".yaml") {
            return Self::read_map(name);
        }
        let (source_name, text) = text_of("world", name, &WORLDS)?;
        Self::parse(&source_name, &text)
    }

    /// Reads a world.
    ///
    /// # Errors
    /// The file, the line and the expectation.
    pub fn parse(source_name: &str, text: &str) -> Result<Self, DescriptionError> {
        let world: Self = DescriptionError::parse(source_name, text)?;
        let wrong = |path: &[DocumentStep<'_>], message: String| {
            Err(DescriptionError::within(source_name, text, path, message))
        };
        let Bounds { minimum: [west, south], maximum: [east, north] } = world.bounds;
        if !(west < east && south < north && [west, south, east, north].iter().all(|value| value.is_finite()))
        {
            return wrong(
                &[DocumentStep::Key("bounds")],
                "expected a `maximum` to the north-east of `minimum`".into(),
            );
        }
        if let Some((path, message)) = world.scenery.invalid_value() {
            let path: Vec<_> = std::iter::once(DocumentStep::Key("scenery")).chain(path).collect();
            return wrong(&path, message);
        }
        for (index, body) in world.bodies.iter().enumerate() {
            let path = [DocumentStep::Key("bodies"), DocumentStep::Index(index)];
            if body.polygon().is_none() {
                return wrong(
                    &path,
                    format!(
                        "body `{}` is not one of: a rectangle (`center` and a positive `size`), a circle (`center` and a \
                         positive `radius`), a convex, counter-clockwise polygon (`points`)",
                        body.name
                    ),
                );
            }
            if !body.has_usable_height() {
                let path = [path[0].clone(), path[1].clone(), DocumentStep::Key("height")];
                return wrong(&path, "expected a height above 0, up to 100 m".into());
            }
            if world.bodies[..index].iter().any(|other| other.name == body.name) {
                return wrong(
                    &path,
                    format!("there are two bodies `{}`; expected a name of its own", body.name),
                );
            }
        }
        Ok(world)
    }
}
