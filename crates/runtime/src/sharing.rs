//! The seam to what carries values and messages between agents: the runtime says what is wanted, and is told what is
//! there.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use slate_blackboard::interface::{AccessError, Descriptor, Value, View, find};
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Board, Stamp};
use slate_module::Level;

pub use slate_composition::RemotePath;
pub use slate_configuration::{Compression, TEAM, is_topic};
use slate_configuration::{ShareSecurity, SharedKnowledge};
use slate_engine::clock::{Clock, monotonic};
pub use slate_engine::main_loop::AfterTick;
use slate_engine::main_loop::WriteListeners;

/// Carries values and messages between agents. It has threads of its own: none of these calls waits for another agent,
/// and dropping it ends them.
pub trait Sharing: Send {
    /// Begins to share; it is called once, before anything else, and not for agents that share nothing.
    ///
    /// # Errors
    /// When an endpoint can't be listened at, or what is to protect the agent does not.
    fn start(&mut self, site: Site) -> Result<(), SharingError>;

    /// What this agent wants of others from now on; what is not among it is wanted no longer.
    fn want(&mut self, wants: BTreeMap<RemotePath, Want>);

    /// What can carry values, as endpoints begin; any name unless something is among them.
    fn carriers(&self) -> BTreeSet<String> {
        BTreeSet::new()
    }

    /// Whether values can be compressed as JPEG.
    fn has_jpeg(&self) -> bool {
        true
    }

    /// The agent's part in the knowledge of its team; nothing unless it takes part.
    fn team(&self) -> Option<Arc<dyn TeamExchange>> {
        None
    }

    /// What looks into other agents for tools, where that is possible.
    fn inspection(&self) -> Option<Arc<dyn Inspection>> {
        None
    }
}

/// An agent's part in the knowledge of its team, for networks that reach other robots beside the sharing itself.
///
/// Messages may be lost, doubled and reordered: later ones make them good. None of these calls waits.
pub trait TeamExchange: Send + Sync {
    /// Sends messages for other robots by that carrier, too, until another one or none takes its place.
    fn set_carrier(&self, carrier: Option<Arc<dyn TeamCarrier>>);

    /// Notes that the carrier reaches a robot.
    fn meet(&self, robot: &str);

    /// Notes that the carrier no longer reaches a robot.
    fn part(&self, robot: &str);

    /// Takes a message of a robot, which must be authenticated if that matters.
    fn hear(&self, robot: &str, message: Vec<u8>);
}

/// Sends messages of a team's knowledge.
pub trait TeamCarrier: Send + Sync {
    /// Sends a message to a robot without waiting; false when it is lost already.
    fn tell(&self, robot: &str, message: &[u8]) -> bool;
}

/// Looks into other agents. It may be asked by several threads at once, and holds up nobody else.
pub trait Inspection: Send + Sync {
    /// The properties of another agent that a pattern is of, with their newest values if those are wanted. It waits no
    /// longer than `limit`.
    ///
    /// # Errors
    /// In words, when nobody of that name is known, or the agent is not there or does not answer.
    fn list(
        &self,
        agent: &str,
        pattern: &str,
        values: bool,
        limit: Duration,
    ) -> Result<Vec<RemoteProperty>, String>;
}

/// A property of another agent.
#[derive(Clone, Debug)]
pub struct RemoteProperty {
    /// Path in that agent.
    pub path: String,
    /// What it is for.
    pub doc: String,
    /// Its writer.
    pub access: Access,
    /// Its type.
    pub descriptor: &'static Descriptor,
    /// Room in the tail.
    pub capacity: u64,
    /// How many values are kept; 0 for a mailbox.
    pub depth: u32,
    /// Whether it has a writer now.
    pub has_writer: bool,
    /// Its newest value, if that was asked for.
    pub newest: Newest,
}

/// What another agent tells of the newest value of a property.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Newest {
    /// There is none, or it was not asked for.
    Unwritten,
    /// Its bytes, how many items its tail has, and the other agent's stamp. They are as they came, as what can be read of
    /// them takes far more memory.
    Value(Vec<u8>, usize, Stamp),
    /// It has so many bytes, which are too many for an answer.
    TooLarge(u64),
    /// This agent may not read it.
    NotAllowed,
}

/// Why a value of another agent can't be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unread {
    /// There is no such field.
    #[error("{0}")]
    Field(#[from] AccessError),
    /// It is a mailbox.
    #[error("it takes messages, and has no value")]
    Messages,
    /// It is too large for an answer.
    #[error("its newest value has {0} bytes, too many for an answer; links carry it")]
    TooLarge(u64),
    /// The other agent does not allow it.
    #[error("the other agent does not let this one read it")]
    NotAllowed,
}

impl RemoteProperty {
    /// The newest value, or a field of it; nothing before the first write.
    ///
    /// # Errors
    /// When there is no such field, or the other agent does not tell the value.
    pub fn value(&self, field: &str) -> Result<Option<(Value, Stamp)>, Unread> {
        let place = match field {
            "" => None,
            field => Some(find(self.descriptor, field)?),
        };
        let (bytes, items, stamp) = match &self.newest {
            _ if self.access == Access::Messages => return Err(Unread::Messages),
            Newest::Unwritten => return Ok(None),
            Newest::Value(bytes, items, stamp) => (bytes, items, stamp),
            Newest::TooLarge(size) => return Err(Unread::TooLarge(*size)),
            Newest::NotAllowed => return Err(Unread::NotAllowed),
        };
        let view = View::new(self.descriptor, bytes, *items);
        let value = view.and_then(|view| place.map_or_else(|| Some(view.value()), |place| view.at(&place)));
        Ok(value.map(|value| (value, *stamp)))
    }
}

/// Why an agent does not share.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct SharingError {
    /// In words.
    pub message: String,
    /// What to do about it, if the message does not say so.
    pub help: Option<String>,
    /// What it is about.
    pub about: About,
}

impl From<String> for SharingError {
    fn from(message: String) -> Self {
        Self { message, help: None, about: About::Sharing }
    }
}

/// What of `[share]` an error is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum About {
    /// All of it.
    Sharing,
    /// That endpoint, which this agent listens at.
    Listen(String),
    /// Where that agent is found.
    Agent(String),
    /// `[share.security]`.
    Security,
    /// The certificate of it.
    Certificate,
    /// The key of it.
    Key,
    /// The authority of it.
    Authority,
}

/// What is wanted of another agent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Want {
    /// The values of a property: a property of the same interface is to be at [`RemotePath::place`] of the board, with the
    /// path of the whole property.
    Values {
        /// Whether losses on the way are made good.
        reliable: bool,
        /// When they are sent.
        pace: Pace,
        /// Whether they are made smaller.
        compression: Compression,
        /// How many values are kept at least, if every value is wanted; nothing when the newest is.
        every: Option<usize>,
        /// What a port is that reads the whole property, if one does.
        interface: Option<Expected>,
    },
    /// Messages that come into the mailbox at [`RemotePath::place`] of the board are to be sent there.
    Messages,
}

/// When values are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// When they are there, but not earlier than so many nanoseconds after the one before.
    OnChange(u64),
    /// The newest one, once in so many nanoseconds.
    Every(u64),
}

impl Pace {
    /// The one that brings values sooner.
    fn faster(self, other: Self) -> Self {
        let wait = |pace| match pace {
            Self::OnChange(interval) => (interval, false),
            Self::Every(period) => (period, true),
        };
        if wait(other) < wait(self) { other } else { self }
    }
}

impl Want {
    /// What serves both: what the one that wants more does.
    pub(crate) fn and(&self, other: &Self) -> Self {
        match (self, other) {
            (
                &Self::Values { reliable, pace, compression, every, interface },
                &Self::Values {
                    reliable: also_reliable,
                    pace: other_pace,
                    compression: other_compression,
                    every: other_every,
                    interface: other_interface,
                },
            ) => Self::Values {
                reliable: reliable || also_reliable,
                pace: pace.faster(other_pace),
                compression: finer(compression, other_compression),
                every: every.max(other_every),
                interface: interface.or(other_interface),
            },
            (Self::Messages, other) => other.clone(),
            (one, Self::Messages) => one.clone(),
        }
    }
}

/// The compression that loses less.
fn finer(one: Compression, other: Compression) -> Compression {
    let loss = |compression| match compression {
        Compression::None => 0,
        Compression::Lossless => 1,
        Compression::Jpeg(quality) => 102 - u32::from(quality.min(100)),
    };
    if loss(other) < loss(one) { other } else { one }
}

/// The interface of a port. Those of one schema are equal.
#[derive(Clone, Copy, Debug)]
pub struct Expected(pub &'static Descriptor);

impl PartialEq for Expected {
    fn eq(&self, other: &Self) -> bool {
        self.0.hash == other.0.hash
    }
}

impl Eq for Expected {}

/// How something that is wanted stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Standing {
    /// There is no property of it on the board yet, or no longer.
    Absent {
        /// Why, in words.
        reason: String,
    },
    /// Its values come, or its messages go.
    Served {
        /// The path of the property in the other agent; what the link names beyond it is a field.
        property: String,
    },
    /// The property is on the board, and its values have ceased to come.
    Silent {
        /// The path of the property in the other agent.
        property: String,
        /// Why, in words.
        reason: String,
    },
}

/// What sharing gets from its agent.
pub struct Site {
    /// The agent's board.
    pub board: Arc<Board>,
    /// Where others find this agent; nowhere unless said.
    pub listen: Vec<String>,
    /// Where other agents are found, if not at `local:NAME`.
    pub agents: BTreeMap<String, String>,
    /// What the agent shares of its knowledge; nothing when it takes no part in a team.
    pub knowledge: Option<SharedKnowledge>,
    /// How it knows others and what they may do; every client may do all unless it says otherwise.
    pub security: Option<ShareSecurity>,
    /// The time that the agent's values carry, nanoseconds; in lockstep it goes by the simulation.
    pub time: Arc<dyn Fn() -> u64 + Send + Sync>,
    /// A clock that goes on steadily, nanoseconds; the same as `time` when the agent is not in lockstep.
    pub steady: Arc<dyn Fn() -> u64 + Send + Sync>,
    /// Is notified when messages are in a mailbox; the sharing notifies it when values came.
    pub wake: Arc<Wake>,
    /// Where the sharing reports what is there.
    pub host: SharingHost,
}

impl std::fmt::Debug for Site {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Site")
            .field("listen", &self.listen)
            .field("agents", &self.agents)
            .finish_non_exhaustive()
    }
}

/// The threads that wait for values of other agents.
pub(crate) type Readers = Arc<Mutex<Vec<Arc<Wake>>>>;

/// An agent, as far as what shares for it has something to tell it.
pub(crate) trait SharingAgent: Send + Sync {
    /// How something that is wanted of another agent stands from now on.
    fn remote_stands(&self, path: &RemotePath, standing: Standing);

    /// Logs a line.
    fn log(&self, level: Level, text: &str);
}

/// The agent, as the sharing sees it.
#[derive(Clone)]
pub struct SharingHost {
    agent: Arc<dyn SharingAgent>,
    after_tick: Arc<WriteListeners>,
    readers: Readers,
}

impl std::fmt::Debug for SharingHost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("SharingHost")
    }
}

impl SharingHost {
    pub(crate) fn new(
        agent: Arc<dyn SharingAgent>,
        after_tick: Arc<WriteListeners>,
        readers: Readers,
    ) -> Self {
        Self { agent, after_tick, readers }
    }

    /// Adds what is called when the agent has written values.
    pub fn after_tick(&self, call: AfterTick) {
        // It is the first that is added, so there is room.
        let _ = self.after_tick.add(call);
    }

    /// Says how something that is wanted stands; modules are linked to it, or wait for it. This waits for the main loop,
    /// so it is for a thread that nobody waits for.
    pub fn report(&self, path: &RemotePath, standing: Standing) {
        self.agent.remote_stands(path, standing);
    }

    /// Values came: wakes the modules with threads that read some of another agent.
    pub fn news(&self) {
        let readers = self.readers.lock().unwrap_or_else(PoisonError::into_inner);
        readers.iter().for_each(|wake| wake.notify(1));
    }

    /// Logs a line.
    pub fn log(&self, level: Level, text: &str) {
        self.agent.log(level, text);
    }
}

/// The clocks that an agent shares by: that of its values, and a steady one.
pub(crate) fn clocks(clock: &Arc<Clock>) -> [Arc<dyn Fn() -> u64 + Send + Sync>; 2] {
    let (time, steady) = (Arc::clone(clock), Arc::clone(clock));
    [Arc::new(move || time.now()), Arc::new(move || steady.at(monotonic()))]
}
