use slate_module::{Bool, Sequence, interface};

/// Mount of a sonar on its robot.
#[interface(ros = "geometry_msgs/msg/Pose2D")]
#[derive(PartialEq)]
pub struct SonarPlacement {
    /// x in the robot's frame.
    #[unit("m")]
    pub x: f64,
    /// y in the robot's frame.
    #[unit("m")]
    pub y: f64,
    /// Direction of the beam's axis, counter-clockwise from the robot's front.
    #[unit("rad")]
    pub theta: f64,
}

/// Measurement of one sonar.
#[interface(ros = "sensor_msgs/msg/Range")]
#[derive(PartialEq)]
pub struct Echo {
    /// Distance of the nearest obstacle in the cone; the maximum range without an echo.
    #[unit("m")]
    pub range: f64,
    /// Echo: true if one was received.
    pub heard: Bool,
}

/// Scan of a ring of sonars.
#[interface(ros = "sensor_msgs/msg/PointCloud2")]
#[derive(PartialEq)]
pub struct SonarScan {
    /// Full opening angle of each cone.
    #[unit("rad")]
    pub field_of_view: f64,
    /// Minimum range.
    #[unit("m")]
    pub range_min: f64,
    /// Maximum range.
    #[unit("m")]
    pub range_max: f64,
    /// Mounts, in the order of the echoes.
    pub placements: Sequence<SonarPlacement, 16>,
    /// Measurements.
    pub echoes: Sequence<Echo, 16>,
}

/// Scan of a laser range finder.
#[interface(ros = "sensor_msgs/msg/LaserScan")]
pub struct LaserScan {
    /// Direction of the first beam.
    #[unit("rad")]
    pub angle_min: f64,
    /// Angle between beams.
    #[unit("rad")]
    pub angle_increment: f64,
    /// Minimum range.
    #[unit("m")]
    pub range_min: f64,
    /// Maximum range.
    #[unit("m")]
    pub range_max: f64,
    /// Ranges, counter-clockwise; infinite without an echo.
    #[unit("m")]
    pub ranges: [f32],
}

/// Distance to the nearest other body.
#[interface(ros = "std_msgs/msg/Float64")]
#[derive(PartialEq)]
pub struct Clearance {
    /// Distance from hull to hull.
    #[unit("m")]
    pub distance: f64,
}
