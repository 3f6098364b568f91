//! Cameras for modules.
//!
//! [`VisionMaster`] owns the cameras and provides the service [`Vision`]. A module with the port
//! [`Aspect<Vision>`](slate_module::aspect::Aspect) reads the newest picture of a camera by a text such as `pattern:640x480@30` (see
//! [`ImageSource`]). It runs only while the service is provided, and keeps the master's plugin loaded. [`BlobFinder`] is an example. On a
//! recording, [`VisionPlayer`] replaces the master.
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
//! /// Logs the size of the pictures.
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

mod april_tag;
mod blob;
mod blob_finder;
mod camera;
mod camera_interface;
mod deblur;
mod detection;
mod feature_seeker;
mod feature_tracker;
mod handover;
mod image_processor;
mod pan_tilt_controller;
mod pattern;
mod pgm;
mod report;
mod service;
mod sharpness;
mod source;
mod victim_detector;
mod victim_saver;
mod vision_master;
mod vision_player;

pub use april_tag::{AprilTag, AprilTagDetector};
pub use blob_finder::{Blob, BlobFinder, BlobFinderIo, BlobFinderParams, BlobFinderState};
pub use camera_interface::{
    CameraInterface, CameraInterfaceIo, CameraInterfaceParams, CameraInterfaceState, CameraStatus,
};
pub use detection::{ImageDetection, ImageDetections, ImageSharpness, TerrainTexture};
pub use feature_seeker::{
    FeatureSeeker, FeatureSeekerIo, FeatureSeekerParams, FeatureSeekerState, SeekerMode,
};
pub use feature_tracker::{
    ExaminationResult, ExaminationSwitch, FeatureCandidate, FeatureTracker, FeatureTrackerIo,
    FeatureTrackerParams, FeatureTrackerState, FoundVictim, FoundVictims,
};
pub use image_processor::{ImageProcessor, ImageProcessorIo, ImageProcessorParams, ImageProcessorState};
pub use pan_tilt_controller::{PanTiltController, PanTiltControllerIo, PanTiltControllerParams};
pub use report::{CameraReport, CameraState};
pub use service::{Picture, Vision};
pub use source::{Files, ImageSource, Rate, SourceError};
pub use victim_detector::{VictimBox, VictimDetector};
pub use victim_saver::{VictimSaver, VictimSaverIo, VictimSaverParams, VictimSaverState};
pub use vision_master::{VisionMaster, VisionMasterIo, VisionMasterState};
pub use vision_player::{VisionPlayer, VisionPlayerIo, VisionPlayerState};

slate_module::plugin!(
    VisionMaster,
    VisionPlayer,
    BlobFinder,
    CameraInterface,
    ImageProcessor,
    FeatureSeeker,
    FeatureTracker,
    PanTiltController,
    VictimSaver,
);
