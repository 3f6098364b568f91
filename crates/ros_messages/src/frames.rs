//! Coordinate frames of robots, and the transforms between them (ROS's REP-105).

use slate_blackboard::interface::Interface;
use slate_interfaces::Transform;
use slate_module::math::{cos, sin};
use slate_sorted::{SortedMap, SortedSet};

use super::names::{MAP, own_frame};
use super::{CdrWriter, Definition, Error, SEPARATOR, WireFormat, standard_in};
use crate::followed::Followed;

const ODOMETRY_FRAME: &str = "odom";
const BASE_FRAME: &str = "base_link";

/// The frames of the robots of an agent.
///
/// One robot has `odom` and `base_link`; of several, each has its own: `r1/odom` and `r1/base_link`. Values that belong
/// to none of several are in `map`, which they have in common.
#[derive(Clone, Debug)]
pub struct Frames {
    robots: Vec<RobotFrames>,
    /// Transforms published since the last call, and all frames ever published.
    moving: Vec<FrameTransform>,
    fixed: Vec<FrameTransform>,
    published: SortedSet<String>,
    /// Frames of mounted sensors, by topic.
    mounted: SortedMap<String, String>,
}

/// Suffix of the topic of a sensor's mounting [`Transform`].
/// It follows the sensor's own topic. The sensor's frame is named as the last part of its topic.
const MOUNT_SUFFIX: &str = "_mount";

/// The end of the topic of a camera's calibration, behind that of its images.
const INFO_SUFFIX: &str = "_info";

#[derive(Clone, Debug, Default)]
struct RobotFrames {
    /// Empty for the only one.
    name: String,
    base: String,
    odom: String,
    /// Topic of its pose in the map, and the last pose on it.
    pose: Option<String>,
    map_pose: Option<TimedPose>,
    /// Topic of its odometry, and the last pose on it.
    odometry: Option<String>,
    odometry_pose: Option<TimedPose>,
    /// Time since which only its pose in the map is known.
    waits_since: Option<u64>,
}

/// Time to wait for odometry before a robot is published without it, nanoseconds.
const ODOMETRY_TIMEOUT: u64 = 1_000_000_000;

#[derive(Clone, Copy, Debug)]
struct TimedPose {
    time: u64,
    pose: [f64; 3],
    is_new: bool,
}

/// Pose of a frame in its parent.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameTransform {
    /// Time, nanoseconds.
    pub time: u64,
    /// Name of the parent frame.
    pub parent: String,
    /// Name of the child frame.
    pub child: String,
    /// x, y and z, meters.
    pub translation: [f64; 3],
    /// Rotation as a unit quaternion: x, y, z and w.
    pub rotation: [f64; 4],
}

/// [`Transform`] of a module, with the module's own names of frames.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedTransform {
    /// Name of the parent frame.
    pub parent: String,
    /// Name of the child frame.
    pub child: String,
    /// x, y and z, meters.
    pub translation: [f64; 3],
    /// Rotation as a unit quaternion: x, y, z and w.
    pub rotation: [f64; 4],
    /// Set if the transform never changes.
    pub is_fixed: bool,
}

impl RobotFrames {
    fn new(name: &str, pose: Option<String>) -> Self {
        Self {
            name: name.into(),
            base: joined(name, BASE_FRAME),
            odom: joined(name, ODOMETRY_FRAME),
            pose,
            ..Self::default()
        }
    }
}

fn joined(robot: &str, frame: &str) -> String {
    if robot.is_empty() { frame.into() } else { format!("{robot}/{frame}") }
}

impl Frames {
    /// Creates the frames of the robots that a configuration names.
    /// Without any, they are those of robots whose true poses are among the topics; each topic is given with the name
    /// of its type.
    pub fn new<'a>(followed: &[Followed], topics: impl Iterator<Item = (&'a str, &'a str)> + Clone) -> Self {
        let truths = topics.clone().filter_map(|(topic, kind)| {
            let path = topic.strip_suffix("/truth").filter(|_| kind == "slate_msgs/msg/Pose2")?;
            Some((path.rsplit('/').next()?.to_owned(), topic.to_owned()))
        });
        let named = followed.iter().map(|robot| (robot.name.clone(), robot.pose.clone()));
        let mut all: Vec<_> = if followed.is_empty() { truths.collect() } else { named.collect() };
        all.sort();
        all.dedup_by(|one, other| one.0 == other.0);
        let robots = match all.len() {
            0 | 1 => vec![RobotFrames::new("", all.pop().map(|(_, pose)| pose))],
            _ => all.into_iter().map(|(name, pose)| RobotFrames::new(&name, Some(pose))).collect(),
        };
        let mut frames = Self {
            robots,
            moving: Vec::new(),
            fixed: Vec::new(),
            published: SortedSet::new(),
            mounted: SortedMap::new(),
        };
        for (topic, _) in topics.clone().filter(|(_, kind)| *kind == "slate_msgs/msg/Transform") {
            let Some(sensor) = topic.strip_suffix(MOUNT_SUFFIX) else { continue };
            let Some(robot) = frames.owner(topic).and_then(|at| frames.robots.get(at)) else { continue };
            let frame = joined(&robot.name, sensor.rsplit('/').next().unwrap_or_default());
            frames.mounted.insert(sensor.to_owned(), frame);
        }
        for (topic, _) in topics.filter(|(_, kind)| *kind == "slate_msgs/msg/Odometry") {
            let Some(robot) = frames.owner(topic).and_then(|at| frames.robots.get_mut(at)) else { continue };
            // That beside the place goes before others.
            let folder = |topic: &str| topic.rsplit_once('/').map(|(folder, _)| folder.to_owned());
            let beside = |topic: &str| robot.pose.as_deref().and_then(folder) == folder(topic);
            let rank = |topic: &str| (!beside(topic), topic.to_owned());
            if robot.odometry.as_deref().is_none_or(|known| rank(topic) < rank(known)) {
                robot.odometry = Some(topic.into());
            }
        }
        frames
    }

    /// Sets a topic as the source of its robot's pose in the map.
    ///
    /// # Errors
    /// When it belongs to none of them.
    pub fn locate(&mut self, topic: &str) -> Result<(), String> {
        let owner = self.owner(topic);
        let Some(robot) = owner.and_then(|at| self.robots.get_mut(at)) else {
            let names: Vec<_> = self.robots.iter().map(|robot| robot.name.as_str()).collect();
            return Err(format!("its topic `{topic}` names none of its robots: {}", names.join(", ")));
        };
        robot.pose = Some(topic.into());
        Ok(())
    }

    /// Returns the robot that a topic belongs to: of several, the first that it names.
    fn owner(&self, topic: &str) -> Option<usize> {
        let index = |part: &str| self.robots.iter().position(|robot| robot.name == part);
        if self.robots.len() > 1 { topic.split('/').find_map(index) } else { Some(0) }
    }

    /// Returns the frame of a topic's values that do not name their own.
    pub fn of(&self, topic: &str) -> &str {
        // Camera information is in the frame of its camera.
        if let Some(frame) = self.mounted.get(topic.strip_suffix(INFO_SUFFIX).unwrap_or(topic)) {
            return frame;
        }
        let robot = self.owner(topic).and_then(|at| self.robots.get(at));
        robot.map_or(MAP, |robot| &robot.base)
    }

    /// Returns the topics of robots' poses, in a map or by odometry.
    pub fn sources(&self) -> impl Iterator<Item = &str> {
        self.robots.iter().flat_map(|robot| [robot.pose.as_deref(), robot.odometry.as_deref()]).flatten()
    }

    /// Returns true if the pose in the map of any robot is known.
    pub fn has_places(&self) -> bool {
        self.robots.iter().any(|robot| robot.pose.is_some())
    }

    /// Notes the pose of a topic.
    pub fn note(&mut self, topic: &str, time: u64, pose: [f64; 3]) {
        let timed = TimedPose { time, pose, is_new: true };
        for robot in &mut self.robots {
            if robot.pose.as_deref() == Some(topic) {
                robot.map_pose = Some(timed);
            }
            if robot.odometry.as_deref() == Some(topic) {
                robot.odometry_pose = Some(timed);
            }
        }
    }

    /// Notes a [`Transform`] that a module publishes.
    pub fn note_transform(&mut self, topic: &str, time: u64, published: PublishedTransform) {
        let robot = self.owner(topic).and_then(|at| self.robots.get(at)).map_or("", |robot| &robot.name);
        let PublishedTransform { parent, child, translation, rotation, is_fixed } = published;
        let [parent, child] = [parent, child].map(|name| own_frame(robot, &name).concat());
        let transform = FrameTransform { time, parent, child, translation, rotation };
        self.published.insert(transform.child.clone());
        if is_fixed { &mut self.fixed } else { &mut self.moving }.push(transform);
    }

    /// Returns the transforms known since the last call: moving and fixed ones.
    /// A frame has one parent: the one that a module publishes, or else the one of REP-105.
    pub fn take(&mut self) -> (Vec<FrameTransform>, Vec<FrameTransform>) {
        let (mut moving, fixed) = (std::mem::take(&mut self.moving), std::mem::take(&mut self.fixed));
        for robot in &mut self.robots {
            let mut publish = |timed: &TimedPose, parent: &str, child: &str, pose: [f64; 3]| {
                if !self.published.contains(child) {
                    moving.push(in_plane(timed.time, parent, child, pose));
                }
            };
            if let Some(odometry_pose) =
                robot.odometry_pose.as_mut().filter(|odometry_pose| odometry_pose.is_new)
            {
                publish(odometry_pose, &robot.odom, &robot.base, odometry_pose.pose);
                odometry_pose.is_new = false;
            }
            let Some(timed) = robot.map_pose.as_mut().filter(|timed| timed.is_new) else { continue };
            let since = *robot.waits_since.get_or_insert(timed.time);
            if robot.odometry.is_some() && robot.odometry_pose.is_none() {
                if timed.time.saturating_sub(since) < ODOMETRY_TIMEOUT {
                    continue;
                }
                robot.odometry = None;
            }
            match &robot.odometry_pose {
                Some(odometry_pose) => {
                    publish(timed, MAP, &robot.odom, origin(timed.pose, odometry_pose.pose))
                }
                None => publish(timed, MAP, &robot.base, timed.pose),
            }
            timed.is_new = false;
        }
        (moving, fixed)
    }
}

/// Returns the origin of odometry in the map, from a robot's pose in either frame.
fn origin([x, y, theta]: [f64; 3], [along, across, turned]: [f64; 3]) -> [f64; 3] {
    let turn = theta - turned;
    let (sine, cosine) = (sin(turn), cos(turn));
    [x - (cosine * along - sine * across), y - (sine * along + cosine * across), turn]
}

fn in_plane(time: u64, parent: &str, child: &str, [x, y, theta]: [f64; 3]) -> FrameTransform {
    FrameTransform {
        time,
        parent: parent.into(),
        child: child.into(),
        translation: [x, y, 0.0],
        rotation: [0.0, 0.0, sin(theta / 2.0), cos(theta / 2.0)],
    }
}

/// Returns the definition of `tf2_msgs/msg/TFMessage`.
pub fn transforms_definition() -> Definition {
    transforms_definition_in(WireFormat::Cdr)
}

/// Returns the definition of the transforms' message in the ROS of a format.
pub fn transforms_definition_in(format: WireFormat) -> Definition {
    let one = standard_in(format, Transform::DESCRIPTOR).map(|standard| standard.definition().text.clone());
    let text = format!(
        "geometry_msgs/TransformStamped[] transforms\n{SEPARATOR}\nMSG: geometry_msgs/TransformStamped\n{}",
        one.unwrap_or_default()
    );
    let name = if format == WireFormat::Ros1 { "tf2_msgs/TFMessage" } else { "tf2_msgs/msg/TFMessage" };
    Definition { name: name.into(), text }
}

/// Appends transforms as such a message.
///
/// # Errors
/// When they are more than a message can have.
pub fn encode_transforms(transforms: &[FrameTransform], out: &mut Vec<u8>) -> Result<(), Error> {
    encode_transforms_in(WireFormat::Cdr, transforms, out)
}

/// Encodes transforms as a message of that format.
///
/// # Errors
/// When they are more than a message can have.
pub fn encode_transforms_in(
    format: WireFormat,
    transforms: &[FrameTransform],
    out: &mut Vec<u8>,
) -> Result<(), Error> {
    let mut writer = CdrWriter::of(format, out);
    writer.length(super::cdr::wire_length(transforms.len())?);
    for FrameTransform { time, parent, child, translation, rotation } in transforms {
        if format == WireFormat::Ros1 {
            // Number of the header, which ROS 1 itself no longer counts.
            writer.length(0);
        }
        writer.length((time / 1_000_000_000) as u32);
        writer.length((time % 1_000_000_000) as u32);
        writer.text(parent)?;
        writer.text(child)?;
        for number in translation.iter().chain(rotation) {
            writer.numbers(&number.to_ne_bytes(), 8);
        }
    }
    Ok(())
}
