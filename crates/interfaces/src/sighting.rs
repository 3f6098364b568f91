use slate_module::{Sequence, Text, interface};

/// Detection of another robot.
///
/// Range and bearing are in the robot's frame, not the sensor's: between the reference points of both robots.
#[interface(ros = "geometry_msgs/msg/PointStamped")]
#[derive(PartialEq)]
pub struct Sighting {
    /// Distance of the reference points.
    #[unit("m")]
    pub range: f64,
    /// Bearing, counter-clockwise from the robot's front, in (-pi, pi].
    #[unit("rad")]
    pub bearing: f64,
    /// Name of the robot.
    pub name: Text<28>,
}

/// Detections of other robots at one time; possibly none.
#[interface(ros = "geometry_msgs/msg/PoseArray")]
#[derive(PartialEq)]
pub struct Sightings {
    /// Nearest first; the farthest are left out beyond the capacity.
    pub list: Sequence<Sighting, 8>,
}
