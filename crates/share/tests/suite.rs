//! All tests of the crate that share a process, in one program: each program costs link time.
#![allow(clippy::duplicate_mod, reason = "each carrier has to do the same")]

mod agents;
mod certificates;
mod clocks;
mod common;
mod facts;
mod knowledge;
mod links;
mod messages;
mod network;
mod options;
mod peers;
mod questions;
mod rights;
mod security;
mod simulation;
mod statements;
mod tls;
mod told;
mod topics;
