use std::ops::DerefMut;
use std::sync::{Arc, PoisonError, TryLockError};

use super::BoardError;
use super::events::EventSource;
use crate::Stamp;
use crate::channel::{Channel, ChannelSnapshot, Latest, Writer};
use crate::interface::{AccessError, Descriptor, Value, edit};
use crate::message::Mailbox;
use crate::sync::{AtomicU32, Mutex, MutexGuard, Ordering};
use crate::wake::Wake;

/// A typed value at a URL, with one writer and many readers.
#[derive(Debug)]
pub struct Property {
    source: Arc<EventSource>,
    doc: String,
    /// Part of the architecture that writes it, such as `monitor`; empty for none.
    part: Mutex<String>,
    descriptor: &'static Descriptor,
    access: Access,
    carrier: Carrier,
    /// The writer of a property that the host sets: an unlinked input, a parameter.
    setter: Mutex<Option<Writer>>,
    probe: Mutex<Option<Latest>>,
    /// Fields that links fill, each with its source.
    /// They can't be set otherwise.
    reserved: Mutex<Vec<(String, String)>>,
    /// Program outside of the agent that fills it.
    external: Mutex<String>,
    watchers: Watchers,
    listeners: Mutex<Vec<Arc<Wake>>>,
}

/// Transport of a property's values or messages.
#[derive(Clone, Debug)]
pub enum Carrier {
    /// Values: the newest, or the last few.
    Channel(Arc<Channel>),
    /// Messages to the writer.
    Mailbox(Arc<Mailbox>),
}

/// Writer of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// A module.
    Output,
    /// Configuration, command line and console.
    /// The property is a parameter, or an input without a link.
    Setting,
    /// Anybody sends messages.
    Messages,
}

/// Locks a mutex, also after a panic of another thread that held it.
/// The data stay intact.
fn locked<T>(mutex: &Mutex<T>) -> impl DerefMut<Target = T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Property {
    pub(super) fn new(
        source: Arc<EventSource>,
        doc: &str,
        descriptor: &'static Descriptor,
        access: Access,
        carrier: Carrier,
        setter: Option<Writer>,
    ) -> Self {
        Self {
            source,
            doc: doc.into(),
            part: Mutex::new(String::new()),
            descriptor,
            access,
            carrier,
            setter: Mutex::new(setter),
            probe: Mutex::new(None),
            reserved: Mutex::new(Vec::new()),
            external: Mutex::new(String::new()),
            watchers: Watchers::default(),
            listeners: Mutex::new(Vec::new()),
        }
    }

    /// Returns the part of the architecture that alone writes it or sends to it.
    /// An example is `monitor`. Empty for none.
    pub fn part(&self) -> String {
        locked(&self.part).clone()
    }

    /// Sets the part of the architecture that alone writes it or sends to it.
    pub fn set_part(&self, part: &str) {
        part.clone_into(&mut *locked(&self.part));
    }

    pub(super) fn source(&self) -> &EventSource {
        &self.source
    }

    fn url(&self) -> String {
        format!("/{}", self.path())
    }

    /// Returns the path in the agent, without a leading slash.
    pub fn path(&self) -> &str {
        self.source.path()
    }

    /// Returns the documentation.
    pub fn doc(&self) -> &str {
        &self.doc
    }

    /// Returns the source outside of the agent, such as `ros2:/scan`; empty for none.
    pub fn external(&self) -> String {
        locked(&self.external).clone()
    }

    /// Sets the external source that fills the property from now on.
    /// The source is outside of the agent, and uses [`set_bytes`](Property::set_bytes) or
    /// [`set_from_outside`](Property::set_from_outside): no other caller may [set](Property::set) it then.
    pub fn set_external(&self, source: &str) {
        source.clone_into(&mut *locked(&self.external));
    }

    /// Returns the descriptor of its type.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    /// Returns the writer.
    pub fn access(&self) -> Access {
        self.access
    }

    /// Returns the transport of the values or messages.
    pub fn carrier(&self) -> &Carrier {
        &self.carrier
    }

    /// Returns the channel of a property that has values.
    pub fn channel(&self) -> Option<&Arc<Channel>> {
        match &self.carrier {
            Carrier::Channel(channel) => Some(channel),
            Carrier::Mailbox(_) => None,
        }
    }

    /// Returns true if the property is watched.
    /// Only then are debug outputs worth computing.
    pub fn is_watched(&self) -> bool {
        self.watchers.0.load(Ordering::Relaxed) > 0
    }

    /// Watches until the returned mark is dropped.
    pub fn watch(self: &Arc<Self>) -> Watching {
        Watching { property: Arc::clone(self), _watch: self.watchers.watch() }
    }

    /// Returns the counter of watchers, for a holder that must not keep the property.
    pub fn watchers(&self) -> Watchers {
        self.watchers.clone()
    }

    /// Returns the number of readers of the values.
    /// Tools that look at the newest one don't count.
    pub fn readers(&self) -> usize {
        self.channel().map_or(0, |channel| channel.readers())
    }

    /// Returns true if the values have a writer now.
    /// A property that the host sets always has one.
    pub fn has_writer(&self) -> bool {
        self.channel().is_some_and(|channel| channel.has_writer())
    }

    /// Counts the writers that its values have had.
    pub fn generation(&self) -> u64 {
        self.channel().map_or(0, |channel| channel.generation())
    }

    /// Notifies `wake` (of 1) whenever the value is set from now on.
    /// This is by [`set`](Property::set) or [`set_bytes`](Property::set_bytes), whose callers do not wait for the woken
    /// thread.
    pub fn add_listener(&self, wake: Arc<Wake>) {
        locked(&self.listeners).push(wake);
    }

    /// Removes a listener of [`add_listener`](Property::add_listener).
    pub fn remove_listener(&self, wake: &Arc<Wake>) {
        locked(&self.listeners).retain(|other| !Arc::ptr_eq(other, wake));
    }

    /// Protects these fields, and no others, from being set.
    /// Each has the source that it is linked to.
    pub fn reserve(&self, fields: Vec<(String, String)>) {
        let old = std::mem::replace(&mut *locked(&self.reserved), fields);
        drop(old);
    }

    /// Checks that no link fills the field to be set.
    fn check_reserved(&self, field: &str, value: &Value) -> Result<(), BoardError> {
        let external = self.external();
        if !external.is_empty() {
            return Err(BoardError::Linked { url: self.url(), from: external });
        }
        let reserved = locked(&self.reserved);
        let has = |name: &str| match value {
            Value::Table(entries) => entries.iter().any(|(own, _)| own == name),
            _ => true,
        };
        let is_part = |path: &str, whole: &str| {
            path.strip_prefix(whole).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        let taken = reserved.iter().find(|(name, _)| match field {
            "" => has(name.split('/').next().unwrap_or_default()),
            field => is_part(field, name) || is_part(name, field),
        });
        match taken {
            Some((name, from)) => {
                Err(BoardError::Linked { url: format!("{}/{name}", self.url()), from: from.clone() })
            }
            None => Ok(()),
        }
    }

    /// Returns a setter that never waits.
    /// `None` while another caller sets the property. The property is one that the host sets. Unlike with
    /// [`set`](Property::set), listeners are not notified.
    pub fn try_setter(&self) -> Option<Setter<'_>> {
        let guard = match self.setter.try_lock() {
            Ok(guard) => guard,
            Err(TryLockError::Poisoned(error)) => error.into_inner(),
            Err(TryLockError::WouldBlock) => return None,
        };
        guard.is_some().then_some(Setter { guard })
    }

    fn notify(&self) {
        self.source.set();
        locked(&self.listeners).iter().for_each(|wake| wake.notify(1));
    }

    /// Copies the newest value: its bytes, number of tail items, and stamp.
    /// `None` before the first write.
    ///
    /// # Errors
    /// When no reader handle is left.
    pub fn newest(&self) -> Result<Option<(Vec<u8>, usize, Stamp)>, BoardError> {
        let Carrier::Channel(channel) = &self.carrier else { return Ok(None) };
        let mut probe = locked(&self.probe);
        if probe.is_none() {
            let reader = channel.probe().map_err(|error| BoardError::Link { url: self.url(), error })?;
            *probe = Some(reader);
        }
        let Some(reader) = probe.as_mut() else { return Ok(None) };
        reader.refresh();
        Ok(reader.value().map(|loan| (loan.bytes().to_vec(), loan.items(), loan.stamp())))
    }

    /// Copies the kept values, for a snapshot.
    /// `None` if the property receives messages.
    ///
    /// # Errors
    /// When there is no slot for what this pins meanwhile.
    pub fn snapshot(&self) -> Result<Option<ChannelSnapshot>, BoardError> {
        let saved = self.channel().map(|channel| channel.snapshot()).transpose();
        saved.map_err(|error| BoardError::Link { url: self.url(), error })
    }

    /// Restores the values of a snapshot.
    /// A property that a module writes needs its `writer`, if it has one now. All readers must [resume](Latest::resume)
    /// at one of these values.
    ///
    /// # Errors
    /// When they don't fit, or the writer is another one's; nothing is changed then.
    pub fn restore(&self, saved: &ChannelSnapshot, writer: Option<&mut Writer>) -> Result<(), BoardError> {
        let Carrier::Channel(channel) = &self.carrier else { return Ok(()) };
        let link = |error| BoardError::Link { url: self.url(), error };
        let mismatch = |error| BoardError::Mismatch { url: self.url(), error };
        let mut setter = locked(&self.setter);
        match writer.or(setter.as_mut()) {
            Some(writer) => writer.restore(saved).map_err(mismatch)?,
            None => channel.restore(saved).map_err(link)?.map_err(mismatch)?,
        }
        // It would wait for values that come after the last one it has seen.
        drop(locked(&self.probe).take());
        drop(setter);
        self.notify();
        Ok(())
    }

    /// Sets the whole value of a property that the host writes, from its memory layout.
    ///
    /// # Errors
    /// When a module writes it, or there are too few or too many bytes.
    pub fn set_bytes(&self, bytes: &[u8], time: u64) -> Result<Stamp, BoardError> {
        let read_only = || BoardError::ReadOnly { url: self.url() };
        let shape = self.channel().ok_or_else(read_only)?.shape();
        let items = bytes.len().saturating_sub(shape.size).checked_div(shape.item).unwrap_or(0);
        if bytes.len() < shape.size || items > shape.capacity {
            return Err(BoardError::Access {
                url: self.url(),
                error: AccessError::WrongType {
                    field: String::new(),
                    expected: format!("{} to {} bytes", shape.size, shape.bytes(shape.capacity)),
                    found: format!("{} bytes", bytes.len()),
                },
            });
        }
        let mut setter = locked(&self.setter);
        let writer = setter.as_mut().ok_or_else(read_only)?;
        let stamp = writer.write(bytes, items, time).map_err(|_| read_only())?;
        drop(setter);
        self.notify();
        Ok(stamp)
    }

    /// Sets a field, or with an empty path the whole value.
    /// The property is one that the host writes.
    ///
    /// # Errors
    /// When a module writes it, or the value doesn't fit; nothing is changed then.
    pub fn set(&self, field: &str, value: &Value, time: u64) -> Result<Stamp, BoardError> {
        self.check_reserved(field, value)?;
        self.set_from_outside(field, value, time)
    }

    /// Sets a field, or with an empty path the whole value, for the external source.
    /// This is the source outside of the agent that [fills it](Property::set_external).
    ///
    /// # Errors
    /// When a module writes it, or the value doesn't fit; nothing is changed then.
    pub fn set_from_outside(&self, field: &str, value: &Value, time: u64) -> Result<Stamp, BoardError> {
        let access = |error| BoardError::Access { url: self.url(), error };
        let read_only = || BoardError::ReadOnly { url: self.url() };
        // First, so that of two setters of different fields at once neither undoes the other.
        let mut setter = locked(&self.setter);
        let writer = setter.as_mut().ok_or_else(read_only)?;
        let (mut bytes, items) = match self.newest()? {
            Some((bytes, items, _)) => (bytes, items),
            None => (Vec::new(), 0),
        };
        let shape = self.channel().ok_or_else(read_only)?.shape();
        bytes.resize(shape.bytes(shape.capacity), 0);
        let items = edit(self.descriptor, &mut bytes, items, field, value).map_err(access)?;
        // Only recorders ask a writer to wait, and they don't on settings.
        let stamp = writer.write(&bytes[..shape.bytes(items)], items, time).map_err(|_| read_only())?;
        drop(setter);
        self.notify();
        Ok(stamp)
    }
}

/// The right to write a property that the host sets.
#[derive(Debug)]
pub struct Setter<'a> {
    guard: MutexGuard<'a, Option<Writer>>,
}

impl Setter<'_> {
    /// Writes a whole value without a tail; false when a reader holds it up.
    pub fn write(&mut self, bytes: &[u8], time: u64) -> bool {
        self.guard.as_mut().is_some_and(|writer| writer.write(bytes, 0, time).is_ok())
    }
}

/// Observation of a property: it is watched as long as this lives.
#[derive(Debug)]
pub struct Watching {
    property: Arc<Property>,
    _watch: Watch,
}

impl Watching {
    /// Returns the watched property.
    pub fn property(&self) -> &Arc<Property> {
        &self.property
    }
}

/// Counter of the watchers of a property.
#[derive(Clone, Debug, Default)]
pub struct Watchers(Arc<AtomicU32>);

impl Watchers {
    /// Watches until the returned mark is dropped.
    pub fn watch(&self) -> Watch {
        self.0.fetch_add(1, Ordering::Relaxed);
        Watch(Arc::clone(&self.0))
    }
}

/// Mark of one watcher: the property is watched as long as this lives.
#[derive(Debug)]
pub struct Watch(Arc<AtomicU32>);

impl Drop for Watch {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}
