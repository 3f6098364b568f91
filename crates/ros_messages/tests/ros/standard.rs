use slate_interfaces::{
    Chassis, Clearance, Contacts, Echo, FourWheelSpeeds, HolonomicTwist, Image, ImageFormat, LaserScan,
    MissionState, OccupancyGrid, Odometry, Orientation, Path, Point2, Pose2, PoseEstimate, Position,
    Quaternion, Sighting, Sightings, SonarPlacement, SonarScan, Transform, Twist2, Verdict, WheelSpeeds,
};
use slate_module::blackboard::interface::{Descriptor, Interface, View};
use slate_module::{Sequence, interface};
use slate_ros_messages::{Schema, Value, standard};

use crate::ros::interfaces::{Battery, all, value};

/// The standard message of a value, as its own definition reads it.
fn message(descriptor: &'static Descriptor, bytes: &[u8]) -> Value {
    let standard = standard(descriptor).unwrap();
    let mut message = Vec::new();
    standard.encode(bytes, 12_000_000_034, "base_link", &mut message).unwrap();
    let definition = standard.definition();
    assert_eq!(definition.name, descriptor.ros);
    Schema::parse(&definition.name, &definition.text).unwrap().decode(&message).unwrap()
}

fn of<T: Interface + Copy>(value: &T) -> String {
    let mut value = *value;
    message(T::DESCRIPTOR, View::of(&mut value).bytes()).to_string()
}

const HEADER: &str = "header = { stamp = { sec = 12, nanosec = 34 }, frame_id = \"base_link\" }";

#[test]
fn poses_and_motions_in_the_plane_become_those_in_space() {
    assert_eq!(of(&Pose2 { x: 1.0, y: 2.0, theta: 3.0 }), "{ x = 1, y = 2, theta = 3 }");
    assert_eq!(of(&Position { x: 1.0, y: 2.0, z: 3.0 }), "{ x = 1, y = 2, z = 3 }");
    assert_eq!(of(&Point2 { x: 1.0, y: 2.0 }), "{ x = 1, y = 2, z = 0 }");
    assert_eq!(of(&SonarPlacement { x: 1.0, y: 2.0, theta: 3.0 }), "{ x = 1, y = 2, theta = 3 }");
    assert_eq!(of(&Orientation { theta: 0.0 }), "{ x = 0, y = 0, z = 0, w = 1 }");
    assert_eq!(of(&Quaternion::IDENTITY), "{ x = 0, y = 0, z = 0, w = 1 }");
    assert_eq!(
        of(&Twist2 { linear: 0.5, angular: -1.0 }),
        "{ linear = { x = 0.5, y = 0, z = 0 }, angular = { x = 0, y = 0, z = -1 } }"
    );
    assert_eq!(
        of(&HolonomicTwist { x: 0.5, y: 0.25, angular: -1.0 }),
        "{ linear = { x = 0.5, y = 0.25, z = 0 }, angular = { x = 0, y = 0, z = -1 } }"
    );
    let mut odometry = Odometry {
        pose: Pose2 { x: 1.0, y: 2.0, theta: std::f64::consts::PI },
        twist: Twist2 { linear: 0.5, angular: -1.0 },
    };
    let value = message(Odometry::DESCRIPTOR, View::of(&mut odometry).bytes());
    assert_eq!(value.get("child_frame_id").unwrap().as_str(), Some("base_link"));
    assert_eq!(value.at("pose/pose/position").unwrap().to_string(), "{ x = 1, y = 2, z = 0 }");
    assert_eq!(value.at("pose/pose/orientation/z").unwrap().as_f64(), Some(1.0));
    assert!(value.at("pose/pose/orientation/w").unwrap().as_f64().unwrap().abs() < 1e-15);
    assert_eq!(
        value.at("twist/twist").unwrap().to_string(),
        "{ linear = { x = 0.5, y = 0, z = 0 }, angular = { x = 0, y = 0, z = -1 } }"
    );
    let Some(Value::Numbers(covariance)) = value.at("pose/covariance") else { panic!("{value}") };
    assert_eq!(covariance.len(), 36);
}

#[test]
fn an_estimate_has_its_covariances_among_those_of_space() {
    let pose = Pose2 { x: 1.0, y: 2.0, theta: std::f64::consts::PI };
    let covariance = [11.0, 12.0, 13.0, 21.0, 22.0, 23.0, 31.0, 32.0, 33.0];
    let value = message(PoseEstimate::DESCRIPTOR, View::of(&mut PoseEstimate { pose, covariance }).bytes());
    assert_eq!(value.at("header/frame_id").unwrap().as_str(), Some("map"));
    assert_eq!(value.at("pose/pose/position").unwrap().to_string(), "{ x = 1, y = 2, z = 0 }");
    assert_eq!(value.at("pose/pose/orientation/z").unwrap().as_f64(), Some(1.0));
    let Some(Value::Numbers(numbers)) = value.at("pose/covariance") else { panic!("{value}") };
    let numbers: Vec<f64> = numbers.iter().map(|number| number.as_f64().unwrap()).collect();
    let row = |x: f64, y: f64, theta: f64| [x, y, 0.0, 0.0, 0.0, theta];
    let none = [0.0; 6];
    let rows = [row(11.0, 12.0, 13.0), row(21.0, 22.0, 23.0), none, none, none, row(31.0, 32.0, 33.0)];
    assert_eq!(numbers, rows.concat());
}

#[test]
fn a_way_has_a_pose_for_each_point() {
    let way = |points: &[[f64; 2]]| {
        let bytes = std::iter::once(9.5).chain(points.concat()).flat_map(f64::to_ne_bytes);
        message(Path::DESCRIPTOR, &bytes.collect::<Vec<_>>()).to_string()
    };
    let header = HEADER.replace("base_link", "map");
    let pose = |x: u8, y: u8| {
        format!(
            "{{ {header}, pose = {{ position = {{ x = {x}, y = {y}, z = 0 }}, \
             orientation = {{ x = 0, y = 0, z = 0, w = 1 }} }} }}"
        )
    };
    let poses = format!("[{}, {}]", pose(1, 2), pose(3, 4));
    assert_eq!(way(&[[1.0, 2.0], [3.0, 4.0]]), format!("{{ {header}, poses = {poses} }}"));
    assert_eq!(way(&[]), format!("{{ {header}, poses = [] }}"));
}

#[test]
fn a_grid_map_is_as_navigation_has_it() {
    let mut bytes = Vec::new();
    for number in [-1.0_f64, 2.0, std::f64::consts::PI, 0.5] {
        bytes.extend(number.to_ne_bytes());
    }
    for number in [3_u32, 1] {
        bytes.extend(number.to_ne_bytes());
    }
    bytes.extend([255, 0, 100]);
    let map = message(OccupancyGrid::DESCRIPTOR, &bytes);
    assert_eq!(map.at("data").unwrap().to_string(), "[-1, 0, 100]");
    let info = map.get("info").unwrap();
    let number = |path: &str| info.at(path).unwrap().as_f64().unwrap();
    assert_eq!((number("resolution"), number("width"), number("height")), (0.5, 3.0, 1.0));
    assert_eq!(info.at("origin/position").unwrap().to_string(), "{ x = -1, y = 2, z = 0 }");
    assert_eq!(number("origin/orientation/z"), 1.0);
    assert!(number("origin/orientation/w").abs() < 1e-15);
}

#[test]
fn a_scan_says_where_it_ends() {
    let mut bytes = Vec::new();
    for number in [-1.0_f64, 0.5, 0.25, 8.0] {
        bytes.extend(number.to_ne_bytes());
    }
    for range in [1.0_f32, f32::INFINITY, 3.0, 4.0] {
        bytes.extend(range.to_ne_bytes());
    }
    assert_eq!(
        message(LaserScan::DESCRIPTOR, &bytes).to_string(),
        format!(
            "{{ {HEADER}, angle_min = -1, angle_max = 0.5, angle_increment = 0.5, time_increment = 0, \
             scan_time = 0, range_min = 0.25, range_max = 8, ranges = [1, inf, 3, 4], intensities = [] }}"
        )
    );
    let empty = message(LaserScan::DESCRIPTOR, &bytes[..32]);
    assert_eq!(empty.get("angle_max").unwrap().as_f64(), Some(-1.0));
}

#[test]
fn an_image_names_its_encoding() {
    let image = |format: u8| {
        let mut bytes = Vec::new();
        for number in [2_u32, 1, 6] {
            bytes.extend(number.to_ne_bytes());
        }
        bytes.extend([format, 0, 0, 0, 1, 2, 3, 4, 5, 6]);
        message(Image::DESCRIPTOR, &bytes)
    };
    assert_eq!(ImageFormat::RGB8, ImageFormat(1));
    assert_eq!(
        image(1).to_string(),
        format!(
            "{{ {HEADER}, height = 1, width = 2, encoding = \"rgb8\", is_bigendian = 0, step = 6, \
             data = [1, 2, 3, 4, 5, 6] }}"
        )
    );
    assert_eq!(image(0).get("encoding").unwrap().as_str(), Some("mono8"));
    assert_eq!(image(9).get("encoding").unwrap().as_str(), Some(""));
}

#[test]
fn an_echo_that_was_not_heard_is_out_of_range() {
    let echo = |heard: bool| {
        let mut echo = Echo { range: 2.5, heard: heard.into() };
        message(Echo::DESCRIPTOR, View::of(&mut echo).bytes()).get("range").unwrap().as_f64()
    };
    assert_eq!((echo(true), echo(false)), (Some(2.5), Some(f64::INFINITY)));
}

#[test]
fn wheels_are_joints_that_turn() {
    assert_eq!(
        of(&WheelSpeeds { left: 1.5, right: -2.0 }),
        format!(
            "{{ {HEADER}, name = [\"left_wheel\", \"right_wheel\"], position = [], velocity = [1.5, -2], effort = [] }}"
        )
    );
    let four = FourWheelSpeeds { front_left: 1.0, front_right: 2.0, back_left: 3.0, back_right: 4.0 };
    let wheels = "[\"front_left_wheel\", \"front_right_wheel\", \"back_left_wheel\", \"back_right_wheel\"]";
    assert_eq!(
        of(&four),
        format!("{{ {HEADER}, name = {wheels}, position = [], velocity = [1, 2, 3, 4], effort = [] }}")
    );
}

#[test]
fn sonar_echoes_make_a_point_cloud_and_silence_makes_no_point() {
    let placement = |x: f64, theta: f64| SonarPlacement { x, y: 0.25, theta };
    let echo = |range: f64, heard: bool| Echo { range, heard: heard.into() };
    let mut scan = SonarScan {
        field_of_view: 0.5,
        range_min: 0.1,
        range_max: 5.0,
        placements: Sequence::new(&[
            placement(0.5, 0.0),
            placement(0.0, 1.0),
            placement(-0.5, std::f64::consts::PI),
        ]),
        echoes: Sequence::new(&[echo(2.0, true), echo(5.0, false), echo(1.0, true)]),
    };
    let cloud = message(SonarScan::DESCRIPTOR, View::of(&mut scan).bytes());
    let number = |path: &str| cloud.at(path).unwrap().as_f64().unwrap();
    assert_eq!(["height", "width", "point_step", "row_step"].map(number), [1.0, 2.0, 12.0, 24.0]);
    assert_eq!(
        cloud.at("fields").unwrap().to_string(),
        "[{ name = \"x\", offset = 0, datatype = 7, count = 1 }, { name = \"y\", offset = 4, datatype = 7, count = 1 }, \
         { name = \"z\", offset = 8, datatype = 7, count = 1 }]"
    );
    let Some(Value::Numbers(data)) = cloud.get("data") else { panic!("{cloud}") };
    let numbers: Vec<_> =
        data.bytes().chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect();
    assert_eq!(numbers, [2.5, 0.25, 0.0, -1.5, 0.25, 0.0]);
    assert_eq!(cloud.get("is_dense").unwrap().as_bool(), Some(true));
    assert!(cloud.get("header").unwrap().to_string().contains("base_link"));
}

#[test]
fn robots_that_are_seen_are_where_range_and_bearing_say() {
    let sighting = |range: f64, bearing: f64| Sighting { range, bearing, name: "r2".into() };
    let left = std::f64::consts::FRAC_PI_2;
    let seen = message(
        Sightings::DESCRIPTOR,
        View::of(&mut Sightings { list: Sequence::new(&[sighting(2.0, 0.0), sighting(3.0, left)]) }).bytes(),
    );
    let number = |path: &str| seen.at(&format!("poses/{path}")).unwrap().as_f64().unwrap();
    assert_eq!((number("0/position/x"), number("0/position/y"), number("0/orientation/w")), (2.0, 0.0, 1.0));
    assert!(number("1/position/x").abs() < 1e-12 && number("1/position/y") == 3.0);
    let point = message(Sighting::DESCRIPTOR, View::of(&mut sighting(3.0, left)).bytes());
    assert_eq!(point.at("point/y").unwrap().as_f64(), Some(3.0));
}

#[test]
fn bodies_distances_and_missions_have_messages_of_their_kind() {
    let chassis = Chassis {
        wheel_radius: 0.1,
        track: 0.4,
        maximum_wheel_speed: 10.0,
        maximum_wheel_acceleration: 20.0,
        outline: Sequence::new(&[Point2 { x: 0.25, y: 0.0 }, Point2 { x: 0.0, y: 0.5 }]),
        model: "pioneer_p3dx".into(),
    };
    assert_eq!(
        of(&chassis),
        format!(
            "{{ {HEADER}, polygon = {{ points = [{{ x = 0.25, y = 0, z = 0 }}, {{ x = 0, y = 0.5, z = 0 }}] }} }}"
        )
    );
    assert_eq!(of(&Clearance { distance: 0.75 }), "{ data = 0.75 }");
    let verdict = |state| of(&Verdict { state, reason: "goal reached".into(), ..Verdict::default() });
    let told = |level: u8| {
        format!(
            "{{ level = {level}, name = \"mission\", message = \"goal reached\", hardware_id = \"\", values = [] }}"
        )
    };
    assert_eq!(verdict(MissionState::RUNNING), told(0));
    assert_eq!(verdict(MissionState::SUCCEEDED), told(0));
    assert_eq!(verdict(MissionState::FAILED), told(2));
    assert_eq!(verdict(MissionState(200)), told(3));
}

#[test]
fn unmeasured_battery_values_are_nan() {
    let battery = message(Battery::DESCRIPTOR, View::of(&mut Battery { voltage: 12.5 }).bytes());
    let number = |name: &str| battery.get(name).unwrap().as_f64().unwrap();
    assert_eq!(number("voltage"), 12.5);
    assert!(
        ["temperature", "current", "charge", "capacity", "percentage"]
            .iter()
            .all(|name| number(name).is_nan())
    );
    assert_eq!(battery.get("present").unwrap().as_bool(), Some(true));
}

#[test]
fn a_transform_has_its_own_frames_and_time_unless_it_is_fixed() {
    let transform = |fixed: bool| Transform {
        time: 7_000_000_008,
        parent: "odom".into(),
        child: "laser".into(),
        translation: Position { x: 1.0, y: 2.0, z: 3.0 },
        rotation: Quaternion::IDENTITY,
        fixed: fixed.into(),
    };
    let rest = "child_frame_id = \"laser\", transform = { translation = { x = 1, y = 2, z = 3 }, \
                rotation = { x = 0, y = 0, z = 0, w = 1 } } }";
    assert_eq!(
        of(&transform(false)),
        format!("{{ header = {{ stamp = {{ sec = 7, nanosec = 8 }}, frame_id = \"odom\" }}, {rest}")
    );
    assert_eq!(
        of(&transform(true)),
        format!("{{ header = {{ stamp = {{ sec = 12, nanosec = 34 }}, frame_id = \"odom\" }}, {rest}")
    );
}

/// Laid out like the message of ROS, unlike [`Twist2`].
#[interface(ros = "geometry_msgs/msg/Twist")]
struct FullTwist {
    pub linear: Position,
    pub angular: Position,
}

#[interface(ros = "geometry_msgs/msg/Vector3")]
struct Numbers {
    pub x: f32,
    pub y: i16,
    pub z: u16,
}

#[interface(ros = "geometry_msgs/msg/Vector3")]
struct Nothing3 {
    pub a: f64,
}

#[interface(ros = "geometry_msgs/msg/Vector3")]
struct Unfit {
    pub x: Point2,
}

#[interface(ros = "other_msgs/msg/Thing")]
struct Unknown {
    pub x: f64,
}

#[test]
fn foreign_interfaces_are_matched_by_their_field_names() {
    let twist = FullTwist {
        linear: Position { x: 1.0, y: 2.0, z: 3.0 },
        angular: Position { x: 4.0, y: 5.0, z: 6.0 },
    };
    assert_eq!(of(&twist), "{ linear = { x = 1, y = 2, z = 3 }, angular = { x = 4, y = 5, z = 6 } }");
    assert_eq!(of(&Numbers { x: 0.5, y: -3, z: 9 }), "{ x = 0.5, y = -3, z = 9 }");
    for descriptor in [Nothing3::DESCRIPTOR, Unfit::DESCRIPTOR, Unknown::DESCRIPTOR, Contacts::DESCRIPTOR] {
        assert!(standard(descriptor).is_none(), "{}", descriptor.name);
    }
}

#[test]
fn all_interfaces_that_name_a_message_have_it() {
    let named: Vec<_> = all().into_iter().filter(|descriptor| !descriptor.ros.is_empty()).collect();
    assert_eq!(named.len(), 33);
    // ROS has none for contacts, bumpers, doors, gates and drivers of actuators, strokes on maps, omni wheels, facts,
    // particles and errors of sensors.
    let without: Vec<_> =
        slate_interfaces::ALL.iter().filter(|own| own.ros.is_empty()).map(|own| own.name).collect();
    assert_eq!(
        without,
        [
            "Bumper",
            "Contact",
            "Contacts",
            "DoorState",
            "DriverStatus",
            "FactHead",
            "FactTableHead",
            "GateState",
            "MapStroke",
            "OmniWheelSpeeds",
            "Particle",
            "ParticleCloud",
            "SensorAccuracy"
        ]
    );
    for descriptor in named {
        if descriptor.fields.is_empty() {
            continue;
        }
        for seed in 0..50 {
            message(descriptor, &value(descriptor, 3, seed));
        }
        let standard = standard(descriptor).unwrap();
        let mut out = Vec::new();
        assert!(standard.encode(&value(descriptor, 0, 0)[1..], 0, "", &mut out).is_err());
        assert!(out.is_empty());
    }
}

#[test]
fn room_that_is_there_is_enough() {
    for descriptor in all() {
        let Some(standard) = standard(descriptor) else { continue };
        let bytes = value(descriptor, 3, 5);
        let mut out = Vec::new();
        standard.encode(&bytes, 1, "map", &mut out).unwrap();
        let (length, place) = (out.len(), out.as_ptr());
        out.clear();
        standard.encode(&bytes, 1, "map", &mut out).unwrap();
        assert_eq!((out.len(), out.as_ptr()), (length, place), "{}", descriptor.name);
    }
}
