//! Publication of an agent's properties.

use std::sync::Arc;

use slate_blackboard::{Event, Observer, Pattern, Property, Stamp, Watching};
use slate_module::Level;
use slate_ros_messages as ros;
use slate_sorted::SortedMap;
use zenoh::bytes::Encoding;

use crate::error::NetworkError;
use crate::key::property_key;
use crate::options::ReadMode;
use crate::payload::encoding;
use crate::publisher::{ValuePublisher, unpadded};
use crate::shared::NetworkShared;

/// Maximum number of queued property events.
/// When more come, all properties are looked at.
const MAX_EVENTS: usize = 256;

/// Properties that others may read, each with its publisher.
/// It belongs to the network's thread.
pub struct Publishing {
    shared: Arc<NetworkShared>,
    exports: SortedMap<String, PublishedProperty>,
    /// Outputs at the keys that links name, by the paths of their properties.
    outputs: Vec<(String, PublishedProperty)>,
    observer: Observer,
    missed: u64,
}

struct PublishedProperty {
    /// Publisher, kept after the property is removed.
    /// Zenoh drops a query for a key whose publisher is undeclared at that moment, and the query would time out.
    publisher: ValuePublisher,
    /// Property, while it exists.
    present: Option<PresentProperty>,
}

struct PresentProperty {
    property: Arc<Property>,
    encoding: Encoding,
    /// Watch while the property has readers, so that debug outputs are computed.
    watching: Option<Watching>,
    /// Number of the value that was sent last.
    sent: u64,
    /// Logged failure: values can't be sent.
    is_error_logged: bool,
}

impl Publishing {
    /// Declares a publisher for each property that others may read.
    ///
    /// # Errors
    /// When Zenoh refuses one.
    pub fn new(shared: Arc<NetworkShared>) -> Result<Self, NetworkError> {
        let all = Pattern::parse("**").map_err(|error| NetworkError::Session(error.to_string()))?;
        let observer = shared.board().observe(&all, MAX_EVENTS, Some(Arc::clone(&shared.wake)));
        let outputs = shared.settings.write.iter().map(|output| {
            let export = PublishedProperty::new(&shared, output.key.clone())?;
            Ok((output.property.clone(), export))
        });
        let outputs = outputs.collect::<Result<_, NetworkError>>()?;
        let mut publishing = Self { shared, exports: SortedMap::new(), outputs, observer, missed: 0 };
        publishing.refresh()?;
        Ok(publishing)
    }

    /// Follows properties that have come and gone.
    pub fn follow(&mut self) {
        let is_other = |event: &Event| matches!(event, Event::Appeared(_) | Event::Vanished(_));
        let mut changed = false;
        for event in &mut self.observer {
            changed |= is_other(&event);
        }
        let missed = self.observer.missed();
        changed |= std::mem::replace(&mut self.missed, missed) != missed;
        if changed && let Err(error) = self.refresh() {
            self.shared.log(Level::Warn, &error.to_string());
        }
    }

    fn refresh(&mut self) -> Result<(), NetworkError> {
        let published: SortedMap<_, _> =
            self.shared.published().map(|property| (property.path().to_owned(), property)).collect();
        for (path, export) in &mut self.exports {
            export.follow(published.get(path));
        }
        for (path, property) in &published {
            if !self.exports.contains_key(path) {
                let key = property_key(self.shared.board().agent(), path);
                let mut export = PublishedProperty::new(&self.shared, key)?;
                export.follow(Some(property));
                self.exports.insert(path.clone(), export);
            }
        }
        for (path, export) in &mut self.outputs {
            let found = self.shared.board().get(path).filter(|(_, field)| field.is_empty());
            export.follow(found.map(|(property, _)| property).as_ref());
        }
        Ok(())
    }

    /// Sends the newest values that have readers and were not sent.
    pub fn send(&mut self) {
        let outputs = self.outputs.iter_mut().map(|(path, export)| (&*path, export));
        for (path, export) in self.exports.iter_mut().chain(outputs) {
            if let Err(reason) = export.send()
                && let Some(present) = &mut export.present
                && !std::mem::replace(&mut present.is_error_logged, true)
            {
                self.shared.log(Level::Warn, &format!("/{path} is not published: {reason}"));
            }
        }
    }
}

impl PublishedProperty {
    fn new(shared: &NetworkShared, key: String) -> Result<Self, NetworkError> {
        let publisher = ValuePublisher::new(&shared.session, (key, 0), ReadMode::default(), &shared.wake)?;
        Ok(Self { publisher, present: None })
    }

    /// Switches to the present property, which may be another one.
    fn follow(&mut self, property: Option<&Arc<Property>>) {
        let known = self.present.as_ref().map(|present| &present.property);
        let is_same = match (known, property) {
            (Some(known), Some(property)) => Arc::ptr_eq(known, property),
            (None, None) => true,
            _ => false,
        };
        if !is_same {
            self.present = property.map(|property| PresentProperty {
                property: Arc::clone(property),
                encoding: Encoding::from(encoding(property.descriptor())),
                watching: None,
                sent: 0,
                is_error_logged: false,
            });
        }
    }

    fn send(&mut self) -> Result<(), String> {
        let Some(present) = &mut self.present else { return Ok(()) };
        if !self.publisher.is_read() {
            // The next subscriber receives the newest value at once.
            (present.watching, present.sent) = (None, 0);
            return Ok(());
        }
        present.watching.get_or_insert_with(|| present.property.watch());
        if present.property.channel().is_none_or(|channel| channel.published() == present.sent) {
            return Ok(());
        }
        let newest = present.property.newest().map_err(|error| error.to_string())?;
        let Some((bytes, items, stamp)) = newest else { return Ok(()) };
        present.sent = stamp.sequence;
        self.publisher.put(present.property.descriptor(), &present.encoding, (&bytes, items, stamp))
    }
}

/// Appends a property's newest value as CDR; `None` before the first write.
pub fn newest(property: &Property, message: &mut Vec<u8>) -> Result<Option<Stamp>, String> {
    let Some((bytes, items, stamp)) = property.newest().map_err(|error| error.to_string())? else {
        return Ok(None);
    };
    let value = unpadded(property.descriptor(), &bytes, items);
    ros::encode(property.descriptor(), value, message).map_err(|error| error.to_string())?;
    Ok(Some(stamp))
}
