//! All tests of the crate that share a process, in one program: each program costs link time.

#[path = "faults/main.rs"]
mod faults;
mod go_to_origin;
mod pioneer;
mod published;
mod robot;
