use serde::{Deserialize, Serialize};
use slate_module::aspect::Aspect;
use slate_module::prelude::*;

use crate::blob::Search;
use crate::service::Vision;

/// Brightest blob in a camera's picture.
#[interface]
#[derive(PartialEq)]
pub struct Blob {
    /// Center, from the left.
    #[unit("px")]
    pub x: f64,
    /// Center, from the top.
    #[unit("px")]
    pub y: f64,
    /// Brightness of the brightest pixel, 0 to 1.
    pub brightness: f64,
    /// Capture time, the agent's time.
    #[unit("ns")]
    pub time: u64,
    /// Area; 0 for a black picture.
    #[unit("px")]
    pub pixels: u32,
}

/// Ports of [`BlobFinder`].
#[ports]
pub struct BlobFinderIo {
    vision: Aspect<Vision>,
    /// Blob of the newest picture.
    blob: Output<Blob>,
}

/// Parameters of [`BlobFinder`].
#[params]
pub struct BlobFinderParams {
    #[param(default = "pattern:320x240@30", doc = "the camera, such as `file:/data/%04d.pgm@10`")]
    camera: Text<124>,
    #[param(default = 0.75, range = 0.0..=1.0, doc = "threshold of the blob's pixels, as a fraction of its brightest")]
    min_brightness: f64,
}

/// Detects the brightest blob in a camera's pictures.
pub struct BlobFinder;

/// State of [`BlobFinder`].
#[derive(Default, Serialize, Deserialize)]
pub struct BlobFinderState {
    /// Number and time of the newest picture.
    last: (u64, u64),
    #[serde(skip)]
    search: Search,
}

#[module(stage = SensorProcess)]
impl Module for BlobFinder {
    type Io = BlobFinderIo;
    type Params = BlobFinderParams;
    type State = BlobFinderState;

    fn tick(
        state: &mut BlobFinderState,
        io: &BlobFinderIo,
        params: &BlobFinderParams,
        now: &Tick,
    ) -> Outcome {
        let picture = match io.vision.capture(params.camera.as_str()) {
            Ok(Some(picture)) => picture,
            Ok(None) => return Outcome::Ok,
            Err(refusal) => {
                now.warn(format_args!("{refusal}"));
                return Outcome::Failed;
            }
        };
        let stamp = picture.stamp();
        if state.last == (stamp.sequence, stamp.time) {
            return Outcome::Ok;
        }
        state.last = (stamp.sequence, stamp.time);
        let found = state.search.brightest(&picture, params.min_brightness);
        io.blob.set(Blob {
            x: found.map_or(0.0, |found| found.x),
            y: found.map_or(0.0, |found| found.y),
            brightness: found.map_or(0.0, |found| found.brightness),
            time: stamp.time,
            pixels: found.map_or(0, |found| found.pixels),
        });
        Outcome::Ok
    }
}
