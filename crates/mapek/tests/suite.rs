//! All tests of the crate that share a process, in one program: each program costs link time.

mod actions;
mod attach;
mod blocks;
mod book;
mod builder;
mod common;
mod devices;
mod execute;
mod knowledge;
mod pipeline;
mod transmission;
mod traps;
