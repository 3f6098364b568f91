//! Interface between the runtime and the transport of values between agents.
//! The runtime states its demand, and the transport reports the available properties and mailboxes.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use slate_blackboard::interface::{AccessError, Descriptor, Value, View, find};
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, Board, Stamp};
use slate_module::Level;
use slate_sorted::{SortedMap, SortedSet};

pub use slate_composition::RemotePath;
pub use slate_configuration::{Compression, TEAM, is_topic};
use slate_configuration::{Configuration, Diagnostic, Report, ShareSecurity, SharedKnowledge};
use slate_engine::clock::{Clock, monotonic};
pub use slate_engine::main_loop::AfterTick;
use slate_engine::main_loop::WriteListeners;

/// Transport of values and messages between agents.
/// It has threads of its own: none of these calls waits for another agent, and dropping it ends them.
pub trait Sharing: Send {
    /// Starts sharing.
    /// Called once, before any other call, and only for agents that share.
    ///
    /// # Errors
    /// When it can't listen at an endpoint, or the agent's protection can't be set up.
    fn start(&mut self, site: Site) -> Result<(), SharingError>;

    /// Sets this agent's demand from other agents.
    /// It replaces the earlier demand.
    fn set_demands(&mut self, demands: SortedMap<RemotePath, RemoteDemand>);

    /// Schemes of endpoints that can carry values, such as `local`.
    /// Any name is valid if the set is empty.
    fn carriers(&self) -> SortedSet<String> {
        SortedSet::new()
    }

    /// True if values can be compressed as JPEG.
    fn has_jpeg(&self) -> bool {
        true
    }

    /// The agent's part in its team's knowledge; `None` if it takes no part.
    fn team(&self) -> Option<Arc<dyn TeamExchange>> {
        None
    }

    /// Inspection of other agents for tools; `None` if it is not supported.
    fn inspection(&self) -> Option<Arc<dyn Inspection>> {
        None
    }
}

/// An agent's part in its team's knowledge, for additional networks.
/// Such networks reach other robots beside the sharing itself.
///
/// Messages may be lost, duplicated and reordered: later ones correct this. None of these calls waits.
pub trait TeamExchange: Send + Sync {
    /// Sets the carrier of messages for other robots, beside the sharing itself.
    /// It replaces the earlier one; `None` removes it.
    fn set_carrier(&self, carrier: Option<Arc<dyn TeamCarrier>>);

    /// Notes that the carrier reaches a robot.
    fn meet(&self, robot: &str);

    /// Notes that the carrier no longer reaches a robot.
    fn part(&self, robot: &str);

    /// Receives a message of a robot.
    /// The caller must authenticate the robot if that matters.
    fn receive(&self, robot: &str, message: Vec<u8>);
}

/// Carrier of a team's messages.
pub trait TeamCarrier: Send + Sync {
    /// Sends a message to a robot without waiting; false if it is lost already.
    fn send(&self, robot: &str, message: &[u8]) -> bool;
}

/// Inspection of other agents.
/// Several threads may call it at once, and it blocks no module.
pub trait Inspection: Send + Sync {
    /// Lists the properties of another agent that match a pattern.
    /// With `values` it includes their newest values. It waits no longer than `limit`.
    ///
    /// # Errors
    /// In words, when the agent is unknown, absent or does not answer.
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
    /// Documentation of the property.
    pub doc: String,
    /// Writer.
    pub access: Access,
    /// Type.
    pub descriptor: &'static Descriptor,
    /// Capacity of the tail, in items.
    pub capacity: u64,
    /// Number of values kept; 0 for a mailbox.
    pub depth: u32,
    /// True if it has a writer now.
    pub has_writer: bool,
    /// Newest value, if requested.
    pub newest: Newest,
}

/// Newest value of a property, as another agent answers it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Newest {
    /// No value yet, or the value was not requested.
    Unwritten,
    /// Bytes, number of items in the tail, and the other agent's stamp.
    /// The bytes are not decoded, as the decoded value takes far more memory.
    Value(Vec<u8>, usize, Stamp),
    /// Too large for an answer; the size is in bytes.
    TooLarge(u64),
    /// Not readable for this agent.
    NotAllowed,
}

/// Error of reading a value of another agent.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unread {
    /// Unknown field.
    #[error("{0}")]
    Field(#[from] AccessError),
    /// Mailbox, which has no value.
    #[error("it takes messages, and has no value")]
    Messages,
    /// Too large for an answer; the size is in bytes.
    #[error("its newest value has {0} bytes, too many for an answer; links carry it")]
    TooLarge(u64),
    /// Not readable for this agent, by the other agent's permissions.
    #[error("the other agent does not let this one read it")]
    NotAllowed,
}

impl RemoteProperty {
    /// Newest value, or a field of it; `None` before the first write.
    ///
    /// # Errors
    /// When the field is unknown, or the other agent does not send the value.
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

/// Error of starting to share.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct SharingError {
    /// Message.
    pub message: String,
    /// Remedy, if the message does not contain it.
    pub help: Option<String>,
    /// Part of `[share]` that the error is about.
    pub about: About,
}

impl SharingError {
    /// Returns the report of the error, at its place in the configuration.
    pub fn report(self, configuration: &Configuration) -> Report {
        let Self { message, help, about } = self;
        let Some(share) = configuration.share() else {
            return Diagnostic::without_place(message, help).into();
        };
        let credentials = share.security.as_ref().and_then(|security| security.credentials.as_ref());
        let listen =
            share.listen.iter().find(|at| matches!(&about, About::Listen(endpoint) if *endpoint == at.value));
        let place = match &about {
            About::Sharing | About::Listen(_) => listen.map(|at| at.span),
            About::Agent(name) => share.agents.get(name).map(|at| at.span),
            About::Security => share.security.as_ref().map(|security| security.place),
            About::Certificate => credentials.map(|credentials| credentials.certificate.span),
            About::Key => credentials.map(|credentials| credentials.key.span),
            About::Authority => credentials.map(|credentials| credentials.authority.span),
        };
        // An agent is found under its own name when no endpoint is written, and then there is no place to show.
        let usual = configuration.value("share.listen").is_none();
        let is_shown = |place: &_| !usual || share.listen.iter().all(|at| at.span != *place);
        match place.or_else(|| share.listen.first().map(|at| at.span)).filter(is_shown) {
            Some(place) => configuration.diagnostic(place, message, help).into(),
            None => Diagnostic::without_place(message, help).into(),
        }
    }
}

impl From<String> for SharingError {
    fn from(message: String) -> Self {
        Self { message, help: None, about: About::Sharing }
    }
}

/// Part of `[share]` that an error is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum About {
    /// The whole section.
    Sharing,
    /// An endpoint that this agent listens at.
    Listen(String),
    /// The endpoint of another agent.
    Agent(String),
    /// `[share.security]`.
    Security,
    /// Certificate in `[share.security]`.
    Certificate,
    /// Key in `[share.security]`.
    Key,
    /// Authority in `[share.security]`.
    Authority,
}

/// Demand for a property or a mailbox of another agent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RemoteDemand {
    /// Values of a property.
    /// A property of the same interface must be at [`RemotePath::mirror_path`] of the board, with the path of the whole
    /// property.
    Values {
        /// True if lost values are sent again.
        reliable: bool,
        /// Pace of sending.
        pace: Pace,
        /// Compression of the values.
        compression: Compression,
        /// Minimum queue depth if every value is wanted; `None` for the newest only.
        every: Option<usize>,
        /// Interface of a port that reads the whole property, if any.
        interface: Option<Expected>,
    },
    /// Messages from the mailbox at [`RemotePath::mirror_path`] of the board.
    /// They are sent to the other agent's mailbox.
    Messages,
}

/// Pace of sending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// On change, with this minimum interval between two values, ns.
    OnChange(u64),
    /// The newest value, with this period, ns.
    Every(u64),
}

impl Pace {
    /// Returns the pace that brings values sooner.
    fn faster(self, other: Self) -> Self {
        let wait = |pace| match pace {
            Self::OnChange(interval) => (interval, false),
            Self::Every(period) => (period, true),
        };
        if wait(other) < wait(self) { other } else { self }
    }
}

impl RemoteDemand {
    /// Returns the demand that satisfies both.
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

/// Returns the compression with the smaller loss.
fn finer(one: Compression, other: Compression) -> Compression {
    let loss = |compression| match compression {
        Compression::None => 0,
        Compression::Lossless => 1,
        Compression::Jpeg(quality) => 102 - u32::from(quality.min(100)),
    };
    if loss(other) < loss(one) { other } else { one }
}

/// Interface of a port; interfaces of one schema are equal.
#[derive(Clone, Copy, Debug)]
pub struct Expected(pub &'static Descriptor);

impl PartialEq for Expected {
    fn eq(&self, other: &Self) -> bool {
        self.0.hash == other.0.hash
    }
}

impl Eq for Expected {}

/// State of a demand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DemandState {
    /// The board has no property for it yet, or no longer.
    Absent {
        /// Reason.
        reason: String,
    },
    /// Values arrive, or messages are sent.
    Served {
        /// Path of the property in the other agent.
        /// The rest of the link's path is a field.
        property: String,
    },
    /// The property is on the board, but its values no longer arrive.
    Silent {
        /// The path of the property in the other agent.
        property: String,
        /// Reason.
        reason: String,
    },
}

/// The agent's resources for sharing.
pub struct Site {
    /// The agent's board.
    pub board: Arc<Board>,
    /// Endpoints that this agent listens at; may be empty.
    pub listen: Vec<String>,
    /// Endpoints of other agents, by name; the default is `local:NAME`.
    pub agents: SortedMap<String, String>,
    /// Knowledge that the agent shares; `None` outside of a team.
    pub knowledge: Option<SharedKnowledge>,
    /// Authentication and permissions; `None` allows every client everything.
    pub security: Option<ShareSecurity>,
    /// Clock of the agent's stamps, ns; in lockstep it is simulation time.
    pub time: Arc<dyn Fn() -> u64 + Send + Sync>,
    /// Monotonic clock, ns; the same as `time` if the agent is not in lockstep.
    pub steady: Arc<dyn Fn() -> u64 + Send + Sync>,
    /// Wake-up of the sharing when mailboxes have messages.
    /// The sharing notifies it when values arrive.
    pub wake: Arc<Wake>,
    /// Receiver of the sharing's reports.
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

/// Wakes of the threads that wait for values of other agents.
pub(crate) type Readers = Arc<Mutex<Vec<Arc<Wake>>>>;

/// Agent, as its sharing sees it.
pub(crate) trait SharingAgent: Send + Sync {
    /// Notes the state of a demand for another agent.
    fn set_demand_state(&self, path: &RemotePath, state: DemandState);

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

    /// Adds a callback after the agent has written values.
    pub fn after_tick(&self, call: AfterTick) {
        // It is the first that is added, so there is room.
        let _ = self.after_tick.add(call);
    }

    /// Reports the state of a demand; modules are linked to it, or wait for it.
    /// The call waits for the main loop, so it needs a thread that nothing waits for.
    pub fn report(&self, path: &RemotePath, state: DemandState) {
        self.agent.set_demand_state(path, state);
    }

    /// Wakes the modules with threads that read values of other agents.
    /// Called when values have arrived.
    pub fn news(&self) {
        let readers = self.readers.lock().unwrap_or_else(PoisonError::into_inner);
        readers.iter().for_each(|wake| wake.notify(1));
    }

    /// Logs a line.
    pub fn log(&self, level: Level, text: &str) {
        self.agent.log(level, text);
    }
}

/// Returns the clocks for sharing: that of the values, and a monotonic one.
pub(crate) fn clocks(clock: &Arc<Clock>) -> [Arc<dyn Fn() -> u64 + Send + Sync>; 2] {
    let (time, steady) = (Arc::clone(clock), Arc::clone(clock));
    [Arc::new(move || time.now()), Arc::new(move || steady.at(monotonic()))]
}
