use serde::{Deserialize, Serialize};
use slate_interfaces::{Point2, Pose2};
use slate_module::math;

/// Reason why an outline is not a valid footprint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FootprintError {
    /// Fewer than three corners.
    TooFewCorners,
    /// More than sixteen corners.
    TooManyCorners,
    /// A coordinate is not finite.
    NotFinite,
    /// Not convex, not counter-clockwise, or two corners coincide.
    NotConvex,
}

impl std::fmt::Display for FootprintError {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::TooFewCorners => "a footprint needs at least three corners",
            Self::TooManyCorners => "a footprint has at most sixteen corners",
            Self::NotFinite => "a corner of the footprint is not finite",
            Self::NotConvex => "the footprint is not convex and counter-clockwise",
        })
    }
}

impl std::error::Error for FootprintError {}

/// Side of the outline: start, direction and length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Side {
    x: f64,
    y: f64,
    along_x: f64,
    along_y: f64,
    length: f64,
}

/// Maximum number of corners.
const CORNERS: usize = 16;

/// Convex outline of a robot around its reference point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<[f64; 2]>", into = "Vec<[f64; 2]>")]
pub struct Footprint {
    /// Sides of the outline; the first `count` are valid.
    sides: [Side; CORNERS],
    count: usize,
    center: f64,
    radius: f64,
}

impl Footprint {
    /// Returns the outline with these corners.
    /// Meters, counter-clockwise in the robot's frame.
    ///
    /// # Errors
    /// The reason why these are no corners of a convex outline.
    pub fn new(corners: &[[f64; 2]]) -> Result<Self, FootprintError> {
        if corners.len() < 3 {
            return Err(FootprintError::TooFewCorners);
        }
        if corners.len() > CORNERS {
            return Err(FootprintError::TooManyCorners);
        }
        if corners.iter().flatten().any(|value| !value.is_finite()) {
            return Err(FootprintError::NotFinite);
        }
        let mut sides = [Side::default(); CORNERS];
        for (place, (from, to)) in sides.iter_mut().zip(corners.iter().zip(corners.iter().cycle().skip(1))) {
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            let length = math::hypot(dx, dy);
            if length < 1e-9 {
                return Err(FootprintError::NotConvex);
            }
            let side = Side { x: from[0], y: from[1], along_x: dx / length, along_y: dy / length, length };
            if corners.iter().any(|corner| side.outside(corner[0], corner[1]) > 1e-9) {
                return Err(FootprintError::NotConvex);
            }
            *place = side;
        }
        let front = corners.iter().fold(f64::NEG_INFINITY, |most, corner| math::max(most, corner[0]));
        let back = corners.iter().fold(f64::INFINITY, |least, corner| math::min(least, corner[0]));
        let center = 0.5 * (front + back);
        let radius = corners
            .iter()
            .fold(0.0, |most, corner| math::max(most, math::hypot(corner[0] - center, corner[1])));
        Ok(Self { sides, count: corners.len(), center, radius })
    }

    /// Returns the outline of a robot model.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of(outline: &[Point2]) -> Result<Self, FootprintError> {
        let mut corners = [[0.0; 2]; CORNERS];
        let all = corners.get_mut(..outline.len()).ok_or(FootprintError::TooManyCorners)?;
        for (place, corner) in all.iter_mut().zip(outline) {
            *place = [corner.x, corner.y];
        }
        Self::new(all)
    }

    fn sides(&self) -> &[Side] {
        &self.sides[..self.count]
    }

    /// Returns the radius of the outline about its center, meters.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the x of the outline's center, meters.
    pub fn center(&self) -> f64 {
        self.center
    }

    /// Returns the half width of the outline, meters.
    pub fn half_width(&self) -> f64 {
        self.sides().iter().fold(0.0, |most, side| math::max(most, side.y.abs()))
    }

    /// Returns the front of the outline, meters.
    pub fn front(&self) -> f64 {
        self.sides().iter().fold(f64::NEG_INFINITY, |most, side| math::max(most, side.x))
    }

    /// Returns the x of the outline's front at a lateral distance, meters.
    /// Beyond the outline it is the x of the widest point.
    pub fn front_at(&self, y: f64) -> f64 {
        let y = math::clamp(y, -self.half_width(), self.half_width());
        self.sides().iter().fold(f64::NEG_INFINITY, |most, side| {
            let end = side.y + side.along_y * side.length;
            if (side.y - y) * (end - y) > 1e-12 || side.along_y.abs() < 1e-12 {
                return most;
            }
            math::max(most, side.x + side.along_x * (y - side.y) / side.along_y)
        })
    }

    /// Returns the distance of a point from the outline, meters; negative inside.
    pub fn distance(&self, x: f64, y: f64) -> f64 {
        let mut outside = f64::NEG_INFINITY;
        let mut nearest = f64::INFINITY;
        for side in self.sides() {
            let across = side.outside(x, y);
            outside = math::max(outside, across);
            let along = (x - side.x) * side.along_x + (y - side.y) * side.along_y;
            let beyond = along - math::clamp(along, 0.0, side.length);
            nearest = math::min(nearest, across * across + beyond * beyond);
        }
        if outside <= 0.0 { outside } else { nearest.sqrt() }
    }

    /// Returns the distance as [`Self::distance`], exact only up to `reach`.
    /// Beyond `reach` it is a lower bound, which is cheaper.
    pub fn distance_within(&self, x: f64, y: f64, reach: f64) -> f64 {
        let limit = self.radius + reach;
        let dx = x - self.center;
        if dx * dx + y * y > limit * limit { reach } else { self.distance(x, y) }
    }

    /// Corners in the robot's frame, meters.
    pub fn outline(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.sides().iter().map(|side| [side.x, side.y])
    }

    /// Corners in the world, meters, for a robot at a pose.
    pub fn corners(&self, pose: Pose2) -> impl Iterator<Item = Point2> + '_ {
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        self.sides().iter().map(move |side| Point2 {
            x: pose.x + cosine * side.x - sine * side.y,
            y: pose.y + sine * side.x + cosine * side.y,
        })
    }
}

impl Side {
    /// Returns the signed distance of a point from this side's line.
    fn outside(&self, x: f64, y: f64) -> f64 {
        (x - self.x) * self.along_y - (y - self.y) * self.along_x
    }
}

impl TryFrom<Vec<[f64; 2]>> for Footprint {
    type Error = FootprintError;

    fn try_from(corners: Vec<[f64; 2]>) -> Result<Self, FootprintError> {
        Self::new(&corners)
    }
}

impl From<Footprint> for Vec<[f64; 2]> {
    fn from(footprint: Footprint) -> Self {
        footprint.sides().iter().map(|side| [side.x, side.y]).collect()
    }
}
