//! All tests of the crate that share a process, in one program: each program costs link time.

mod common;
mod lease;
mod limits;
mod properties;
mod snapshot;
mod stop;
