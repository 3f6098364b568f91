//! Parameters of the block, with `robot_localization`'s names where it has them.

use slate_interfaces::Pose2;
use slate_module::prelude::*;

use super::belief::StateVariable;
use super::parameters::PlanarFilterParameters;
use crate::InvalidParameter;
use crate::frames::FrameNames;
use crate::inputs::VelocityLimits;

/// Parameters of [`Ekf`](super::Ekf).
/// `stddev` is a standard deviation, a rejection threshold a Mahalanobis distance.
#[params]
pub struct EkfParams {
    #[param(
        default = "vx vy vyaw",
        doc = "variables of the odometry that are used, of x y yaw vx vy vyaw; its vy is 0"
    )]
    odom0_config: Text<28>,
    #[param(default = false, doc = "derive vx, vy and vyaw of the odometry from its poses")]
    odom0_differential: Bool,
    #[param(default = 0.1, range = 0.0001..=1000.0, unit = "m", doc = "x and y of the odometry")]
    odom0_position_stddev: f64,
    #[param(default = 0.1, range = 0.0001..=10.0, unit = "rad", doc = "yaw of the odometry")]
    odom0_yaw_stddev: f64,
    #[param(default = 0.05, range = 0.0001..=100.0, unit = "m/s", doc = "vx and vy of the odometry")]
    odom0_linear_velocity_stddev: f64,
    #[param(default = 0.1, range = 0.0001..=100.0, unit = "rad/s", doc = "vyaw of the odometry")]
    odom0_angular_velocity_stddev: f64,
    #[param(default = 1e6, range = 0.1..=1e6, doc = "distance from which x, y and yaw of the odometry are outliers")]
    odom0_pose_rejection_threshold: f64,
    #[param(default = 1e6, range = 0.1..=1e6, doc = "distance from which vx, vy and vyaw of the odometry are outliers")]
    odom0_twist_rejection_threshold: f64,
    #[param(default = "vyaw", doc = "variables of the IMU that are used, of yaw vyaw")]
    imu0_config: Text<28>,
    #[param(default = 0.1, range = 0.0001..=10.0, unit = "rad", doc = "yaw of an IMU without a covariance")]
    imu0_yaw_stddev: f64,
    #[param(default = 0.02, range = 0.0001..=100.0, unit = "rad/s", doc = "angular velocity of an IMU without a covariance")]
    imu0_angular_velocity_stddev: f64,
    #[param(default = 1e6, range = 0.1..=1e6, doc = "distance from which the yaw of the IMU is an outlier")]
    imu0_pose_rejection_threshold: f64,
    #[param(default = 1e6, range = 0.1..=1e6, doc = "distance from which the angular velocity of the IMU is an outlier")]
    imu0_twist_rejection_threshold: f64,
    #[param(default = 0.05, range = 0.0001..=10.0, unit = "rad", doc = "heading of the compass")]
    orientation_stddev: f64,
    #[param(default = 5.0, range = 0.1..=1e6, doc = "distance from which the heading of the compass is an outlier")]
    orientation_rejection_threshold: f64,
    #[param(default = 0.05, range = 0.0001..=1000.0, unit = "m", doc = "x and y of the positioning system")]
    position_stddev: f64,
    #[param(default = 5.0, range = 0.1..=1e6, doc = "distance from which a position is an outlier")]
    position_rejection_threshold: f64,
    #[param(default = 3.0, range = 0.0001..=1000.0, unit = "m", doc = "x and y of a satellite fix without a covariance")]
    fix_stddev: f64,
    #[param(default = 5.0, range = 0.1..=1e6, doc = "distance from which a satellite fix is an outlier")]
    fix_rejection_threshold: f64,
    #[param(default = false, doc = "true: x and y are meters from the datum; false: from the first fix")]
    wait_for_datum: Bool,
    #[param(default = 0.0, range = -90.0..=90.0, unit = "deg", doc = "latitude of the datum")]
    datum_latitude: f64,
    #[param(default = 0.0, range = -180.0..=180.0, unit = "deg", doc = "longitude of the datum")]
    datum_longitude: f64,
    #[param(default = 0.05, range = 0.0001..=100.0, unit = "m", doc = "range of a landmark")]
    landmark_range_stddev: f64,
    #[param(default = 0.05, range = 0.0..=10.0, doc = "share of the range that is added to its deviation")]
    landmark_range_relative_stddev: f64,
    #[param(
        default = false,
        doc = "measure a landmark's range along the robot's x axis, as of a camera that knows its size"
    )]
    landmark_range_is_depth: Bool,
    #[param(default = 0.0, range = 0.0..=1.0, doc = "initial scale of the landmarks' ranges; 0 if it is 1")]
    initial_landmark_scale_stddev: f64,
    #[param(default = 0.05, range = 0.0001..=3.2, unit = "rad", doc = "bearing of a landmark")]
    landmark_bearing_stddev: f64,
    #[param(default = 4.0, range = 0.1..=1e6, doc = "distance from which a landmark's range and bearing are outliers")]
    landmark_rejection_threshold: f64,
    #[param(default = 0.0001, range = 0.0..=1000.0, unit = "m^2/s", doc = "variance that x gains in a second, process_noise_covariance")]
    process_noise_x: f64,
    #[param(default = 0.0001, range = 0.0..=1000.0, unit = "m^2/s", doc = "variance that y gains in a second")]
    process_noise_y: f64,
    #[param(default = 0.0001, range = 0.0..=1000.0, unit = "rad^2/s", doc = "variance that yaw gains in a second")]
    process_noise_yaw: f64,
    #[param(default = 1.0, range = 0.0..=1000.0, unit = "m^2/s^3", doc = "variance that vx gains in a second")]
    process_noise_vx: f64,
    #[param(default = 0.001, range = 0.0..=1000.0, unit = "m^2/s^3", doc = "variance that vy gains in a second")]
    process_noise_vy: f64,
    #[param(default = 1.0, range = 0.0..=1000.0, unit = "rad^2/s^3", doc = "variance that vyaw gains in a second")]
    process_noise_vyaw: f64,
    #[param(
        default = false,
        doc = "true: those of x, y and yaw are for a twist of norm 1, and grow with it"
    )]
    dynamic_process_noise_covariance: Bool,
    #[param(default = 1e-8, range = 0.0..=1.0, unit = "rad^2/s^3", doc = "variance that the gyroscope's bias gains in a second")]
    process_noise_gyroscope_bias: f64,
    #[param(default = 0.01, range = 0.0..=10.0, unit = "rad/s", doc = "initial bias of the gyroscope")]
    initial_gyroscope_bias_stddev: f64,
    #[param(default = 0.0, range = 0.0..=1.0, doc = "initial scale of the odometry's velocity; 0 if it is 1")]
    initial_odometry_linear_scale_stddev: f64,
    #[param(default = 0.0, range = 0.0..=1.0, doc = "initial scale of the odometry's angular velocity; 0 if it is 1")]
    initial_odometry_angular_scale_stddev: f64,
    #[param(default = 0.0, unit = "m", doc = "initial x, of initial_state")]
    initial_state_x: f64,
    #[param(default = 0.0, unit = "m", doc = "initial y")]
    initial_state_y: f64,
    #[param(default = 0.0, unit = "rad", doc = "initial heading")]
    initial_state_yaw: f64,
    #[param(default = 0.5, range = 0.0..=1e6, unit = "m", doc = "initial x and y, and those of a manual reset")]
    initial_position_stddev: f64,
    #[param(default = 0.26, range = 0.0..=10.0, unit = "rad", doc = "initial heading, and that of a manual reset")]
    initial_heading_stddev: f64,
    #[param(default = 20, range = 1..=1_000_000, doc = "outliers of an input in a row from which the robot may have been kidnapped (moved by hand)")]
    max_rejections: i64,
    #[param(default = 10.0, range = 0.0..=1e6, unit = "m", doc = "x and y of a robot that may have been kidnapped")]
    reset_position_stddev: f64,
    #[param(default = 1.0, range = 0.0..=10.0, unit = "rad", doc = "its heading")]
    reset_heading_stddev: f64,
    #[param(default = false, doc = "fuse a late measurement at its time")]
    smooth_lagged_data: Bool,
    #[param(default = 1.0, range = 0.0..=60.0, unit = "s", doc = "maximum age of a late measurement")]
    history_length: f64,
    #[param(default = 3, range = 1..=20, doc = "linearizations of a landmark's range and bearing")]
    iterations: i64,
    #[param(default = 0.5, range = 0.05..=60.0, unit = "s", doc = "age from which odometry or IMU have stopped")]
    sensor_timeout: f64,
    #[param(default = 3.0, range = 0.1..=100.0, unit = "m/s", doc = "velocity above which the odometry counts as a jump")]
    max_linear_velocity: f64,
    #[param(default = 6.0, range = 0.1..=100.0, unit = "rad/s", doc = "angular velocity above which the odometry counts as a jump")]
    max_angular_velocity: f64,
    #[param(default = true, doc = "publish the transform")]
    publish_tf: Bool,
    #[param(default = "map", doc = "frame of the map")]
    map_frame: Text<60>,
    #[param(default = "odom", doc = "frame of the odometry")]
    odom_frame: Text<60>,
    #[param(default = "base_link", doc = "frame of the robot")]
    base_link_frame: Text<60>,
    #[param(default = "odom", doc = "frame of the estimate: map_frame, or odom_frame")]
    world_frame: Text<60>,
}

/// Variables that a configuration names, in the order of [`StateVariable`].
pub(super) type UsedVariables = [bool; 6];

impl EkfParams {
    pub(super) fn filter(&self) -> PlanarFilterParameters {
        PlanarFilterParameters {
            process_noise: [
                self.process_noise_x,
                self.process_noise_y,
                self.process_noise_yaw,
                self.process_noise_vx,
                self.process_noise_vy,
                self.process_noise_vyaw,
            ],
            gyroscope_bias_noise: self.process_noise_gyroscope_bias,
            initial_gyroscope_bias_stddev: self.initial_gyroscope_bias_stddev,
            initial_odometry_scale_stddev: [
                self.initial_odometry_linear_scale_stddev,
                self.initial_odometry_angular_scale_stddev,
            ],
            initial_landmark_scale_stddev: self.initial_landmark_scale_stddev,
            dynamic_process_noise: self.dynamic_process_noise_covariance.get(),
            history_length: if self.smooth_lagged_data.get() { self.history_length } else { 0.0 },
            // The host has checked the range.
            iterations: u32::try_from(self.iterations).unwrap_or(1),
            ..PlanarFilterParameters::default()
        }
    }

    /// Returns which variables of the odometry are used.
    ///
    /// # Errors
    /// A word that is not a variable of it.
    pub(super) fn odometry_variables(&self) -> Result<UsedVariables, InvalidParameter> {
        let expected = "words of: x y yaw vx vy vyaw";
        used(self.odom0_config.as_str(), &NAMES, InvalidParameter { name: "odom0_config", expected })
    }

    /// Returns which variables of the IMU are used.
    ///
    /// # Errors
    /// A word that is not a variable of it.
    pub(super) fn imu_variables(&self) -> Result<UsedVariables, InvalidParameter> {
        let names = [NAMES[StateVariable::Yaw as usize], NAMES[StateVariable::Vyaw as usize]];
        let expected = "words of: yaw vyaw";
        used(self.imu0_config.as_str(), &names, InvalidParameter { name: "imu0_config", expected })
    }

    /// Returns whether the estimate is in the map's frame.
    ///
    /// # Errors
    /// It is in neither frame.
    pub(super) fn is_in_map(&self) -> Result<bool, InvalidParameter> {
        match self.world_frame {
            frame if frame == self.map_frame => Ok(true),
            frame if frame == self.odom_frame => Ok(false),
            _ => Err(InvalidParameter { name: "world_frame", expected: "map_frame or odom_frame" }),
        }
    }

    pub(super) fn initial_pose(&self) -> Pose2 {
        Pose2 { x: self.initial_state_x, y: self.initial_state_y, theta: self.initial_state_yaw }
    }

    pub(super) fn initial_stddev(&self) -> [f64; 3] {
        [self.initial_position_stddev, self.initial_position_stddev, self.initial_heading_stddev]
    }

    pub(super) fn reset_stddev(&self) -> [f64; 3] {
        [self.reset_position_stddev, self.reset_position_stddev, self.reset_heading_stddev]
    }

    pub(super) fn jump_velocities(&self) -> VelocityLimits {
        VelocityLimits { linear: self.max_linear_velocity, angular: self.max_angular_velocity }
    }

    pub(super) fn frames(&self) -> FrameNames<'_> {
        FrameNames {
            map: self.map_frame.as_str(),
            odom: self.odom_frame.as_str(),
            base: self.base_link_frame.as_str(),
        }
    }
}

/// Names of variables, in the order of [`StateVariable`].
const NAMES: [&str; 6] = ["x", "y", "yaw", "vx", "vy", "vyaw"];

fn used(words: &str, names: &[&str], error: InvalidParameter) -> Result<UsedVariables, InvalidParameter> {
    let mut used = [false; 6];
    for word in words.split_whitespace() {
        let at = NAMES.iter().position(|name| *name == word && names.contains(name)).ok_or(error)?;
        used[at] = true;
    }
    Ok(used)
}
