use slate_module::{Sequence, Text, interface};

/// Intrinsic calibration of a camera.
///
/// Its frame is the optical one of REP-103: x to the right of the image, y down, z along the optical axis. Centers of pixels have
/// whole coordinates.
#[interface(ros = "sensor_msgs/msg/CameraInfo")]
#[derive(PartialEq)]
pub struct CameraInfo {
    /// Number of rows.
    pub height: u32,
    /// Pixels of a row.
    pub width: u32,
    /// Model of the distortion: `plumb_bob`.
    pub distortion_model: Text<28>,
    /// Parameters of the distortion: k1, k2, t1, t2, k3.
    pub d: Sequence<f64, 8>,
    /// Intrinsic matrix of the raw image.
    /// Row by row: fx, 0, cx, 0, fy, cy, 0, 0, 1.
    pub k: [f64; 9],
    /// Rectification matrix, row by row.
    pub r: [f64; 9],
    /// Projection matrix of the rectified image, row by row: 3 rows of 4.
    pub p: [f64; 12],
}

/// Setpoint of a pan-tilt head.
#[interface(ros = "sensor_msgs/msg/JointState")]
#[derive(PartialEq)]
pub struct PanTiltCommand {
    /// Counter-clockwise from the front.
    #[unit("rad")]
    pub pan: f64,
    /// Downwards from level, as a rotation about y.
    #[unit("rad")]
    pub tilt: f64,
}

/// State of a pan-tilt head.
#[interface(ros = "sensor_msgs/msg/JointState")]
#[derive(PartialEq)]
pub struct PanTiltState {
    /// Counter-clockwise from the front.
    #[unit("rad")]
    pub pan: f64,
    /// Downwards from level, as a rotation about y.
    #[unit("rad")]
    pub tilt: f64,
    /// Velocity of the pan joint.
    #[unit("rad/s")]
    pub pan_velocity: f64,
    /// Velocity of the tilt joint.
    #[unit("rad/s")]
    pub tilt_velocity: f64,
}

impl CameraInfo {
    /// Returns the calibration of a pinhole camera with radial distortion k1 and k2.
    pub fn pinhole([width, height]: [u32; 2], [fx, fy, cx, cy]: [f64; 4], [k1, k2]: [f64; 2]) -> Self {
        Self {
            height,
            width,
            distortion_model: Text::new("plumb_bob"),
            d: Sequence::new(&[k1, k2, 0.0, 0.0, 0.0]),
            k: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p: [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        }
    }
}
