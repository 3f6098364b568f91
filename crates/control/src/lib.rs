//! Table of the operations on an agent: its state, and changes while it runs.
//!
//! [`operations::OPERATIONS`] has a name, a role, parameters, schemas and a handler for each. A [`Server`] serves them over
//! HTTP/1.1 on the agent's Unix socket, `$XDG_RUNTIME_DIR/slate/<agent>.sock`, which only its user may use; the console
//! serves the same table over TCP. A [`Client`] carries them out, and an OpenAPI document describes them.
//!
//! ```no_run
//! use slate_control::{Client, Server};
//! # fn run(agent: &slate_runtime::Agent) -> Result<(), Box<dyn std::error::Error>> {
//! // The agent's side; the socket exists as long as this lives.
//! let server = Server::open(agent)?;
//! // The tool's side, as a rule in another process.
//! let mut client = Client::connect(server.name())?;
//! for module in client.modules()? {
//!     println!("{} is {}", module.name, module.condition);
//! }
//! # Ok(())
//! # }
//! ```

mod agent;
mod answer;
mod changes;
pub mod client;
mod connection;
mod dispatcher;
mod entries;
mod frames;
pub mod graph;
mod lease;
mod operation;
pub mod operations;
mod picture;
mod problem;
mod query;
mod repeats;
mod reserve;
mod role;
mod route;
mod schema;
mod select;
mod server;
mod stream;
mod surface;
mod text;

pub use agent::{
    AgentControl, Done, MAX_CALL_DURATION, PeerEntry, PeerList, ReadEntry, RecordingRequest, RejectedEntry,
    ServedEntry, missing_fields,
};
pub use answer::{OperationAnswer, ResponseBody, json_response, response};
pub use client::{Client, ClientError};
pub use connection::{
    BusyConnection, ConnectionEnd, ConnectionSlot, Connections, MAX_SOCKETS, TimedStream, WRITE_TIMEOUT,
};
pub use dispatcher::{Dispatcher, OperationTurn};
pub use entries::{
    ControlsEntry, EnableResult, HolderEntry, LinkEntry, LoadedPlugin, LoadedPlugins, ModuleDocumentation,
    ModuleEntry, ParameterDocumentation, PluginEntry, PortDocumentation, PropertyEntry, RateMeasurement,
    Reading, Refusal, ReloadedPlugin, RemoteSnapshotEntry, SavedSettings, SettingChange, SettingDifference,
    SettingEntry, SnapshotEntry, Spread, TraceEntry, TrackEntry, UnloadedPlugin, ValueUpdate, Watched,
};
pub use frames::{TransformStream, frames, is_transform};
pub use lease::LEASE_CHECK_PERIOD;
pub use operation::{
    BASE, Caller, MatchedOperation, Operation, OperationRequest, Pace, Parameter, without_slash,
};
pub use problem::Problem;
pub use query::Query;
pub use reserve::DescriptorReserve;
pub use role::Role;
pub use route::PathParts;
pub use schema::{complete, of_interface};
pub use select::Selection;
pub use server::{OpenError, Server, TRACE_END_TIMEOUT, lower_role, with_caller_name};
pub use stream::{Sample, StreamContent, ValueStream, Watcher, offload};
pub use surface::{ControlSurface, Document, Page};
