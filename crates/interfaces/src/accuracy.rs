use slate_module::interface;

/// Errors of a robot's sensors, from their data sheets.
/// Zero for exact sensors.
///
/// The simulator or the driver of the robot publishes it.
#[interface]
#[derive(PartialEq)]
pub struct SensorAccuracy {
    /// Standard deviation of x and of y of the positioning system.
    #[unit("m")]
    pub position_stddev: f64,
    /// Standard deviation of the heading of the compass.
    #[unit("rad")]
    pub orientation_stddev: f64,
    /// Standard deviation of the odometry's distance after a meter.
    /// It grows with the root of the path.
    #[unit("m")]
    pub odometry_translation_stddev: f64,
    /// Standard deviation of the odometry's heading after a meter or a radian.
    /// It grows with the root of the path or turn.
    #[unit("rad")]
    pub odometry_rotation_stddev: f64,
    /// Probability of an outlier of a sonar's range.
    /// An outlier is not a range to an obstacle, or misses an obstacle.
    pub sonar_outliers: f64,
    /// Standard deviation of the range of a detected robot.
    #[unit("m")]
    pub sighting_range_stddev: f64,
    /// Standard deviation of that range, relative to it.
    pub sighting_range_relative_stddev: f64,
    /// Standard deviation of the bearing of a detected robot.
    #[unit("rad")]
    pub sighting_bearing_stddev: f64,
}
