//! Messages of ROS 2's `common_interfaces` for robot interfaces, and their rules.
//! The rules fill the messages, as of ROS 2 Jazzy; and those that ROS 1 Noetic has in their place.

use crate::cdr::WireFormat;
use crate::definition::SEPARATOR;

/// Source of a standard message's field, if it is not the field of the same name.
pub(super) enum FieldOrigin {
    /// A field of the interface, or all fields of one.
    Field(&'static str),
    /// A number that the interface does not have.
    Number(f64),
    /// A text that the interface does not have.
    Text(&'static str),
    /// A frame of the robot that the value is of.
    Frame(&'static str),
    /// A frame that the value names, of that robot.
    NamedFrame(&'static str),
    /// The name of an enumeration's constant, in lower case.
    Name(&'static str),
    /// Numbers of several fields as a list.
    /// The names of the list's items, and the fields.
    Listed(&'static [(&'static str, &'static str)]),
    /// Names of such items.
    Called(&'static [(&'static str, &'static str)]),
    /// Number of each value of an enumeration, from 0 on; the last for all others.
    Among(&'static str, &'static [f64]),
    /// Distance to the front (x) from range and bearing.
    Along { range: &'static str, bearing: &'static str },
    /// Distance to the left (y) from range and bearing.
    Across { range: &'static str, bearing: &'static str },
    /// Number of echoes heard by sonars, times a factor.
    Heard(f64),
    /// The axes of the points at which they were.
    Axes,
    /// Points of the echoes.
    Points,
    /// Sine of half an angle.
    /// It is the z component of the quaternion of a rotation around the vertical.
    HalfSine(&'static str),
    /// Cosine of half an angle.
    HalfCosine(&'static str),
    /// Number, or infinity if the boolean is false.
    When { number: &'static str, holds: &'static str },
    /// End of the last step.
    Last { first: &'static str, step: &'static str, items: &'static str },
    /// Covariance in space of that of x, y and theta, row after row.
    Covariance(&'static str),
    /// Time in nanoseconds, or the message's if the boolean is true.
    Time { time: &'static str, unless: &'static str },
}

use FieldOrigin::{
    Across, Along, Among, Axes, Called, Covariance, Field, Frame, HalfCosine, HalfSine, Heard, Last, Listed,
    Name, NamedFrame, Number, Points, Text, Time, When,
};
use slate_sorted::SortedSet;

const PAN_TILT: &[(&str, &str)] = &[("pan", "pan"), ("tilt", "tilt")];
const PAN_TILT_VELOCITY: &[(&str, &str)] = &[("pan", "pan_velocity"), ("tilt", "tilt_velocity")];
const TWO_WHEELS: &[(&str, &str)] = &[("left_wheel", "left"), ("right_wheel", "right")];
const FOUR_WHEELS: &[(&str, &str)] = &[
    ("front_left_wheel", "front_left"),
    ("front_right_wheel", "front_right"),
    ("back_left_wheel", "back_left"),
    ("back_right_wheel", "back_right"),
];

/// Rules: message, field in it, and source of the field.
/// A rule whose fields the interface lacks is left out.
pub(super) const RULES: &[(&str, &str, FieldOrigin)] = &[
    ("diagnostic_msgs/DiagnosticStatus", "level", Among("state", &[0.0, 0.0, 2.0, 3.0])),
    ("diagnostic_msgs/DiagnosticStatus", "name", Text("mission")),
    ("diagnostic_msgs/DiagnosticStatus", "message", Field("reason")),
    ("geometry_msgs/PointStamped", "point/x", Along { range: "range", bearing: "bearing" }),
    ("geometry_msgs/PointStamped", "point/y", Across { range: "range", bearing: "bearing" }),
    ("geometry_msgs/PolygonStamped", "polygon/points", Field("outline")),
    ("geometry_msgs/PoseArray", "poses", Field("list")),
    ("geometry_msgs/PoseArray", "poses/position/x", Along { range: "range", bearing: "bearing" }),
    ("geometry_msgs/PoseArray", "poses/position/y", Across { range: "range", bearing: "bearing" }),
    ("geometry_msgs/PoseArray", "poses/orientation/w", Number(1.0)),
    ("geometry_msgs/PoseWithCovarianceStamped", "header/frame_id", Text("map")),
    ("geometry_msgs/PoseWithCovarianceStamped", "pose/pose/position", Field("pose")),
    ("geometry_msgs/PoseWithCovarianceStamped", "pose/pose/orientation/z", HalfSine("pose/theta")),
    ("geometry_msgs/PoseWithCovarianceStamped", "pose/pose/orientation/w", HalfCosine("pose/theta")),
    ("geometry_msgs/PoseWithCovarianceStamped", "pose/covariance", Covariance("covariance")),
    ("geometry_msgs/Quaternion", "z", HalfSine("theta")),
    ("geometry_msgs/Quaternion", "w", HalfCosine("theta")),
    ("geometry_msgs/Twist", "linear/x", Field("linear")),
    ("geometry_msgs/Twist", "linear/x", Field("x")),
    ("geometry_msgs/Twist", "linear/y", Field("y")),
    ("geometry_msgs/Twist", "angular/z", Field("angular")),
    ("geometry_msgs/TransformStamped", "header/stamp", Time { time: "time", unless: "fixed" }),
    ("geometry_msgs/TransformStamped", "header/frame_id", NamedFrame("parent")),
    ("geometry_msgs/TransformStamped", "child_frame_id", NamedFrame("child")),
    ("geometry_msgs/TransformStamped", "transform/translation", Field("translation")),
    ("geometry_msgs/TransformStamped", "transform/rotation", Field("rotation")),
    ("nav_msgs/OccupancyGrid", "header/frame_id", Text("map")),
    ("nav_msgs/OccupancyGrid", "info/resolution", Field("resolution")),
    ("nav_msgs/OccupancyGrid", "info/width", Field("width")),
    ("nav_msgs/OccupancyGrid", "info/height", Field("height")),
    ("nav_msgs/OccupancyGrid", "info/origin/position", Field("origin")),
    ("nav_msgs/OccupancyGrid", "info/origin/orientation/z", HalfSine("origin/theta")),
    ("nav_msgs/OccupancyGrid", "info/origin/orientation/w", HalfCosine("origin/theta")),
    ("nav_msgs/Odometry", "header/frame_id", Frame("odom")),
    ("nav_msgs/Odometry", "child_frame_id", Frame("base_link")),
    ("nav_msgs/Odometry", "pose/pose/position", Field("pose")),
    ("nav_msgs/Odometry", "pose/pose/orientation/z", HalfSine("pose/theta")),
    ("nav_msgs/Odometry", "pose/pose/orientation/w", HalfCosine("pose/theta")),
    ("nav_msgs/Odometry", "twist/twist/linear/x", Field("twist/linear")),
    ("nav_msgs/Odometry", "twist/twist/angular/z", Field("twist/angular")),
    ("nav_msgs/Path", "header/frame_id", Text("map")),
    ("nav_msgs/Path", "poses", Field("points")),
    ("nav_msgs/Path", "poses/header/frame_id", Text("map")),
    ("nav_msgs/Path", "poses/pose/position/x", Field("x")),
    ("nav_msgs/Path", "poses/pose/position/y", Field("y")),
    ("nav_msgs/Path", "poses/pose/orientation/w", Number(1.0)),
    ("sensor_msgs/BatteryState", "temperature", Number(f64::NAN)),
    ("sensor_msgs/BatteryState", "current", Number(f64::NAN)),
    ("sensor_msgs/BatteryState", "charge", Number(f64::NAN)),
    ("sensor_msgs/BatteryState", "capacity", Number(f64::NAN)),
    ("sensor_msgs/BatteryState", "design_capacity", Number(f64::NAN)),
    ("sensor_msgs/BatteryState", "percentage", Number(f64::NAN)),
    ("sensor_msgs/BatteryState", "present", Number(1.0)),
    // As ROS 1 calls them.
    ("sensor_msgs/CameraInfo", "D", Field("d")),
    ("sensor_msgs/CameraInfo", "K", Field("k")),
    ("sensor_msgs/CameraInfo", "R", Field("r")),
    ("sensor_msgs/CameraInfo", "P", Field("p")),
    ("sensor_msgs/Image", "encoding", Name("format")),
    (
        "sensor_msgs/LaserScan",
        "angle_max",
        Last { first: "angle_min", step: "angle_increment", items: "ranges" },
    ),
    ("sensor_msgs/JointState", "name", Called(PAN_TILT)),
    ("sensor_msgs/JointState", "name", Called(TWO_WHEELS)),
    ("sensor_msgs/JointState", "name", Called(FOUR_WHEELS)),
    ("sensor_msgs/JointState", "position", Listed(PAN_TILT)),
    ("sensor_msgs/JointState", "velocity", Listed(PAN_TILT_VELOCITY)),
    ("sensor_msgs/JointState", "velocity", Listed(TWO_WHEELS)),
    ("sensor_msgs/JointState", "velocity", Listed(FOUR_WHEELS)),
    ("sensor_msgs/NavSatFix", "status/status", Among("status", &[-1.0, 0.0, 1.0, 2.0])),
    ("sensor_msgs/PointCloud2", "height", Number(1.0)),
    ("sensor_msgs/PointCloud2", "width", Heard(1.0)),
    ("sensor_msgs/PointCloud2", "fields", Axes),
    ("sensor_msgs/PointCloud2", "point_step", Number(12.0)),
    ("sensor_msgs/PointCloud2", "row_step", Heard(12.0)),
    ("sensor_msgs/PointCloud2", "data", Points),
    ("sensor_msgs/PointCloud2", "is_dense", Number(1.0)),
    ("sensor_msgs/Range", "range", When { number: "range", holds: "heard" }),
    ("std_msgs/Float64", "data", Field("distance")),
];

/// Message, its definition without comments.
const MESSAGES: &[(&str, &str)] = &[
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    (
        "diagnostic_msgs/DiagnosticStatus",
        "byte OK=0\n\
         byte WARN=1\n\
         byte ERROR=2\n\
         byte STALE=3\n\
         byte level\n\
         string name\n\
         string message\n\
         string hardware_id\n\
         diagnostic_msgs/KeyValue[] values\n",
    ),
    ("diagnostic_msgs/KeyValue", "string key\nstring value\n"),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/Point32", "float32 x\nfloat32 y\nfloat32 z\n"),
    ("geometry_msgs/PointStamped", "std_msgs/Header header\ngeometry_msgs/Point point\n"),
    ("geometry_msgs/Polygon", "geometry_msgs/Point32[] points\n"),
    ("geometry_msgs/PolygonStamped", "std_msgs/Header header\ngeometry_msgs/Polygon polygon\n"),
    ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"),
    ("geometry_msgs/Pose2D", "float64 x\nfloat64 y\nfloat64 theta\n"),
    ("geometry_msgs/PoseArray", "std_msgs/Header header\ngeometry_msgs/Pose[] poses\n"),
    ("geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"),
    ("geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"),
    (
        "geometry_msgs/PoseWithCovarianceStamped",
        "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n",
    ),
    ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"),
    ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    ),
    ("geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"),
    ("geometry_msgs/TwistStamped", "std_msgs/Header header\ngeometry_msgs/Twist twist\n"),
    ("geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    (
        "nav_msgs/MapMetaData",
        "builtin_interfaces/Time map_load_time\n\
         float32 resolution\n\
         uint32 width\n\
         uint32 height\n\
         geometry_msgs/Pose origin\n",
    ),
    (
        "nav_msgs/OccupancyGrid",
        "std_msgs/Header header\n\
         nav_msgs/MapMetaData info\n\
         int8[] data\n",
    ),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header\n\
         string child_frame_id\n\
         geometry_msgs/PoseWithCovariance pose\n\
         geometry_msgs/TwistWithCovariance twist\n",
    ),
    ("nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"),
    (
        "sensor_msgs/BatteryState",
        "uint8 POWER_SUPPLY_STATUS_UNKNOWN = 0\n\
         uint8 POWER_SUPPLY_STATUS_CHARGING = 1\n\
         uint8 POWER_SUPPLY_STATUS_DISCHARGING = 2\n\
         uint8 POWER_SUPPLY_STATUS_NOT_CHARGING = 3\n\
         uint8 POWER_SUPPLY_STATUS_FULL = 4\n\
         uint8 POWER_SUPPLY_HEALTH_UNKNOWN = 0\n\
         uint8 POWER_SUPPLY_HEALTH_GOOD = 1\n\
         uint8 POWER_SUPPLY_HEALTH_OVERHEAT = 2\n\
         uint8 POWER_SUPPLY_HEALTH_DEAD = 3\n\
         uint8 POWER_SUPPLY_HEALTH_OVERVOLTAGE = 4\n\
         uint8 POWER_SUPPLY_HEALTH_UNSPEC_FAILURE = 5\n\
         uint8 POWER_SUPPLY_HEALTH_COLD = 6\n\
         uint8 POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE = 7\n\
         uint8 POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE = 8\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_UNKNOWN = 0\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_NIMH = 1\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_LION = 2\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_LIPO = 3\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_LIFE = 4\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_NICD = 5\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_LIMN = 6\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_TERNARY = 7\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_VRLA = 8\n\
         std_msgs/Header header\n\
         float32 voltage\n\
         float32 temperature\n\
         float32 current\n\
         float32 charge\n\
         float32 capacity\n\
         float32 design_capacity\n\
         float32 percentage\n\
         uint8 power_supply_status\n\
         uint8 power_supply_health\n\
         uint8 power_supply_technology\n\
         bool present\n\
         float32[] cell_voltage\n\
         float32[] cell_temperature\n\
         string location\n\
         string serial_number\n",
    ),
    (
        "sensor_msgs/CameraInfo",
        "std_msgs/Header header\n\
         uint32 height\n\
         uint32 width\n\
         string distortion_model\n\
         float64[] d\n\
         float64[9] k\n\
         float64[9] r\n\
         float64[12] p\n\
         uint32 binning_x\n\
         uint32 binning_y\n\
         sensor_msgs/RegionOfInterest roi\n",
    ),
    (
        "sensor_msgs/Image",
        "std_msgs/Header header\n\
         uint32 height\n\
         uint32 width\n\
         string encoding\n\
         uint8 is_bigendian\n\
         uint32 step\n\
         uint8[] data\n",
    ),
    (
        "sensor_msgs/JointState",
        "std_msgs/Header header\n\
         string[] name\n\
         float64[] position\n\
         float64[] velocity\n\
         float64[] effort\n",
    ),
    (
        "sensor_msgs/Imu",
        "std_msgs/Header header\n\
         geometry_msgs/Quaternion orientation\n\
         float64[9] orientation_covariance\n\
         geometry_msgs/Vector3 angular_velocity\n\
         float64[9] angular_velocity_covariance\n\
         geometry_msgs/Vector3 linear_acceleration\n\
         float64[9] linear_acceleration_covariance\n",
    ),
    ("sensor_msgs/Joy", "std_msgs/Header header\nfloat32[] axes\nint32[] buttons\n"),
    (
        "sensor_msgs/LaserScan",
        "std_msgs/Header header\n\
         float32 angle_min\n\
         float32 angle_max\n\
         float32 angle_increment\n\
         float32 time_increment\n\
         float32 scan_time\n\
         float32 range_min\n\
         float32 range_max\n\
         float32[] ranges\n\
         float32[] intensities\n",
    ),
    (
        "sensor_msgs/NavSatFix",
        "uint8 COVARIANCE_TYPE_UNKNOWN = 0\n\
         uint8 COVARIANCE_TYPE_APPROXIMATED = 1\n\
         uint8 COVARIANCE_TYPE_DIAGONAL_KNOWN = 2\n\
         uint8 COVARIANCE_TYPE_KNOWN = 3\n\
         std_msgs/Header header\n\
         sensor_msgs/NavSatStatus status\n\
         float64 latitude\n\
         float64 longitude\n\
         float64 altitude\n\
         float64[9] position_covariance\n\
         uint8 position_covariance_type\n",
    ),
    (
        "sensor_msgs/NavSatStatus",
        "int8 STATUS_UNKNOWN = -2\n\
         int8 STATUS_NO_FIX = -1\n\
         int8 STATUS_FIX = 0\n\
         int8 STATUS_SBAS_FIX = 1\n\
         int8 STATUS_GBAS_FIX = 2\n\
         uint16 SERVICE_UNKNOWN = 0\n\
         uint16 SERVICE_GPS = 1\n\
         uint16 SERVICE_GLONASS = 2\n\
         uint16 SERVICE_COMPASS = 4\n\
         uint16 SERVICE_GALILEO = 8\n\
         int8 status\n\
         uint16 service\n",
    ),
    (
        "sensor_msgs/PointCloud2",
        "std_msgs/Header header\n\
         uint32 height\n\
         uint32 width\n\
         sensor_msgs/PointField[] fields\n\
         bool is_bigendian\n\
         uint32 point_step\n\
         uint32 row_step\n\
         uint8[] data\n\
         bool is_dense\n",
    ),
    (
        "sensor_msgs/PointField",
        "uint8 INT8=1\n\
         uint8 UINT8=2\n\
         uint8 INT16=3\n\
         uint8 UINT16=4\n\
         uint8 INT32=5\n\
         uint8 UINT32=6\n\
         uint8 FLOAT32=7\n\
         uint8 FLOAT64=8\n\
         string name\n\
         uint32 offset\n\
         uint8 datatype\n\
         uint32 count\n",
    ),
    (
        "sensor_msgs/Range",
        "uint8 ULTRASOUND=0\n\
         uint8 INFRARED=1\n\
         std_msgs/Header header\n\
         uint8 radiation_type\n\
         float32 field_of_view\n\
         float32 min_range\n\
         float32 max_range\n\
         float32 range\n\
         float32 variance\n",
    ),
    (
        "sensor_msgs/RegionOfInterest",
        "uint32 x_offset\n\
         uint32 y_offset\n\
         uint32 height\n\
         uint32 width\n\
         bool do_rectify\n",
    ),
    ("std_msgs/Float64", "float64 data\n"),
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"),
];

/// Messages that differ in ROS 1.
const MESSAGES_OF_ROS1: &[(&str, &str)] = &[
    ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"),
    (
        "nav_msgs/MapMetaData",
        "time map_load_time\n\
         float32 resolution\n\
         uint32 width\n\
         uint32 height\n\
         geometry_msgs/Pose origin\n",
    ),
    (
        "sensor_msgs/BatteryState",
        "uint8 POWER_SUPPLY_STATUS_UNKNOWN = 0\n\
         uint8 POWER_SUPPLY_STATUS_CHARGING = 1\n\
         uint8 POWER_SUPPLY_STATUS_DISCHARGING = 2\n\
         uint8 POWER_SUPPLY_STATUS_NOT_CHARGING = 3\n\
         uint8 POWER_SUPPLY_STATUS_FULL = 4\n\
         uint8 POWER_SUPPLY_HEALTH_UNKNOWN = 0\n\
         uint8 POWER_SUPPLY_HEALTH_GOOD = 1\n\
         uint8 POWER_SUPPLY_HEALTH_OVERHEAT = 2\n\
         uint8 POWER_SUPPLY_HEALTH_DEAD = 3\n\
         uint8 POWER_SUPPLY_HEALTH_OVERVOLTAGE = 4\n\
         uint8 POWER_SUPPLY_HEALTH_UNSPEC_FAILURE = 5\n\
         uint8 POWER_SUPPLY_HEALTH_COLD = 6\n\
         uint8 POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE = 7\n\
         uint8 POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE = 8\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_UNKNOWN = 0\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_NIMH = 1\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_LION = 2\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_LIPO = 3\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_LIFE = 4\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_NICD = 5\n\
         uint8 POWER_SUPPLY_TECHNOLOGY_LIMN = 6\n\
         std_msgs/Header header\n\
         float32 voltage\n\
         float32 temperature\n\
         float32 current\n\
         float32 charge\n\
         float32 capacity\n\
         float32 design_capacity\n\
         float32 percentage\n\
         uint8 power_supply_status\n\
         uint8 power_supply_health\n\
         uint8 power_supply_technology\n\
         bool present\n\
         float32[] cell_voltage\n\
         float32[] cell_temperature\n\
         string location\n\
         string serial_number\n",
    ),
    (
        "sensor_msgs/NavSatStatus",
        "int8 STATUS_NO_FIX=-1\n\
         int8 STATUS_FIX=0\n\
         int8 STATUS_SBAS_FIX=1\n\
         int8 STATUS_GBAS_FIX=2\n\
         uint16 SERVICE_GPS=1\n\
         uint16 SERVICE_GLONASS=2\n\
         uint16 SERVICE_COMPASS=4\n\
         uint16 SERVICE_GALILEO=8\n\
         int8 status\n\
         uint16 service\n",
    ),
    (
        "sensor_msgs/CameraInfo",
        "std_msgs/Header header\n\
         uint32 height\n\
         uint32 width\n\
         string distortion_model\n\
         float64[] D\n\
         float64[9] K\n\
         float64[9] R\n\
         float64[12] P\n\
         uint32 binning_x\n\
         uint32 binning_y\n\
         sensor_msgs/RegionOfInterest roi\n",
    ),
    (
        "sensor_msgs/Range",
        "uint8 ULTRASOUND=0\n\
         uint8 INFRARED=1\n\
         std_msgs/Header header\n\
         uint8 radiation_type\n\
         float32 field_of_view\n\
         float32 min_range\n\
         float32 max_range\n\
         float32 range\n",
    ),
    ("std_msgs/Header", "uint32 seq\ntime stamp\nstring frame_id\n"),
];

/// Returns the fields of a message such as `std_msgs/Header`.
pub(crate) fn message_body(format: WireFormat, name: &str) -> Option<&'static str> {
    let own = if format == WireFormat::Ros1 { MESSAGES_OF_ROS1 } else { &[] };
    own.iter().chain(MESSAGES).find(|(known, _)| *known == name).map(|(_, body)| *body)
}

/// Returns the whole definition of a message such as `std_msgs/Header`.
/// Those of the messages in it follow.
pub(super) fn text(name: &str, format: WireFormat) -> Option<String> {
    let body = |name: &str| message_body(format, name);
    let inside = |body: &'static str| {
        let types = body.lines().filter_map(|line| line.split_whitespace().next());
        types.filter(|of| of.contains('/')).map(|of| of.trim_end_matches("[]")).collect::<Vec<_>>()
    };
    let own = body(name)?;
    let mut text = own.to_owned();
    let mut waiting = inside(own);
    waiting.reverse();
    let mut done = SortedSet::new();
    while let Some(next) = waiting.pop() {
        if done.insert(next) {
            let body = body(next)?;
            text.push_str(&format!("{SEPARATOR}\nMSG: {next}\n{body}"));
            waiting.extend(inside(body).into_iter().rev());
        }
    }
    Some(text)
}
