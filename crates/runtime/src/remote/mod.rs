//! An agent at a local socket, for tools: `slate plugin`, `slate module`, `slate config`, and whatever comes later.
//!
//! Each agent has a Unix stream socket, `$XDG_RUNTIME_DIR/slate/<agent>.sock`, in a folder that only its user may
//! enter; without that variable the folder is `slate-<uid>` among the temporary files. Both sides send one JSON value
//! a line. The agent begins with a [`Greeting`]; then it answers each [`Call`] with an [`Answer`], in order. Lines are
//! at most [`LINE_LIMIT`] bytes long. The console of an agent speaks the same over a WebSocket, each value a message.
//!
//! ```text
//! < {"slate":1,"agent":"exp1"}
//! > {"call":"config/set","changes":[["robots.r2.modules.planner.params.speed","0.3"]]}
//! < {"result":[{"after":"0.3","before":"0.4","path":"modules.\"r2/planner\".params.speed"}]}
//! > {"call":"read","url":"/r2/planner/params/sped"}
//! < {"error":{"message":"...","help":"..."}}
//! ```
//!
//! ```no_run
//! use slate_runtime::remote::{Client, Server};
//! # fn run(agent: &slate_runtime::Agent) -> Result<(), Box<dyn std::error::Error>> {
//! // The agent's side; the socket is there as long as this lives.
//! let server = Server::open(agent)?;
//! // The tool's side, in another process as a rule.
//! let mut client = Client::connect(server.name())?;
//! for module in client.modules()? {
//!     println!("{} is {}", module.name, module.condition);
//! }
//! # Ok(())
//! # }
//! ```

mod client;
mod desk;
mod elsewhere;
mod line;
mod lock;
mod messages;
mod own;
mod peers;
mod place;
mod properties;
mod protocol;
mod server;
mod settings;
mod trace;
mod values;
mod visit;
mod wire;

pub use client::{Client, ClientError};
pub use desk::Desk;
pub use lock::Lock;
pub use messages::lacking;
pub use peers::{PeerEntry, PeerList, ReadEntry, RejectedEntry, ServedEntry};
pub use place::{agents, check_reach, folder};
pub use protocol::{
    Answer, Call, Changed, ControlsEntry, Different, Greeting, HolderEntry, LINE_LIMIT, LinkEntry,
    LoadedPlugin, LoadedPlugins, Measured, ModuleEntry, News, PluginEntry, PropertyEntry, Reading, Refusal,
    Reloaded, RemoteSnapshotEntry, Saved, SetProperty, SettingEntry, SnapshotEntry, Spread, Switched,
    TraceEntry, TrackEntry, UnloadedPlugin, VERSION, Watched,
};
pub use server::{OpenError, Server};
pub use values::LONGEST;
pub use visit::Visit;
pub use wire::Wire;
