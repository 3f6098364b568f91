//! All tests of the crate that share a process, in one program: each program costs link time.

#[path = "replay/main.rs"]
mod replay;
