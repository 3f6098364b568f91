//! All tests of the crate that share a process, in one program: each program costs link time.

mod batch;
mod beside;
mod common;
mod page;
mod plots;
mod report;
mod trajectory;
