//! Values as messages of ROS.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]
#![allow(missing_docs, reason = "the interfaces here are read by nobody")]

mod codec;
mod decode;
mod definition;

mod described;
mod files;
mod interfaces;
mod ros1;
mod schema;
mod shown;
mod standard;
