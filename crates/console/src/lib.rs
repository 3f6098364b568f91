//! What an agent shows and takes over HTTP: every property at its URL, live streams, teleoperation, an endpoint for Foxglove,
//! and a page for browsers (`web/`), all on one port.
//!
//! A [`Console`] runs on a thread of its own with a low priority. It asks the same desk as the tools at the local socket
//! ([`Desk`](slate_runtime::remote::Desk)), and looks at values as tools do: no module ever waits for it. Whoever asks
//! slowly, or stops reading, is served slowly and then dropped.
//!
//! ```no_run
//! use slate_console::{Console, Settings};
//! # fn run(agent: &slate_runtime::Agent) -> Result<(), Box<dyn std::error::Error>> {
//! let settings = Settings::of(&agent.configuration())?;
//! // The agent is reached as long as this lives.
//! let console = Console::start(agent, &settings, Vec::new())?;
//! println!("{}", console.link());
//! # Ok(())
//! # }
//! ```

mod answer;
mod api;
mod connection;
mod context;
mod guard;
mod lease;
mod pages;
mod picture;
mod problem;
mod query;
mod reserve;
mod role;
mod route;
mod schema;
mod select;
mod server;
mod settings;
mod socket;
mod stream;
mod text;
mod token;

pub use context::{Document, Page};
pub use role::Role;
pub use server::{Console, StartError};
pub use settings::Settings;

/// The name of its table at the top of a configuration.
pub const TABLE: &str = "console";
