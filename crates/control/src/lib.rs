//! One table of operations on an agent: what it shows, and what can be changed while it runs.
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
pub mod client;
mod connection;
mod context;
mod entries;
pub mod graph;
mod lease;
mod operation;
pub mod operations;
mod picture;
mod problem;
mod query;
mod repeats;
mod role;
mod schema;
mod select;
mod server;
mod service;
mod stream;
mod text;

pub use agent::{
    AgentControl, Done, LONGEST, PeerEntry, PeerList, ReadEntry, RecordingWish, RejectedEntry, ServedEntry,
    lacking,
};
pub use answer::{Answer, Body, json_response, response};
pub use client::{Client, ClientError};
pub use connection::{Guests, MOST_SOCKETS, PATIENCE, Patient, Place, Work};
pub use context::{Context, Document, Page};
pub use entries::{
    Changed, ControlsEntry, Different, HolderEntry, LinkEntry, LoadedPlugin, LoadedPlugins, Measured,
    ModuleEntry, News, PluginEntry, PropertyEntry, Reading, Refusal, Reloaded, RemoteSnapshotEntry, Saved,
    SetProperty, SettingEntry, SnapshotEntry, Spread, Switched, TraceEntry, TrackEntry, UnloadedPlugin,
    Watched,
};
pub use lease::LOOK;
pub use operation::{Ask, BASE, Caller, Operation, Pace, Parameter};
pub use problem::Problem;
pub use query::Query;
pub use role::Role;
pub use schema::{complete, of_interface};
pub use select::Selection;
pub use server::{OpenError, Server, lowered};
pub use service::{Found, Service, too_many};
pub use stream::{Follow, Sample, Watcher, What, apart};
