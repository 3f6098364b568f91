//! All tests of the crate that share a process, in one program: each program costs link time.

#[path = "aspects/main.rs"]
mod aspects;
mod clock;
mod common;
#[path = "faults/main.rs"]
mod faults;
mod gate;
#[path = "links/main.rs"]
mod links;
mod lockstep;
#[path = "logging/main.rs"]
mod logging;
mod loop_aspects;
#[path = "loop_stages/main.rs"]
mod loop_stages;
#[path = "main_loop/main.rs"]
mod main_loop;
mod modes;
mod order;
mod plugin_control;
mod refusals;
mod scripted;
mod settings_aspect;
#[path = "snapshot/main.rs"]
mod snapshot;
#[path = "threads/main.rs"]
mod threads;
mod told;
mod tracing;
