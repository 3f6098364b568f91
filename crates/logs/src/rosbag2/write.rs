//! Recordings as those that ROS 2 makes.

use std::io::Write;
use std::path::Path;

use slate_blackboard::interface::{Descriptor, Interface};
use slate_interfaces::Transform;
use slate_sorted::SortedMap;

use crate::output::Output;
use slate_bag::{Decoder, Error, Message, Selection, Unread, interface, whole};
use slate_ros_messages::Followed;
use slate_ros_messages::{self as ros, Definition, Frames, Shown, Standard};

/// Options of [`export_ros`].
#[derive(Clone, Copy, Debug, Default)]
pub struct RosExport<'a> {
    /// Interfaces whose messages ROS has, besides the well-known ones.
    pub interfaces: &'a [&'static Descriptor],
    /// The robots, with the topics of their poses in the map.
    /// By default, those whose true poses are recorded.
    pub robots: &'a [Followed],
    /// Topic of a robot's pose instead of these, such as `/r2/pose`.
    pub pose: Option<&'a str>,
}

/// Result of [`export_ros`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RosLog {
    /// Messages that are now those of ROS.
    pub standard: u64,
    /// Messages without a ROS counterpart, or already in ROS's format.
    /// They are unchanged but for unused fields.
    pub others: u64,
    /// Transforms in `/tf` and `/tf_static`.
    pub transforms: u64,
    /// Messages that are not CDR with a definition of ROS 2, by topic.
    pub left_out: SortedMap<String, u64>,
    /// Messages that can't be read.
    pub unread: Vec<Unread>,
}

/// Exports the selected messages of a recording as ROS 2 messages, for ROS's tools.
/// A value becomes its ROS message, such as `sensor_msgs/msg/LaserScan`; a value without a ROS message stays unchanged.
/// Frames are those of REP-105: maps, paths and poses in them are in `map`, odometry is in `odom`, and all else in
/// `base_link`; of several robots each has [its own](ros::Frames). Poses of robots in the map, and by their odometry,
/// are the transforms in `/tf`; each `Transform` that modules publish is there as well, or in `/tf_static`.
///
/// # Errors
/// When the recording is damaged, `out` can't be written, or no topic of that name has poses for the transforms.
pub fn export_ros(
    path: &Path,
    selection: &Selection,
    export: &RosExport<'_>,
    out: &Path,
) -> Result<RosLog, Error> {
    let mut reader = crate::open(path)?;
    let unfit = |what| Error::Unfit { path: path.into(), what };
    let known = slate_interfaces::ALL.iter().chain(export.interfaces).copied();
    let known: SortedMap<_, _> = known.map(|descriptor| (descriptor.hash, descriptor)).collect();
    let topics = reader.topics();
    let topics = topics.iter().filter(|own| selection.has(&own.topic));
    let mut frames = Frames::new(export.robots, topics.map(|own| (own.topic.as_str(), own.schema.as_str())));
    export.pose.map_or(Ok(()), |pose| frames.locate(pose)).map_err(unfit)?;
    let (mut latest, mut located) = (0, false);
    let mut decoder = Decoder::default();
    let mut forms: SortedMap<u16, ExportForm> = SortedMap::new();
    let mut log = RosLog::default();
    let mut data = Vec::new();
    whole::write(out, |file| {
        let mut output = Output::new(file, out)?;
        selection.visit(&mut reader, |message| {
            let (topic, time) = (&message.channel.topic, message.log_time);
            let form = forms.entry(message.channel.id).or_insert_with(|| ExportForm::of(message, &known));
            if matches!(form, ExportForm::Unknown) {
                *log.left_out.entry(topic.clone()).or_default() += 1;
                return Ok(true);
            }
            if !decoder.check(message) {
                return Ok(true);
            }
            let wrong = |error: ros::Error| unfit(format!("`{topic}`: {error}"));
            if time > latest {
                // All messages of the time before are there.
                log.transforms += write_transforms(&mut frames, latest, &mut data, &mut output)?;
            }
            latest = latest.max(time);
            data.clear();
            match form {
                ExportForm::Standard(descriptor, standard) => {
                    let value = ros::decode(descriptor, message.data).map_err(wrong)?;
                    if descriptor.hash == Transform::DESCRIPTOR.hash {
                        frames.note_transform(topic, time, decoder.decode(message).transform());
                    }
                    standard.encode(&value, time, frames.of(topic), &mut data).map_err(wrong)?;
                    output.message(topic, time, || standard.definition().clone(), &data)?;
                    log.standard += 1;
                }
                ExportForm::Shown(shown) => {
                    shown.encode(message.data, &mut data).map_err(wrong)?;
                    output.message(topic, time, || shown.definition().clone(), &data)?;
                    log.others += 1;
                }
                _ => {
                    output.message(topic, time, || own_definition(message), message.data)?;
                    log.others += 1;
                }
            }
            if frames.sources().any(|source| source == topic)
                && let Some(pose) = decoder.decode(message).pose()
            {
                located |= export.pose == Some(topic);
                frames.note(topic, time, pose);
            }
            Ok(true)
        })?;
        log.transforms += write_transforms(&mut frames, latest, &mut data, &mut output)?;
        if let (Some(topic), false) = (export.pose, located) {
            return Err(unfit(format!("the selection of its topic `{topic}` has no poses")));
        }
        output.finish()?;
        log.unread = decoder.into_unread();
        Ok(log)
    })
}

/// Treatment of the messages of a channel.
enum ExportForm {
    Standard(&'static Descriptor, Box<Standard>),
    /// Message without the fields that exist for the layout alone.
    Shown(Box<Shown>),
    Same,
    Unknown,
}

impl ExportForm {
    fn of(message: &Message<'_>, known: &SortedMap<u64, &'static Descriptor>) -> Self {
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

/// Writes the transforms that have become known until that time; returns how many.
fn write_transforms<W: Write>(
    frames: &mut Frames,
    time: u64,
    data: &mut Vec<u8>,
    output: &mut Output<W>,
) -> Result<u64, Error> {
    // Keys that distinguish the made topics from recorded ones.
    const TOPICS: [(&str, &str); 2] = [("/tf, made", "/tf"), ("/tf_static, made", "/tf_static")];
    let (moving, fixed) = frames.take();
    for (transforms, (key, topic)) in [&moving, &fixed].into_iter().zip(TOPICS) {
        if !transforms.is_empty() {
            data.clear();
            let encoded = ros::encode_transforms(transforms, data);
            encoded.map_err(|error| output.unfit(format!("`{topic}`: {error}")))?;
            output.message_of(key, topic, time, ros::transforms_definition, data)?;
        }
    }
    Ok((moving.len() + fixed.len()) as u64)
}
