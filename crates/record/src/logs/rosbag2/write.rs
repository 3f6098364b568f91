//! Recordings as those that ROS 2 makes.

use std::collections::BTreeMap;
use std::path::Path;

use slate_blackboard::interface::{Descriptor, Interface};
use slate_interfaces::Transform;
use slate_module::math;

use crate::bag::{Decoder, Error, Message, Selection, Unread, whole};
use crate::logs::output::Output;
use crate::replay::interface;
use crate::ros::{self, CdrWriter, Definition, Shown, Standard};

/// How [`export_ros`] writes.
#[derive(Clone, Copy, Debug, Default)]
pub struct RosExport<'a> {
    /// Interfaces whose messages ROS has, besides the well-known ones.
    pub interfaces: &'a [&'static Descriptor],
    /// The topic that tells where the robot is in the map, such as `/r2/pose`: its poses are the transforms from `map` to
    /// `base_link` as well, in `/tf`.
    pub pose: Option<&'a str>,
}

/// What [`export_ros`] has written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RosLog {
    /// Messages that are now those of ROS.
    pub standard: u64,
    /// Messages that are as they were, but for fields that are not used: ROS has none for them, or they were its own already.
    pub others: u64,
    /// Transforms in `/tf`.
    pub transforms: u64,
    /// Messages that are not CDR with a definition of ROS 2, by topic.
    pub left_out: BTreeMap<String, u64>,
    /// Messages that can't be read.
    pub unread: Vec<Unread>,
}

/// Writes what is selected of a recording with the messages that ROS 2 has for the values, such as `sensor_msgs/msg/LaserScan`, so
/// that its tools show them; what ROS has no message for stays as it is. Frames are those of REP-105: maps, ways and poses in them
/// are told in `map`, odometry in `odom`, and all else in `base_link`.
///
/// # Errors
/// When the recording is damaged, `out` can't be written, or no topic of that name has poses for the transforms.
pub fn export_ros(
    path: &Path,
    selection: &Selection,
    export: &RosExport<'_>,
    out: &Path,
) -> Result<RosLog, Error> {
    let mut reader = crate::logs::open(path)?;
    let unfit = |what| Error::Unfit { path: path.into(), what };
    let known = slate_interfaces::ALL.iter().chain(export.interfaces).copied();
    let known: BTreeMap<_, _> = known.map(|descriptor| (descriptor.hash, descriptor)).collect();
    let mut decoder = Decoder::default();
    let mut forms: BTreeMap<u16, Form> = BTreeMap::new();
    let mut log = RosLog::default();
    let mut data = Vec::new();
    whole::write(out, |file| {
        let mut output = Output::new(file, out)?;
        selection.visit(&mut reader, |message| {
            let (topic, time) = (&message.channel.topic, message.log_time);
            let form = forms.entry(message.channel.id).or_insert_with(|| Form::of(message, &known));
            if matches!(form, Form::Unknown) {
                *log.left_out.entry(topic.clone()).or_default() += 1;
                return Ok(true);
            }
            if !decoder.check(message) {
                return Ok(true);
            }
            let wrong = |error: ros::Error| unfit(format!("`{topic}`: {error}"));
            data.clear();
            match form {
                Form::Standard(descriptor, standard) => {
                    let value = ros::decode(descriptor, message.data).map_err(wrong)?;
                    standard.encode(&value, time, FRAME, &mut data).map_err(wrong)?;
                    output.message(topic, time, || standard.definition().clone(), &data)?;
                    log.standard += 1;
                }
                Form::Shown(shown) => {
                    shown.encode(message.data, &mut data).map_err(wrong)?;
                    output.message(topic, time, || shown.definition().clone(), &data)?;
                    log.others += 1;
                }
                _ => {
                    output.message(topic, time, || own_definition(message), message.data)?;
                    log.others += 1;
                }
            }
            if export.pose == Some(topic)
                && let Some(pose) = decoder.decode(message).pose()
            {
                transform(pose, time, &mut data).map_err(wrong)?;
                output.message_of(TRANSFORMS, "/tf", time, transforms, &data)?;
                log.transforms += 1;
            }
            Ok(true)
        })?;
        if let (Some(topic), 0) = (export.pose, log.transforms) {
            return Err(unfit(format!("what is selected of its topic `{topic}` has no poses")));
        }
        output.finish()?;
        log.unread = decoder.into_unread();
        Ok(log)
    })
}

/// What becomes of the messages of a channel.
enum Form {
    Standard(&'static Descriptor, Box<Standard>),
    /// As it was, without what is there for the layout alone.
    Shown(Box<Shown>),
    Same,
    Unknown,
}

impl Form {
    fn of(message: &Message<'_>, known: &BTreeMap<u64, &'static Descriptor>) -> Self {
        match message.schema {
            Some(schema) if schema.encoding == "ros2msg" && message.channel.message_encoding == "cdr" => {
                let descriptor = interface(message, known);
                let standard = descriptor.and_then(|own| Some((own, Box::new(ros::standard(own)?))));
                match (standard, Shown::of(&own_definition(message))) {
                    (Some((descriptor, standard)), _) => Self::Standard(descriptor, standard),
                    (None, Ok(Some(shown))) => Self::Shown(Box::new(shown)),
                    (None, _) => Self::Same,
                }
            }
            _ => Self::Unknown,
        }
    }
}

fn own_definition(message: &Message<'_>) -> Definition {
    let schema =
        message.schema.map(|schema| (schema.name.clone(), String::from_utf8_lossy(&schema.data).into()));
    let (name, text) = schema.unwrap_or_default();
    Definition { name, text }
}

/// The frame in which values are told that are neither in a map nor odometry.
const FRAME: &str = "base_link";

/// What tells the transforms that are made from those that are there.
const TRANSFORMS: &str = "/tf, made";

/// The definition of `tf2_msgs/msg/TFMessage`.
fn transforms() -> Definition {
    let one = ros::standard(Transform::DESCRIPTOR).map(|standard| standard.definition().text.clone());
    let text = format!(
        "geometry_msgs/TransformStamped[] transforms\n{}\nMSG: geometry_msgs/TransformStamped\n{}",
        ros::SEPARATOR,
        one.unwrap_or_default()
    );
    Definition { name: "tf2_msgs/msg/TFMessage".into(), text }
}

/// Where the robot is in the map, as a message with one transform.
fn transform([x, y, theta]: [f64; 3], time: u64, data: &mut Vec<u8>) -> Result<(), ros::Error> {
    data.clear();
    let mut writer = CdrWriter::new(data);
    writer.length(1);
    writer.length((time / 1_000_000_000) as u32);
    writer.length((time % 1_000_000_000) as u32);
    writer.text("map")?;
    writer.text("base_link")?;
    let half = theta / 2.0;
    for number in [x, y, 0.0, 0.0, 0.0, math::sin(half), math::cos(half)] {
        writer.numbers(&number.to_ne_bytes(), 8);
    }
    Ok(())
}
