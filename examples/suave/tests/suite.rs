//! The exemplar: its parts one by one, and missions under each manager.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod missions;
mod parts;
