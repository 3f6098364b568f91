//! Console of an agent over HTTP, on one port.
//! It has every property at its URL, live streams, teleoperation, an endpoint for Foxglove, and a page for browsers
//! (`web/`).
//!
//! A [`Console`] runs on a thread of its own with a low priority. It serves the operations of [`slate_control`], and looks at
//! values as tools do: no module ever waits for it. A client that requests
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

mod export;
mod guard;
mod pages;
mod reserve;
mod server;
mod settings;
mod socket;
mod token;

pub use export::{RecordedRun, RecordedSample, exported_page};
pub use server::{Console, StartError};
pub use settings::Settings;
pub use slate_control::{Document, Page, Role};

/// Name of its table at the top of a configuration.
pub const TABLE: &str = "console";
