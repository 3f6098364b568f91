use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};

use crate::channel::{Budget, BudgetSpent, Channel, Latest, Writer};
use crate::interface::{AccessError, Descriptor, Value, View, edit, find};
use crate::message::Mailbox;
use crate::{Stamp, Url};

/// The address space of an agent: properties by path.
///
/// It is asked when something is linked or inspected, never on the way of a value: writers and readers hold handles.
#[derive(Debug)]
pub struct Board {
    agent: String,
    entries: RwLock<BTreeMap<String, Entry>>,
}

#[derive(Clone, Debug)]
enum Entry {
    Property(Arc<Property>),
    /// An input that is linked: the URL of the property it reads, which may name a field.
    Alias(String),
}

/// A typed value at a URL, with one writer and many readers.
#[derive(Debug)]
pub struct Property {
    path: String,
    doc: String,
    descriptor: &'static Descriptor,
    access: Access,
    carrier: Carrier,
    /// The writer of a property that the host sets: an unlinked input, a parameter.
    setter: Mutex<Option<Writer>>,
    probe: Mutex<Option<Latest>>,
    watchers: AtomicU32,
}

/// What a property with values takes.
#[derive(Clone, Copy, Debug)]
pub struct Store {
    /// Room in the tail, for interfaces with one.
    pub capacity: usize,
    /// How many values are kept.
    pub depth: usize,
    /// How many readers it serves.
    pub budget: Budget,
}

/// How values or messages of a property travel.
#[derive(Clone, Debug)]
pub enum Carrier {
    /// Values: the newest, or the last few.
    Channel(Arc<Channel>),
    /// Messages to the writer.
    Mailbox(Arc<Mailbox>),
}

/// Who writes a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// A module.
    Output,
    /// Configuration, command line and console: a parameter, or an input without a link.
    Setting,
    /// Anybody sends messages.
    Messages,
}

/// What goes wrong with the address space.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// Nothing is there.
    #[error("no property at {url}{}", nearest(.near))]
    Unknown {
        /// What was asked for.
        url: String,
        /// The nearest names there are.
        near: Vec<String>,
    },
    /// Something else is there already.
    #[error("{url} exists already")]
    Exists {
        /// Where.
        url: String,
    },
    /// A module writes it, so nobody else may.
    #[error("{url} is written by its module; only parameters and inputs without a link can be set")]
    ReadOnly {
        /// Which.
        url: String,
    },
    /// The value or the field doesn't fit.
    #[error("{url}: {error}")]
    Access {
        /// Which property.
        url: String,
        /// What is wrong.
        error: AccessError,
    },
    /// The URL belongs to another agent.
    #[error("{url} belongs to another agent than {agent}")]
    OtherAgent {
        /// What was asked for.
        url: String,
        /// This agent.
        agent: String,
    },
    /// No reader handle is left.
    #[error("{url}: {error}")]
    Budget {
        /// Which property.
        url: String,
        /// The limit.
        error: BudgetSpent,
    },
}

fn nearest(near: &[String]) -> String {
    if near.is_empty() { String::new() } else { format!("; nearest: {}", near.join(", ")) }
}

/// What stays intact when another thread panicked while it held the lock.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Property {
    /// Path in the agent, without a leading slash.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// What it is for.
    pub fn doc(&self) -> &str {
        &self.doc
    }

    /// Its type.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    /// Who writes it.
    pub fn access(&self) -> Access {
        self.access
    }

    /// How it travels.
    pub fn carrier(&self) -> &Carrier {
        &self.carrier
    }

    /// The channel of a property that has values.
    pub fn channel(&self) -> Option<&Arc<Channel>> {
        match &self.carrier {
            Carrier::Channel(channel) => Some(channel),
            Carrier::Mailbox(_) => None,
        }
    }

    /// Whether somebody watches, so that debug outputs are worth computing.
    pub fn is_watched(&self) -> bool {
        self.watchers.load(Ordering::Relaxed) > 0
    }

    /// Begins (`true`) or ends (`false`) watching.
    pub fn watch(&self, on: bool) {
        if on {
            self.watchers.fetch_add(1, Ordering::Relaxed);
        } else {
            self.watchers.fetch_sub(1, Ordering::Relaxed);
        }
    }

    /// Copies the newest value: its bytes, its tail items and its stamp; nothing before the first write.
    ///
    /// # Errors
    /// When no reader handle is left.
    pub fn newest(&self) -> Result<Option<(Vec<u8>, usize, Stamp)>, BoardError> {
        let Carrier::Channel(channel) = &self.carrier else { return Ok(None) };
        let mut probe = locked(&self.probe);
        if probe.is_none() {
            let reader = channel
                .latest()
                .map_err(|error| BoardError::Budget { url: format!("/{}", self.path), error })?;
            *probe = Some(reader);
        }
        let Some(reader) = probe.as_mut() else { return Ok(None) };
        reader.refresh();
        Ok(reader.value().map(|loan| (loan.bytes().to_vec(), loan.items(), loan.stamp())))
    }

    /// Sets the whole value of a property that the host writes, from memory of its interface.
    ///
    /// # Errors
    /// When a module writes it, or there are too few or too many bytes.
    pub fn set_bytes(&self, bytes: &[u8], time: u64) -> Result<Stamp, BoardError> {
        let read_only = || BoardError::ReadOnly { url: format!("/{}", self.path) };
        let shape = self.channel().ok_or_else(read_only)?.shape();
        let items = bytes.len().saturating_sub(shape.size).checked_div(shape.item).unwrap_or(0);
        if bytes.len() < shape.size || items > shape.capacity {
            return Err(BoardError::Access {
                url: format!("/{}", self.path),
                error: AccessError::WrongType {
                    field: String::new(),
                    expected: format!("{} to {} bytes", shape.size, shape.bytes(shape.capacity)),
                    found: format!("{} bytes", bytes.len()),
                },
            });
        }
        let mut setter = locked(&self.setter);
        let writer = setter.as_mut().ok_or_else(read_only)?;
        writer.write(bytes, items, time).map_err(|_| read_only())
    }

    /// Sets a field, or the whole value with an empty path, of a property that the host writes.
    ///
    /// # Errors
    /// When a module writes it, or the value doesn't fit; nothing is changed then.
    pub fn set(&self, field: &str, value: &Value, time: u64) -> Result<Stamp, BoardError> {
        let url = || format!("/{}", self.path);
        let access = |error| BoardError::Access { url: url(), error };
        // First, so that of two who set different fields at once neither undoes the other.
        let mut setter = locked(&self.setter);
        let writer = setter.as_mut().ok_or_else(|| BoardError::ReadOnly { url: url() })?;
        let (mut bytes, items) = match self.newest()? {
            Some((bytes, items, _)) => (bytes, items),
            None => (Vec::new(), 0),
        };
        let shape = self.channel().ok_or_else(|| BoardError::ReadOnly { url: url() })?.shape();
        bytes.resize(shape.bytes(shape.capacity), 0);
        let items = edit(self.descriptor, &mut bytes, items, field, value).map_err(access)?;
        // Only recorders ask a writer to wait, and they don't on settings.
        writer
            .write(&bytes[..shape.bytes(items)], items, time)
            .map_err(|_| BoardError::ReadOnly { url: url() })
    }
}

impl Board {
    /// The address space of that agent.
    pub fn new(agent: &str) -> Self {
        Self { agent: agent.into(), entries: RwLock::default() }
    }

    /// The agent's name.
    pub fn agent(&self) -> &str {
        &self.agent
    }

    /// Adds a property that has values.
    ///
    /// # Errors
    /// When the path is taken.
    pub fn add_channel(
        &self,
        path: &str,
        doc: &str,
        descriptor: &'static Descriptor,
        store: Store,
        access: Access,
    ) -> Result<Arc<Property>, BoardError> {
        let channel = Channel::new(descriptor.shape(store.capacity), store.depth, store.budget);
        let setter = match access {
            // A fresh channel has no writer, so this one is granted.
            Access::Setting => channel.writer().ok(),
            Access::Output | Access::Messages => None,
        };
        self.add(path, doc, descriptor, access, Carrier::Channel(channel), setter)
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
        self.add(path, doc, descriptor, Access::Messages, Carrier::Mailbox(mailbox), None)
    }

    fn add(
        &self,
        path: &str,
        doc: &str,
        descriptor: &'static Descriptor,
        access: Access,
        carrier: Carrier,
        setter: Option<Writer>,
    ) -> Result<Arc<Property>, BoardError> {
        let mut entries = self.entries.write().unwrap_or_else(PoisonError::into_inner);
        if entries.contains_key(path) {
            return Err(BoardError::Exists { url: format!("/{path}") });
        }
        let property = Arc::new(Property {
            path: path.into(),
            doc: doc.into(),
            descriptor,
            access,
            carrier,
            setter: Mutex::new(setter),
            probe: Mutex::new(None),
            watchers: AtomicU32::new(0),
        });
        entries.insert(path.into(), Entry::Property(Arc::clone(&property)));
        Ok(property)
    }

    /// Makes `path` another name of `target`: a linked input.
    ///
    /// # Errors
    /// When the path is taken.
    pub fn add_alias(&self, path: &str, target: &str) -> Result<(), BoardError> {
        let mut entries = self.entries.write().unwrap_or_else(PoisonError::into_inner);
        if entries.contains_key(path) {
            return Err(BoardError::Exists { url: format!("/{path}") });
        }
        entries.insert(path.into(), Entry::Alias(target.into()));
        Ok(())
    }

    /// The property at a path, and the field that the rest of the path names (empty for the whole).
    ///
    /// # Errors
    /// [`BoardError::Unknown`] with the nearest names.
    pub fn find(&self, path: &str) -> Result<(Arc<Property>, String), BoardError> {
        let entries = self.entries.read().unwrap_or_else(PoisonError::into_inner);
        let mut path = path.to_owned();
        // An alias leads to a property, not to another alias, but an application may chain them by mistake.
        for _ in 0..8 {
            let mut end = path.len();
            loop {
                match entries.get(&path[..end]) {
                    Some(Entry::Property(property)) => {
                        let field = path[end..].trim_start_matches('/').to_owned();
                        return Ok((Arc::clone(property), field));
                    }
                    Some(Entry::Alias(target)) => {
                        path = format!("{target}{}", &path[end..]);
                        break;
                    }
                    None => match path[..end].rfind('/') {
                        Some(slash) => end = slash,
                        None => return Err(unknown(&path, &entries)),
                    },
                }
            }
        }
        Err(unknown(&path, &entries))
    }

    /// The property of a URL of this agent, and the field that it names.
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
        let (property, field) = self.find(path)?;
        let place = match field.as_str() {
            "" => None,
            field => Some(
                find(property.descriptor, field)
                    .map_err(|error| BoardError::Access { url: format!("/{}", property.path), error })?,
            ),
        };
        let Some((bytes, items, stamp)) = property.newest()? else { return Ok(None) };
        let Some(view) = View::new(property.descriptor, &bytes, items) else { return Ok(None) };
        let value = match &place {
            None => Some(view.value()),
            Some(place) => view.at(place),
        };
        Ok(value.map(|value| (value, stamp)))
    }

    /// Sets a parameter, or an input without a link, or a field of one.
    ///
    /// # Errors
    /// When there is no such property or field, a module writes it, or the value doesn't fit.
    pub fn write(&self, path: &str, value: &Value, time: u64) -> Result<Stamp, BoardError> {
        let (property, field) = self.find(path)?;
        property.set(&field, value, time)
    }

    /// All properties in the order of their paths.
    pub fn properties(&self) -> Vec<Arc<Property>> {
        let entries = self.entries.read().unwrap_or_else(PoisonError::into_inner);
        entries
            .values()
            .filter_map(|entry| match entry {
                Entry::Property(property) => Some(Arc::clone(property)),
                Entry::Alias(_) => None,
            })
            .collect()
    }

    /// All linked inputs with the paths that they read.
    pub fn aliases(&self) -> Vec<(String, String)> {
        let entries = self.entries.read().unwrap_or_else(PoisonError::into_inner);
        entries
            .iter()
            .filter_map(|(path, entry)| match entry {
                Entry::Alias(target) => Some((path.clone(), target.clone())),
                Entry::Property(_) => None,
            })
            .collect()
    }
}

fn unknown(path: &str, entries: &BTreeMap<String, Entry>) -> BoardError {
    BoardError::Unknown {
        url: format!("/{path}"),
        near: nearest_names(path, entries.keys().map(String::as_str)),
    }
}

/// The names most like `name`, at most three, best first.
pub fn nearest_names<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut scored: Vec<_> = names.map(|other| (strsim::damerau_levenshtein(name, other), other)).collect();
    scored.sort();
    scored
        .into_iter()
        .filter(|(distance, _)| *distance <= name.len() / 3 + 1)
        .take(3)
        .map(|(_, name)| name.into())
        .collect()
}
