//! Cameras for modules.
//!
//! [`VisionMaster`] owns the cameras and brings the service [`Vision`]; a module with the port
//! [`Aspect<Vision>`](slate_module::aspect::Aspect) gets the newest picture of a camera that it names by a text, such as
//! `pattern:640x480@30` (see [`Source`]). It runs only while a vision master provides the service, and the plugin of that
//! can't be unloaded while such a module is there. [`BlobFinder`] is one. On a recording a [`VisionPlayer`] takes the place of
//! the master.
//!
//! ```
//! use slate_module::aspect::Aspect;
//! use slate_module::prelude::*;
//! use slate_vision::Vision;
//!
//! #[ports]
//! pub struct Io {
//!     vision: Aspect<Vision>,
//! }
//!
//! /// Says how large the pictures are.
//! pub struct Viewer;
//!
//! #[module(stage = SensorProcess)]
//! impl Module for Viewer {
//!     type Io = Io;
//!     type Params = ();
//!     type State = ();
//!
//!     fn tick(_: &mut (), io: &Io, _: &(), now: &Tick) -> Outcome {
//!         match io.vision.capture("pattern:640x480@30") {
//!             Ok(Some(picture)) => now.info(format_args!("{} x {}", picture.width, picture.height)),
//!             Ok(None) => {} // not yet
//!             Err(refusal) => {
//!                 now.error(format_args!("{refusal}"));
//!                 return Outcome::Failed;
//!             }
//!         }
//!         Outcome::Ok
//!     }
//! }
//! # fn main() {}
//! ```
//! ```toml
//! [modules.vision_master]
//! [modules.viewer]
//! ```
#![allow(unsafe_code, reason = "a service is a table of C calls")]

mod blob;
mod blob_finder;
mod camera;
mod handover;
mod pattern;
mod pgm;
mod report;
mod service;
mod source;
mod vision_master;
mod vision_player;

pub use blob_finder::{Blob, BlobFinder, BlobFinderIo, BlobFinderParams, BlobFinderState};
pub use report::{CameraReport, CameraState};
pub use service::{Picture, Vision};
pub use source::{Files, Rate, Source, SourceError};
pub use vision_master::{VisionMaster, VisionMasterIo, VisionMasterState};
pub use vision_player::{VisionPlayer, VisionPlayerIo, VisionPlayerState};

slate_module::plugin!(VisionMaster, VisionPlayer, BlobFinder);
