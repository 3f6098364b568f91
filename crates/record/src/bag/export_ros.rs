use std::collections::BTreeMap;
use std::path::Path;

use slate_blackboard::interface::Descriptor;

use super::record::{Channel, Header, Schema};
use super::{Error, Message, Selection, Writer, whole};
use crate::logs::open;
use crate::ros::{self, Standard};

/// The frame in which values are told that do not say their own.
const FRAME: &str = "base_link";

/// What [`export_ros`] has written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RosExport {
    /// How many messages there are.
    pub messages: u64,
    /// The topics whose messages are those of ROS now, each with their type.
    pub topics: BTreeMap<String, String>,
}

/// The message of ROS that those of a channel become, if they become one.
type Form = Option<(&'static Descriptor, Box<Standard>)>;

/// Copies what is selected of a file, with the message that ROS [has](ros::standard) for each value of a well-known interface, for
/// tools that draw such. Messages of other types stay as they are. What says how to make a run again is left out.
///
/// # Errors
/// When the file is damaged or can't be read, `out` can't be written, or a topic is not there.
pub fn export_ros(path: &Path, selection: &Selection, out: &Path) -> Result<RosExport, Error> {
    let mut reader = open(path)?;
    let run = reader.metadata()?.into_iter().find(|metadata| metadata.name == "run");
    let epoch = run.and_then(|run| run.metadata.get("epoch_ns")?.parse().ok()).unwrap_or(0);
    let header =
        Header { profile: "ros2".into(), library: concat!("slate ", env!("CARGO_PKG_VERSION")).into() };
    let known: BTreeMap<u64, _> = slate_interfaces::ALL.iter().map(|own| (own.hash, *own)).collect();
    let mut export = RosExport::default();
    let (mut forms, mut schemas) = (BTreeMap::<u16, Form>::new(), BTreeMap::new());
    let mut bytes = Vec::new();
    whole::write(out, |file| {
        let mut writer = Writer::new(file, out, &header, super::Compression::None)?;
        selection.visit(&mut reader, |message| {
            let channel = message.channel;
            if !forms.contains_key(&channel.id) {
                let hash = channel.metadata.get("hash").and_then(|hash| u64::from_str_radix(hash, 16).ok());
                let own = hash.and_then(|hash| known.get(&hash).copied());
                let form: Form = own.and_then(|own| Some((own, Box::new(ros::standard(own)?))));
                let (schema, metadata) = match &form {
                    Some((_, standard)) => {
                        let ros::Definition { name, text } = standard.definition().clone();
                        export.topics.insert(channel.topic.clone(), name.clone());
                        let schema = Schema { id: 0, name, encoding: "ros2msg".into(), data: text.into() };
                        (Some(schema), BTreeMap::new())
                    }
                    None => (message.schema.map(|schema| Schema::clone(schema)), channel.metadata.clone()),
                };
                let mut schema_id = 0;
                if let Some(schema) = schema {
                    let key = (schema.name.clone(), schema.encoding.clone(), schema.data.clone());
                    // A file has no more schemas than channels.
                    let next = schemas.len() as u16 + 1;
                    schema_id = *schemas.entry(key).or_insert(next);
                    writer.schema(&Schema { id: schema_id, ..schema })?;
                }
                writer.channel(&Channel { schema_id, metadata, ..Channel::clone(channel) })?;
                forms.insert(channel.id, form);
            }
            let data = match forms.get(&channel.id).and_then(Option::as_ref) {
                Some((descriptor, standard)) => {
                    bytes.clear();
                    convert(message, descriptor, standard, epoch, &mut bytes).map_err(|error| {
                        Error::Unfit {
                            path: path.into(),
                            what: format!(
                                "a message of {} is no {}: {error}",
                                channel.topic, descriptor.name
                            ),
                        }
                    })?;
                    &bytes
                }
                None => message.data,
            };
            writer.message(channel.id, message.sequence, message.log_time, message.publish_time, data)?;
            export.messages += 1;
            Ok(true)
        })?;
        writer.finish()?;
        Ok(export)
    })
}

/// Appends the message of ROS. Its header has the agent's time, as values have that tell of times themselves.
fn convert(
    message: &Message<'_>,
    descriptor: &'static Descriptor,
    standard: &Standard,
    epoch: u64,
    out: &mut Vec<u8>,
) -> Result<(), ros::Error> {
    let value = ros::decode(descriptor, message.data)?;
    standard.encode(&value, message.publish_time.saturating_sub(epoch), FRAME, out)
}
