mod address_space;
mod error;
mod events;
mod pattern;
mod property;

use std::ops::{Deref, DerefMut};
use std::sync::{Arc, OnceLock, PoisonError};

pub use address_space::{AddressEntry, AddressSpace};
pub use error::BoardError;
pub use events::{Event, Observer, SettingsCounter};
pub use pattern::{Pattern, PatternError};
pub use property::{Access, Carrier, Property, Setter, Watch, Watchers, Watching};

use crate::channel::{Budget, Channel, StampedValue, ValueMemory};
use crate::interface::{Descriptor, FieldPath, Value, View, find};
use crate::message::{Mailbox, Tap};
use crate::sync::RwLock;
use crate::wake::Wake;
use crate::{Stamp, Url};
use events::{EventSource, Observers};

/// The address space of an agent: properties by path.
///
/// It is consulted to link or inspect, never to write or read a value: writers and readers hold handles.
#[derive(Debug)]
pub struct Board {
    agent: String,
    entries: RwLock<BoardEntries>,
    observers: Arc<Observers>,
    taps: TapsCell,
}

/// Assignment of observers to the values of properties.
pub trait Taps: Send + Sync {
    /// Returns the observer of every value of a property; `None` if it has none.
    /// Called once, before the first value.
    fn tap(&self, property: &Property) -> Option<Arc<dyn Tap>>;
}

#[derive(Default)]
struct TapsCell(OnceLock<Arc<dyn Taps>>);

impl std::fmt::Debug for TapsCell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Tappers")
    }
}

type BoardEntries = AddressSpace<Arc<Property>>;

/// Entry to be put at a path.
#[derive(Clone, Debug)]
pub enum Placement {
    /// A property that was made by [`Board::new_channel`], at its own path.
    Property(Arc<Property>),
    /// Another name: a linked input.
    Alias {
        /// The name.
        path: String,
        /// The path that it leads to.
        target: String,
    },
}

/// Capacity of a property with values.
#[derive(Clone, Copy, Debug)]
pub struct Store {
    /// Room in the tail, for interfaces with one.
    pub capacity: usize,
    /// Number of values kept.
    pub depth: usize,
    /// Number of readers served.
    pub budget: Budget,
}

impl Board {
    /// Creates the address space of that agent.
    pub fn new(agent: &str) -> Self {
        Self {
            agent: agent.into(),
            entries: RwLock::new(BoardEntries::default()),
            observers: Arc::new(Observers::new()),
            taps: TapsCell::default(),
        }
    }

    /// Returns the agent's name.
    pub fn agent(&self) -> &str {
        &self.agent
    }

    /// Consults `taps` about each property with values that is created from now on.
    /// Only the first call has an effect.
    pub fn tap_with(&self, taps: Arc<dyn Taps>) {
        // As with the tap of a channel.
        let _ = self.taps.0.set(taps);
    }

    fn entries(&self) -> impl Deref<Target = BoardEntries> {
        self.entries.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn entries_mut(&self) -> impl DerefMut<Target = BoardEntries> {
        self.entries.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a property that has values.
    ///
    /// # Errors
    /// When the path is taken, or a setting's memory can't be had.
    pub fn add_channel(
        &self,
        path: &str,
        doc: &str,
        descriptor: &'static Descriptor,
        store: Store,
        access: Access,
    ) -> Result<Arc<Property>, BoardError> {
        self.add_channel_in(path, doc, descriptor, store, access, None)
    }

    /// Adds a property as [`add_channel`](Board::add_channel), with values in `memory`.
    ///
    /// # Errors
    /// As [`add_channel`](Board::add_channel).
    pub fn add_channel_in(
        &self,
        path: &str,
        doc: &str,
        descriptor: &'static Descriptor,
        store: Store,
        access: Access,
        memory: Option<Arc<dyn ValueMemory>>,
    ) -> Result<Arc<Property>, BoardError> {
        let property = self.new_channel(path, doc, descriptor, store, access, memory)?;
        self.tap(&property);
        self.add(property)
    }

    /// Creates a property as [`add_channel_in`](Board::add_channel_in), off the board.
    /// It can't be found before it is [placed](Board::place), and its values are not observed before it is
    /// [tapped](Board::tap).
    ///
    /// # Errors
    /// When a setting's memory can't be had.
    pub fn new_channel(
        &self,
        path: &str,
        doc: &str,
        descriptor: &'static Descriptor,
        store: Store,
        access: Access,
        memory: Option<Arc<dyn ValueMemory>>,
    ) -> Result<Arc<Property>, BoardError> {
        let shape = descriptor.shape(store.capacity);
        let channel = Channel::new_in(shape, store.depth, store.budget, memory);
        let link_error = |error| BoardError::Link { url: format!("/{path}"), error };
        let setter = match access {
            Access::Setting => Some(channel.writer().map_err(link_error)?),
            Access::Output | Access::Messages => None,
        };
        let source = self.source(path);
        let events = Arc::clone(&source);
        channel.set_hook(move |link| events.link(link));
        let carrier = Carrier::Channel(Arc::clone(&channel));
        Ok(Arc::new(Property::new(source, doc, descriptor, access, carrier, setter)))
    }

    /// Taps a property of [`new_channel`](Board::new_channel), from its first write on.
    /// A property that is made on trial stays untapped, so a recorder never hears of it.
    pub fn tap(&self, property: &Property) {
        if let Carrier::Channel(channel) = property.carrier()
            && let Some(tap) = self.taps.0.get().and_then(|taps| taps.tap(property))
        {
            channel.set_tap(tap);
        }
    }

    /// Puts properties and aliases at their paths, all at once.
    /// They replace the present entries, which are removed as with [`remove`](Board::remove).
    pub fn place(&self, placements: Vec<Placement>) {
        let mut gone = Vec::new();
        let mut entries = self.entries_mut();
        for placement in placements {
            let (path, entry) = match placement {
                Placement::Property(property) => {
                    (property.path().to_owned(), AddressEntry::Property(property))
                }
                Placement::Alias { path, target } => (path, AddressEntry::Alias(target)),
            };
            if let Some(AddressEntry::Property(old)) = entries.entry(&path) {
                old.source().vanish();
                gone.push(Arc::clone(old));
            }
            if let AddressEntry::Property(new) = &entry {
                new.source().appear();
            }
            entries.place(path, entry);
        }
        // Their last owner drops handles, which must not happen under the lock.
        drop(entries);
    }

    /// Adds a property that receives messages.
    ///
    /// # Errors
    /// When the path is taken.
    pub fn add_mailbox(
        &self,
        path: &str,
        doc: &str,
        descriptor: &'static Descriptor,
        mailbox: Arc<Mailbox>,
    ) -> Result<Arc<Property>, BoardError> {
        let carrier = Carrier::Mailbox(Arc::clone(&mailbox));
        let source = self.source(path);
        let property = Property::new(source, doc, descriptor, Access::Messages, carrier, None);
        if let Some(tap) = self.taps.0.get().and_then(|taps| taps.tap(&property)) {
            mailbox.set_tap(tap);
        }
        self.add(Arc::new(property))
    }

    fn source(&self, path: &str) -> Arc<EventSource> {
        Arc::new(EventSource::new(path, Arc::clone(&self.observers)))
    }

    fn add(&self, property: Arc<Property>) -> Result<Arc<Property>, BoardError> {
        let mut entries = self.entries_mut();
        entries.add(property.path(), AddressEntry::Property(Arc::clone(&property)))?;
        // It can't be found before the lock is released, so no event of it precedes its appearance.
        property.source().appear();
        Ok(property)
    }

    /// Makes `path` an alias of `target`: a linked input.
    ///
    /// # Errors
    /// When the path is taken.
    pub fn add_alias(&self, path: &str, target: &str) -> Result<(), BoardError> {
        self.entries_mut().add(path, AddressEntry::Alias(target.into()))
    }

    /// Redirects the alias `path` to `target`, and returns its former target.
    ///
    /// # Errors
    /// When nothing is there, or a property.
    pub fn replace_alias(&self, path: &str, target: &str) -> Result<String, BoardError> {
        self.entries_mut().replace_alias(path, target)
    }

    /// Removes the property or the alias at exactly that path.
    /// The property and its existing handles work as before; but the path can be given to another one. Aliases of the
    /// property lead nowhere.
    ///
    /// # Errors
    /// When nothing is there.
    pub fn remove(&self, path: &str) -> Result<(), BoardError> {
        let mut entries = self.entries_mut();
        if let AddressEntry::Property(property) = entries.remove(path)? {
            // Before the path is free, so that this comes before the next one appears.
            property.source().vanish();
            // Its last owner drops handles, which must not happen under the lock.
            drop(entries);
        }
        Ok(())
    }

    /// Counts the changes of the properties that the host sets.
    pub fn settings(&self) -> SettingsCounter {
        self.observers.settings()
    }

    /// Observes the properties whose paths match, from now on.
    /// At most `limit` (at least 1) events wait in the queue; further ones are counted. It notifies `wake` (of 1), if
    /// there is one, of each. To see the present properties too, begin to observe first, and then look, so that nothing
    /// comes in between.
    ///
    /// ```
    /// # use slate_blackboard::{Access, Board, Event, Pattern, Store, channel::Budget, interface::Interface};
    /// let board = Board::new("base");
    /// let mut observer = board.observe(&Pattern::parse("*/hit")?, 16, None);
    /// let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 1, queues: 0, window: 0 } };
    /// board.add_channel("bumper/hit", "Something was hit.", <()>::DESCRIPTOR, store, Access::Output)?;
    /// assert_eq!(observer.next(), Some(Event::Appeared("bumper/hit".into())));
    /// assert_eq!(observer.next(), None);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn observe(&self, pattern: &Pattern, limit: usize, wake: Option<Arc<Wake>>) -> Observer {
        self.observers.observe(pattern, limit, wake)
    }

    /// Returns the property at a path, and the field that the rest of the path names.
    /// The field is empty for the whole value.
    ///
    /// # Errors
    /// [`BoardError::Unknown`] with the nearest names.
    pub fn find(&self, path: &str) -> Result<(Arc<Property>, String), BoardError> {
        self.entries().find(path).map(|(property, field)| (Arc::clone(property), field))
    }

    /// Returns a property as [`find`](Board::find); `None` if it is missing.
    /// It does not search for similar names.
    pub fn get(&self, path: &str) -> Option<(Arc<Property>, String)> {
        self.entries().get(path).map(|(property, field)| (Arc::clone(property), field))
    }

    /// Returns the property of a URL of this agent, and the field that it names.
    ///
    /// # Errors
    /// As [`find`](Board::find), or that the URL belongs to another agent.
    pub fn resolve(&self, url: &Url) -> Result<(Arc<Property>, String), BoardError> {
        if url.agent().is_some_and(|agent| agent != self.agent) {
            return Err(BoardError::OtherAgent { url: url.to_string(), agent: self.agent.clone() });
        }
        self.find(&url.path_in(""))
    }

    /// Reads a property or a field of it; nothing before the first write.
    ///
    /// # Errors
    /// When there is no such property or field.
    pub fn read(&self, path: &str) -> Result<Option<(Value, Stamp)>, BoardError> {
        let (property, field_path) = self.target(path)?;
        let Some((bytes, items, stamp)) = property.newest()? else { return Ok(None) };
        Ok(value(property.descriptor(), &bytes, items, field_path.as_ref()).map(|value| (value, stamp)))
    }

    /// Reads all kept values of a property, or a field of them, the oldest first.
    /// Of a queue these are the last ones.
    ///
    /// # Errors
    /// When there is no such property or field.
    pub fn history(&self, path: &str) -> Result<Vec<(Value, Stamp)>, BoardError> {
        let (property, field_path) = self.target(path)?;
        let values = property.snapshot()?.unwrap_or_default().values;
        let read = |saved: StampedValue| {
            let value = value(property.descriptor(), &saved.bytes, saved.items, field_path.as_ref());
            value.map(|value| (value, saved.stamp))
        };
        Ok(values.into_iter().filter_map(read).collect())
    }

    /// Returns a property, and the path of a field of it.
    fn target(&self, path: &str) -> Result<(Arc<Property>, Option<FieldPath>), BoardError> {
        let (property, field) = self.find(path)?;
        let wrong = |error| BoardError::Access { url: format!("/{}", property.path()), error };
        let field_path = match field.as_str() {
            "" => None,
            field => Some(find(property.descriptor(), field).map_err(wrong)?),
        };
        Ok((property, field_path))
    }

    /// Sets a parameter, or an input without a link, or a field of one.
    ///
    /// # Errors
    /// When there is no such property or field, a module writes it, or the value doesn't fit.
    pub fn write(&self, path: &str, value: &Value, time: u64) -> Result<Stamp, BoardError> {
        let (property, field) = self.find(path)?;
        property.set(&field, value, time)
    }

    /// Returns all properties in the order of their paths.
    pub fn properties(&self) -> Vec<Arc<Property>> {
        self.filtered(|_| true)
    }

    /// Returns the properties whose paths match, ordered by path.
    pub fn matching(&self, pattern: &Pattern) -> Vec<Arc<Property>> {
        self.filtered(|property| pattern.matches(property.path()))
    }

    /// Returns the properties of an interface whose paths match, ordered by path.
    /// The interface is given by its name.
    pub fn matching_type(&self, interface: &str, pattern: &Pattern) -> Vec<Arc<Property>> {
        self.filtered(|property| property.descriptor().name == interface && pattern.matches(property.path()))
    }

    fn filtered(&self, wanted: impl Fn(&Property) -> bool) -> Vec<Arc<Property>> {
        self.entries().properties().filter(|property| wanted(property)).cloned().collect()
    }

    /// Returns all linked inputs with the paths that they read.
    pub fn aliases(&self) -> Vec<(String, String)> {
        let entries = self.entries();
        entries.aliases().map(|(path, target)| (path.to_owned(), target.to_owned())).collect()
    }
}

/// Returns the value in these bytes, or a field of it.
fn value(
    descriptor: &'static Descriptor,
    bytes: &[u8],
    items: usize,
    field_path: Option<&FieldPath>,
) -> Option<Value> {
    let view = View::new(descriptor, bytes, items)?;
    match field_path {
        None => Some(view.value()),
        Some(field_path) => view.at(field_path),
    }
}
