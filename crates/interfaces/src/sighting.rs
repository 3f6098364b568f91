use slate_module::{Sequence, Text, interface};

/// Another robot that a sensor sees.
///
/// Range and bearing are told in the robot's own frame and not the sensor's: from the robot's reference point to the
/// reference point of the other, as the sensor believes it to be.
#[interface(ros = "geometry_msgs/msg/PointStamped")]
#[derive(PartialEq)]
pub struct Sighting {
    /// From reference point to reference point.
    #[unit("m")]
    pub range: f64,
    /// Direction to the other, counter-clockwise from the robot's front, in (-pi, pi].
    #[unit("rad")]
    pub bearing: f64,
    /// Which robot it is.
    pub name: Text<28>,
}

/// The other robots that a sensor sees at one time; none is one of the things that it can say.
#[interface(ros = "geometry_msgs/msg/PoseArray")]
#[derive(PartialEq)]
pub struct Sightings {
    /// The nearest first; when more are seen than have room, those farthest away are left out.
    pub list: Sequence<Sighting, 8>,
}
