use slate_module::interface;

/// Planar twist in the robot's frame.
#[interface(ros = "geometry_msgs/msg/Twist")]
#[derive(PartialEq)]
pub struct Twist2 {
    /// Linear velocity, forward.
    #[unit("m/s")]
    pub linear: f64,
    /// Angular velocity, counter-clockwise.
    #[unit("rad/s")]
    pub angular: f64,
}

impl Twist2 {
    /// No motion.
    pub const ZERO: Self = Self { linear: 0.0, angular: 0.0 };
}

/// Planar twist of a robot that moves in all directions, in its frame.
#[interface(ros = "geometry_msgs/msg/Twist")]
#[derive(PartialEq)]
pub struct HolonomicTwist {
    /// Linear velocity, forward.
    #[unit("m/s")]
    pub x: f64,
    /// Linear velocity, left.
    #[unit("m/s")]
    pub y: f64,
    /// Angular velocity, counter-clockwise.
    #[unit("rad/s")]
    pub angular: f64,
}

impl HolonomicTwist {
    /// No motion.
    pub const ZERO: Self = Self { x: 0.0, y: 0.0, angular: 0.0 };
}

/// Wheel speeds of differential or skid steering.
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
    /// No motion.
    pub const ZERO: Self = Self { left: 0.0, right: 0.0 };
}

/// Wheel speeds of four driven wheels, such as of skid steering.
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
    /// No motion.
    pub const ZERO: Self = Self { front_left: 0.0, front_right: 0.0, back_left: 0.0, back_right: 0.0 };
}

/// Wheel speeds of a robot with three or four omni wheels.
#[interface]
#[derive(PartialEq)]
pub struct OmniWheelSpeeds {
    /// Speed of each wheel in the order of the robot's description.
    /// It is positive where it turns the robot counter-clockwise; of three wheels the first three.
    #[unit("rad/s")]
    pub speeds: [f64; 4],
}

impl OmniWheelSpeeds {
    /// No motion.
    pub const ZERO: Self = Self { speeds: [0.0; 4] };
}
