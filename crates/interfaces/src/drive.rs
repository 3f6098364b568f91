use slate_module::interface;

/// A motion in the plane, in the robot's own frame.
#[interface(ros = "geometry_msgs/msg/Twist")]
#[derive(PartialEq)]
pub struct Twist2 {
    /// Forward.
    #[unit("m/s")]
    pub linear: f64,
    /// Turning, counter-clockwise.
    #[unit("rad/s")]
    pub angular: f64,
}

impl Twist2 {
    /// Standing still.
    pub const ZERO: Self = Self { linear: 0.0, angular: 0.0 };
}

/// The speeds of the wheels of a robot that steers by driving its sides differently.
#[interface(ros = "sensor_msgs/msg/JointState")]
#[derive(PartialEq)]
pub struct WheelSpeeds {
    /// Left side, forward.
    #[unit("rad/s")]
    pub left: f64,
    /// Right side, forward.
    #[unit("rad/s")]
    pub right: f64,
}

impl WheelSpeeds {
    /// Standing still.
    pub const ZERO: Self = Self { left: 0.0, right: 0.0 };
}

/// The speeds of the wheels of a robot with four driven wheels, such as one that steers by skidding.
#[interface(ros = "sensor_msgs/msg/JointState")]
#[derive(PartialEq)]
pub struct FourWheelSpeeds {
    /// Front left wheel, forward.
    #[unit("rad/s")]
    pub front_left: f64,
    /// Front right wheel, forward.
    #[unit("rad/s")]
    pub front_right: f64,
    /// Back left wheel, forward.
    #[unit("rad/s")]
    pub back_left: f64,
    /// Back right wheel, forward.
    #[unit("rad/s")]
    pub back_right: f64,
}

impl FourWheelSpeeds {
    /// Standing still.
    pub const ZERO: Self = Self { front_left: 0.0, front_right: 0.0, back_left: 0.0, back_right: 0.0 };
}
