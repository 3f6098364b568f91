use slate_module::{Bool, Sequence, interface};

/// Where a sonar sits on its robot, and what it can see.
#[interface(ros = "geometry_msgs/msg/Pose2D")]
#[derive(PartialEq)]
pub struct SonarPlacement {
    /// In front of the robot's reference point.
    #[unit("m")]
    pub x: f64,
    /// Left of the robot's reference point.
    #[unit("m")]
    pub y: f64,
    /// Direction of the beam's axis, counter-clockwise from the robot's front.
    #[unit("rad")]
    pub theta: f64,
}

/// What one sonar heard.
#[interface(ros = "sensor_msgs/msg/Range")]
#[derive(PartialEq)]
pub struct Echo {
    /// Distance to the nearest thing in the cone; the greatest range when nothing was heard.
    #[unit("m")]
    pub range: f64,
    /// Whether anything was heard.
    pub heard: Bool,
    /// Not used.
    pub reserved: [u8; 7],
}

/// What a ring of sonars heard at one time.
#[interface(ros = "sensor_msgs/msg/PointCloud2")]
#[derive(PartialEq)]
pub struct SonarScan {
    /// Full opening angle of each cone.
    #[unit("rad")]
    pub field_of_view: f64,
    /// What is nearer can't be measured.
    #[unit("m")]
    pub range_min: f64,
    /// What is farther can't be heard.
    #[unit("m")]
    pub range_max: f64,
    /// Where the sonars sit, in the order of the echoes.
    pub placements: Sequence<SonarPlacement, 16>,
    /// What they heard.
    pub echoes: Sequence<Echo, 16>,
}

/// One sweep of a laser range finder.
#[interface(ros = "sensor_msgs/msg/LaserScan")]
pub struct LaserScan {
    /// Direction of the first beam.
    #[unit("rad")]
    pub angle_min: f64,
    /// Angle from beam to beam.
    #[unit("rad")]
    pub angle_increment: f64,
    /// What is nearer can't be measured.
    #[unit("m")]
    pub range_min: f64,
    /// What is farther can't be seen.
    #[unit("m")]
    pub range_max: f64,
    /// Distances, counter-clockwise; infinite for none.
    #[unit("m")]
    pub ranges: [f32],
}

/// How far the nearest other body is.
#[interface(ros = "std_msgs/msg/Float64")]
#[derive(PartialEq)]
pub struct Clearance {
    /// From hull to hull.
    #[unit("m")]
    pub distance: f64,
}
