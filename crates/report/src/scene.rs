use serde::{Deserialize, Serialize};

/// World at the start of a run, drawn alone and behind the trajectories.
/// Meters, x forward, y left.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Minimum shown area of the world; it grows to contain all that is drawn.
    pub bounds: Bounds,
    /// Walls, boxes and other fixed obstacles.
    pub polygons: Vec<Polygon>,
    /// Round fixed obstacles.
    pub circles: Vec<Circle>,
    /// Goals of the robots.
    pub goals: Vec<Goal>,
    /// The robots where they begin.
    #[serde(default)]
    pub robots: Vec<Robot>,
    /// Names of the scripted robots, which have no routes; they are drawn in black.
    pub scripted: Vec<String>,
}

/// A rectangle along the axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Smallest x and y, meters.
    pub minimum: [f64; 2],
    /// Largest x and y, meters.
    pub maximum: [f64; 2],
}

/// A fixed obstacle with corners.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Polygon {
    /// Shown where it fits into the polygon.
    pub name: String,
    /// Corners in order as x and y, meters; the last is joined to the first.
    pub points: Vec<[f64; 2]>,
}

/// A round fixed obstacle.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Circle {
    /// Shown where it fits into the circle.
    pub name: String,
    /// Center as x and y, meters.
    pub center: [f64; 2],
    /// Radius, meters.
    pub radius: f64,
}

/// Goal of a robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    /// Name shown beside the goal.
    pub label: String,
    /// Center, x, meters.
    pub x: f64,
    /// Center, y, meters.
    pub y: f64,
}

/// Robot seen from above.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Robot {
    /// Name shown beside the robot.
    pub name: String,
    /// Position, x, meters.
    pub x: f64,
    /// Position, y, meters.
    pub y: f64,
    /// Radians, counter-clockwise from the x axis.
    pub theta: f64,
    /// Corners of the body in order, in the robot's frame; meters.
    pub outline: Vec<[f64; 2]>,
    /// Opposite corners of each wheel, in the same frame.
    pub wheels: Vec<[[f64; 2]; 2]>,
    /// Cones of its range sensors, in the same frame.
    pub cones: Vec<Cone>,
}

impl Robot {
    /// Transforms a point from the robot's frame to the world.
    pub(crate) fn to_world(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sine, cosine) = (libm::sin(self.theta), libm::cos(self.theta));
        [self.x + cosine * x - sine * y, self.y + sine * x + cosine * y]
    }
}

/// Cone of a range sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cone {
    /// Position of the sensor, x, meters.
    pub x: f64,
    /// Position of the sensor, y, meters.
    pub y: f64,
    /// Middle of the cone, radians counter-clockwise from the front.
    pub direction: f64,
    /// The full angle, radians.
    pub opening: f64,
    /// Maximum range, meters.
    pub range: f64,
}
