use slate_module::interface;

/// Kind of a satellite fix, as ROS's `NavSatStatus` numbers it.
#[interface]
pub enum FixStatus {
    /// No position.
    NoFix,
    /// Position from satellites alone.
    Fix,
    /// Position with corrections of satellites.
    SatelliteAugmented,
    /// Position with corrections of a ground station.
    GroundAugmented,
}

/// Position on Earth by a navigation satellite system, in WGS 84.
#[interface(ros = "sensor_msgs/msg/NavSatFix")]
#[derive(PartialEq)]
pub struct NavSatFix {
    /// Kind of the fix.
    pub status: FixStatus,
    /// Latitude, positive to the north.
    #[unit("deg")]
    pub latitude: f64,
    /// Longitude, positive to the east.
    #[unit("deg")]
    pub longitude: f64,
    /// Height above the ellipsoid; NaN if unknown.
    #[unit("m")]
    pub altitude: f64,
    /// Covariance of the position to the east, north and up, row by row, m².
    /// Zeros if unknown.
    pub position_covariance: [f64; 9],
}
