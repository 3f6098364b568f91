//! Treatment of the channels of a recording that is played.

use slate_blackboard::Url;
use slate_blackboard::interface::Descriptor;
use slate_module::Level;
use slate_sorted::SortedMap;

use super::choice::Choice;
use super::form::ValueForm;
use super::track::{LogLine, Mailbox, PropertyTrack};
use slate_bag::Message;
use slate_record::CHANGE_TOPIC;
use slate_ros_messages as ros;

/// The topic and the type of a recorded log.
const LOG_SCHEMA: (&str, &str) = ("/log", "rcl_interfaces/msg/Log");

/// Treatment of a channel of the file.
pub(super) enum ChannelTreatment {
    Played {
        track: usize,
        is_setting: bool,
    },
    /// Message to a mailbox, of the sender with that number.
    Sent(usize, u32),
    Log(ros::Schema),
    Changes,
    LeftOut,
}

/// Determines the treatment of the messages to a mailbox.
/// The error says why they are left out.
fn messages(
    mailboxes: &mut Vec<Mailbox>,
    message: &Message<'_>,
    known: &SortedMap<u64, &'static Descriptor>,
) -> Result<ChannelTreatment, String> {
    let path = message.channel.topic.trim_start_matches('/');
    let sender = message.channel.metadata.get("sender").and_then(|sender| sender.parse().ok());
    let sender = sender.ok_or("its channel has no sender number")?;
    let index = match mailboxes.iter().position(|mailbox| mailbox.path == path) {
        Some(index) => index,
        None => {
            let form = ValueForm::of(message, known)?;
            mailboxes.push(Mailbox { path: path.into(), form, senders: 0, from: SortedMap::new() });
            mailboxes.len() - 1
        }
    };
    let from = message.channel.metadata.get("from").map(|from| from.trim_start_matches('/').to_owned());
    mailboxes[index].from.extend(from.map(|from| (sender, from)));
    Ok(ChannelTreatment::Sent(index, sender))
}

/// Determines the treatment of a message's channel.
/// The error says why it is left out, unless that is obvious.
pub(super) fn treatment(
    tracks: &mut Vec<PropertyTrack>,
    mailboxes: &mut Vec<Mailbox>,
    message: &Message<'_>,
    is_chosen: bool,
    choice: &Choice,
    known: &SortedMap<u64, &'static Descriptor>,
) -> Result<ChannelTreatment, Option<String>> {
    let topic = &message.channel.topic;
    if *topic == CHANGE_TOPIC.name {
        return Ok(ChannelTreatment::Changes);
    }
    if !is_chosen {
        return Err(None);
    }
    if message.channel.metadata.get("access").is_some_and(|access| access == "messages") {
        return messages(mailboxes, message, known).map_err(Some);
    }
    let schema = message.schema.filter(|schema| *topic == LOG_SCHEMA.0 && schema.name == LOG_SCHEMA.1);
    if let Some(schema) = schema {
        let text = std::str::from_utf8(&schema.data).unwrap_or_default();
        return ros::Schema::parse(&schema.name, text)
            .map(ChannelTreatment::Log)
            .map_err(|error| Some(error.to_string()));
    }
    let path = choice.map.get(topic).unwrap_or(topic).trim_start_matches('/');
    // An agent that plays tells these of itself.
    if ["loop", "log", "record"].iter().any(|own| slate_blackboard::is_within(path, own)) {
        return Err(None);
    }
    if let Err(error) = Url::parse(&format!("/{path}")) {
        return Err(Some(format!("{error}: play it elsewhere with --map '{topic}=/a/path'")));
    }
    let form = ValueForm::of(message, known).map_err(Some)?;
    let metadata = |key: &str| message.channel.metadata.get(key).cloned();
    let (origin, access) = (metadata("hash"), metadata("access").unwrap_or_default());
    let is_setting = access == "setting";
    let is_compared = metadata("repeats").is_some_and(|repeats| repeats == "true") && access == "output";
    // An input that is set at times and filled by links at others is one property.
    let is_other_half = |track: &PropertyTrack| {
        track.topic == *topic
            && track.origin.is_some()
            && track.origin == origin
            && !track.accesses.contains(&access)
    };
    if let Some(index) = tracks.iter().position(is_other_half) {
        let track = &mut tracks[index];
        track.accesses.insert(access);
        track.is_compared |= is_compared;
        return Ok(ChannelTreatment::Played { track: index, is_setting });
    }
    tracks.push(PropertyTrack {
        topic: topic.clone(),
        path: path.into(),
        form,
        is_compared,
        origin,
        accesses: [access].into(),
        is_on_loop: false,
        is_counted: true,
        last_sequence: 0,
        latest: 0,
        backwards: 0,
        values: Vec::new(),
    });
    // The format has no more channels than that.
    Ok(ChannelTreatment::Played { track: tracks.len() - 1, is_setting })
}

/// Checks that each property has one writer.
pub(super) fn check_writers(tracks: &[PropertyTrack]) -> Result<(), String> {
    let mut indices: SortedMap<&str, &PropertyTrack> = SortedMap::new();
    for track in tracks {
        let Some(other) = indices.insert(&track.path, track) else { continue };
        let what = match other.topic == track.topic {
            true => format!("{} has two writers in it, as after a merge of two recordings", track.topic),
            false => format!("{} and {} are both to be played at /{}", other.topic, track.topic, track.path),
        };
        return Err(format!(
            "{what}, and a property has one: play another part of it with --select or --exclude, elsewhere with --map, or \
             filter the files before they are merged"
        ));
    }
    Ok(())
}

pub(super) fn log_line(line: &ros::Value, time: u64) -> Option<LogLine> {
    let level = match line.get("level")?.as_integer()? {
        40.. => Level::Error,
        30.. => Level::Warn,
        20.. => Level::Info,
        _ => Level::Debug,
    };
    let text = |name| Some(line.get(name)?.as_str()?.to_owned());
    Some(LogLine { time, level, module: text("name")?, text: text("msg")? })
}
