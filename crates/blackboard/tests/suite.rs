//! All tests of the crate that share a process, in one program: each program costs link time.
#![cfg(not(any(loom, feature = "shuttle")))]

mod adopt;
mod arena;
mod board;
mod come_and_go;
mod interface;
mod lender;
mod many_readers;
mod memory;
mod model;
mod pattern;
mod sample;
mod skipping;
mod snapshot;
