//! Properties as channels.

use std::sync::Arc;

use serde_json::{Value as Json, json};
use slate_blackboard::Access;
use slate_blackboard::interface::Descriptor;
use slate_ros_messages as ros;
use slate_ros_messages::{Definition, Shown, Standard};
use slate_sorted::{SortedMap, SortedSet};

use super::OutgoingMessage;
use slate_control::{ControlSurface, Sample, frames, is_transform};

/// Conversion of an interface's values to messages.
pub(super) enum ChannelFormat {
    /// Standard message of ROS.
    Standard(Box<Standard>),
    /// Message type derived from the interface.
    Own(&'static Descriptor, Definition),
    /// Message type derived from the interface, without its padding fields.
    Shown(&'static Descriptor, Box<Shown>),
}

impl ChannelFormat {
    /// Creates the form for an interface.
    /// `name` is that of the interface, or another one when two have it.
    fn new(descriptor: &'static Descriptor, name: &str) -> Self {
        match ros::standard(descriptor) {
            Some(standard) => Self::Standard(Box::new(standard)),
            None => {
                let definition = ros::definition_named(descriptor, name);
                match Shown::of(&definition) {
                    Ok(Some(shown)) => Self::Shown(descriptor, Box::new(shown)),
                    _ => Self::Own(descriptor, definition),
                }
            }
        }
    }

    fn definition(&self) -> &Definition {
        match self {
            Self::Standard(standard) => standard.definition(),
            Self::Own(_, definition) => definition,
            Self::Shown(_, shown) => shown.definition(),
        }
    }

    /// Appends the message of a value.
    /// `frame` is used unless the value names its own frame.
    pub fn encode(&self, sample: &Sample, frame: &str, out: &mut Vec<u8>) -> Result<(), ros::Error> {
        // Its channel declares the whole value, whatever room it has.
        let length = sample.property.descriptor().shape(sample.items).bytes(sample.items);
        let value = sample.bytes.get(..length).unwrap_or(&sample.bytes);
        match self {
            Self::Standard(standard) => standard.encode(value, sample.stamp.time, frame, out),
            Self::Own(descriptor, _) => ros::encode(descriptor, value, out),
            Self::Shown(descriptor, shown) => {
                let mut whole = Vec::new();
                ros::encode(descriptor, value, &mut whole)?;
                shown.encode(&whole, out)
            }
        }
    }
}

/// Channels advertised to a client.
#[derive(Default)]
pub(super) struct Channels {
    /// Channels by number: the path, and the form of its messages.
    present: SortedMap<u32, (String, u64, Arc<ChannelFormat>)>,
    /// Channels of the transforms: moving ones, and static ones.
    transforms: [Option<u32>; 2],
    formats: SortedMap<u64, Arc<ChannelFormat>>,
    names: SortedMap<&'static str, u32>,
    last: u32,
}

/// Topics of the transforms.
const TRANSFORM_TOPICS: [&str; 2] = ["/tf", "/tf_static"];

impl Channels {
    pub fn get(&self, number: u32) -> Option<(&str, &Arc<ChannelFormat>)> {
        self.present.get(&number).map(|(path, _, format)| (path.as_str(), format))
    }

    /// Returns whether a channel of transforms has static ones.
    /// `None` for any other channel.
    pub fn transforms(&self, number: u32) -> Option<bool> {
        self.transforms.iter().position(|own| *own == Some(number)).map(|slot| slot == 1)
    }

    /// Returns the newly known transforms, as channels.
    fn new_transforms(&mut self, surface: &ControlSurface) -> Vec<Json> {
        let mut properties = surface.board().properties().into_iter();
        let has_transforms = properties.any(|property| is_transform(&property));
        let has_places = || frames(surface, |_| true).has_places();
        let mut added = Vec::new();
        for (slot, topic) in TRANSFORM_TOPICS.into_iter().enumerate() {
            if self.transforms[slot].is_some() || !(has_transforms || slot == 0 && has_places()) {
                continue;
            }
            self.last += 1;
            self.transforms[slot] = Some(self.last);
            let definition = ros::transforms_definition();
            added.push(advertised(self.last, topic, &definition));
        }
        added
    }

    /// Tells of channels that came, and that went.
    pub fn survey(&mut self, surface: &ControlSurface) -> Vec<OutgoingMessage> {
        let properties = surface.board().properties();
        let values = properties.iter().filter(|property| property.access() != Access::Messages);
        let current: SortedMap<&str, &'static Descriptor> =
            values.map(|property| (property.path(), property.descriptor())).collect();
        let is_vanished =
            |(path, hash): (&String, u64)| current.get(path.as_str()).is_none_or(|of| of.hash != hash);
        let vanished: Vec<u32> = self
            .present
            .iter()
            .filter(|(_, (path, hash, _))| is_vanished((path, *hash)))
            .map(|(number, _)| *number)
            .collect();
        vanished.iter().for_each(|number| drop(self.present.remove(number)));
        let known: SortedSet<String> = self.present.values().map(|(path, ..)| path.clone()).collect();
        let mut added = self.new_transforms(surface);
        for (path, descriptor) in current.into_iter().filter(|(path, _)| !known.contains(*path)) {
            let format = self.format(descriptor);
            self.last += 1;
            added.push(advertised(self.last, &format!("/{path}"), format.definition()));
            self.present.insert(self.last, (path.to_owned(), descriptor.hash, format));
        }
        let mut out = Vec::new();
        if !vanished.is_empty() {
            out.push(OutgoingMessage::Text(
                json!({ "op": "unadvertise", "channelIds": vanished }).to_string(),
            ));
        }
        if !added.is_empty() {
            out.push(OutgoingMessage::Text(json!({ "op": "advertise", "channels": added }).to_string()));
        }
        out
    }

    fn format(&mut self, descriptor: &'static Descriptor) -> Arc<ChannelFormat> {
        if let Some(format) = self.formats.get(&descriptor.hash) {
            return Arc::clone(format);
        }
        // To clients all messages of a name are the same.
        let count = self.names.entry(descriptor.name).or_default();
        *count += 1;
        let name =
            if *count == 1 { descriptor.name.to_owned() } else { format!("{}{count}", descriptor.name) };
        let format = Arc::new(ChannelFormat::new(descriptor, &name));
        self.formats.insert(descriptor.hash, Arc::clone(&format));
        format
    }

    /// Returns the graph of publishing and reading modules.
    pub fn graph(&self, surface: &ControlSurface) -> Json {
        let composer = surface.agent.composer();
        let modules: Vec<String> = composer.modules().into_iter().map(|module| module.name).collect();
        let owner = |path: &str| {
            let own = modules.iter().filter(|module| path.starts_with(&format!("{module}/")));
            own.max_by_key(|module| module.len()).cloned()
        };
        let published: Vec<_> = self
            .present
            .values()
            .map(|(path, ..)| json!({ "name": format!("/{path}"), "publisherIds": owner(path).into_iter().collect::<Vec<_>>() }))
            .collect();
        let mut readers: SortedMap<String, SortedSet<String>> = SortedMap::new();
        for link in composer.links().into_iter().filter(|link| !link.sends && !link.external) {
            let of_property = surface.board().find(link.from.trim_start_matches('/')).ok();
            let topic =
                of_property.map_or(link.from.clone(), |(property, _)| format!("/{}", property.path()));
            readers.entry(topic).or_default().extend(owner(&link.to));
        }
        let subscribed: Vec<_> =
            readers.into_iter().map(|(name, ids)| json!({ "name": name, "subscriberIds": ids })).collect();
        json!({ "publishedTopics": published, "subscribedTopics": subscribed, "advertisedServices": [] })
    }
}

fn advertised(number: u32, topic: &str, definition: &Definition) -> Json {
    json!({
        "id": number,
        "topic": topic,
        "encoding": "cdr",
        "schemaName": definition.name,
        "schemaEncoding": "ros2msg",
        "schema": definition.text,
    })
}

/// Returns the topics of one graph that are missing in a later one.
pub(super) fn removed(before: Option<&Json>, after: &Json) -> Json {
    let names = |graph: &Json| -> SortedSet<String> {
        let lists =
            ["publishedTopics", "subscribedTopics"].into_iter().filter_map(|list| graph[list].as_array());
        lists.flatten().filter_map(|topic| topic["name"].as_str().map(ToOwned::to_owned)).collect()
    };
    let after = names(after);
    before.map(names).unwrap_or_default().into_iter().filter(|name| !after.contains(name)).collect()
}
