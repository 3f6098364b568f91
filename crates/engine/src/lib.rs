//! Run time of modules: main loop, threads, watchdog, single steps, isolation.
//! Also libraries of plugins, gates of actuators, clock and log.
//!
//! It knows no file of a configuration or of a snapshot, and no agent: an agent makes [runners](runner) from a
//! composition, passes them to the [main loop](main_loop), and is called through narrow traits, such as
//! [`RequestedChanges`](main_loop::RequestedChanges) and [`Playback`].
#![allow(unsafe_code, reason = "modules run behind a table of calls, over memory of the host")]

pub mod actuators;
mod aligned_memory;
mod background;
pub mod clock;
pub mod digest;
pub mod isolation;
mod library;
pub mod log;
pub mod main_loop;
mod playback;
pub mod plugin;
pub mod runner;
pub mod service;
mod setup_trial;
mod snapshot;
pub mod synchronization;
pub mod timing;

pub use background::{set_batch_scheduling, thread_name};
pub use playback::Playback;
pub use setup_trial::set_up;
pub use snapshot::{ActuatorSnapshot, Bytes, MailboxSnapshot, PropertySnapshot};
