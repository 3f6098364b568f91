use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_interfaces::Image;
use slate_module::aspect::Provider;
use slate_module::blackboard::channel::Writer;
use slate_module::prelude::*;

use crate::camera::{CAMERAS, Camera, Cameras};
use crate::report::{CameraReport, CameraState};
use crate::service::Vision;
use crate::vision_master::copy;

/// Ports of [`VisionPlayer`].
/// They are outputs of a recorded [`VisionMaster`](crate::VisionMaster).
#[ports]
pub struct VisionPlayerIo {
    /// Cameras.
    vision: Provider<Vision>,
    cameras: Input<CameraReport>,
    image: Input<Image>,
    image_2: Input<Image>,
    image_3: Input<Image>,
    image_4: Input<Image>,
}

/// Player of recorded pictures as the service [`Vision`].
/// It replaces a vision master.
///
/// Vision modules run on a recording, with the same pictures in each cycle.
pub struct VisionPlayer;

/// State of [`VisionPlayer`].
#[derive(Default, Serialize, Deserialize)]
pub struct VisionPlayerState {
    #[serde(skip)]
    cameras: Option<Arc<Cameras>>,
    /// State of each camera.
    #[serde(skip)]
    shown: Vec<ImageOutput>,
}

#[derive(Default)]
struct ImageOutput {
    writer: Option<Writer>,
    /// Number of the newest picture.
    picture: u64,
}

#[module(stage = SensorAcquire)]
impl Module for VisionPlayer {
    type Io = VisionPlayerIo;
    type Params = ();
    type State = VisionPlayerState;

    fn tick(state: &mut VisionPlayerState, io: &VisionPlayerIo, _: &(), _: &Tick) -> Outcome {
        if !io.vision.is_provided() {
            state.cameras = None;
        }
        let cameras = Arc::clone(state.cameras.get_or_insert_with(|| {
            let cameras = Arc::new(Cameras::default());
            // SAFETY: the owner beside it keeps the cameras.
            let vision = unsafe { Vision::new(&cameras) };
            io.vision.provide(vision, Arc::clone(&cameras));
            state.shown = (0..CAMERAS).map(|_| ImageOutput::default()).collect();
            cameras
        }));
        let images = [&io.image, &io.image_2, &io.image_3, &io.image_4];
        let reported = io.cameras.get().map_or(&[][..], |report| &report.cameras[..]);
        for (number, (reported, shown)) in reported.iter().zip(&mut state.shown).enumerate() {
            // They were opened then, so they can be now.
            if let Ok(camera) = cameras.camera(reported.camera.as_str()) {
                shown.show(camera, reported, images.get(number).copied());
            }
        }
        Outcome::Ok
    }
}

impl ImageOutput {
    /// Publishes the report and newest picture of a camera.
    fn show(&mut self, camera: &Camera, reported: &CameraState, image: Option<&Input<Image>>) {
        if !reported.problem.as_str().is_empty() {
            return camera.fail(&mut reported.problem.as_str().to_owned());
        }
        // No other one than the newest is ever written there.
        let image = image.filter(|image| image.stamp().time >= reported.came).and_then(Input::get);
        let result = match image {
            _ if self.picture == reported.picture => return camera.work(),
            Some(image) => self.write(camera, reported, image),
            None => Err(format!(
                "picture {} of the camera `{}` is not recorded",
                reported.picture, reported.camera
            )),
        };
        match result {
            Ok(()) => camera.work(),
            Err(mut problem) => camera.fail(&mut problem),
        }
    }

    fn write(&mut self, camera: &Camera, reported: &CameraState, image: &Image) -> Result<(), String> {
        let channel = camera.channel(image.data.len());
        let writer = match &mut self.writer {
            Some(writer) => writer,
            none => none.insert(channel.writer().map_err(|error| error.to_string())?),
        };
        if image.data.len() > writer.capacity() {
            let (size, room) = (image.data.len(), writer.capacity());
            return Err(format!(
                "picture {} of the camera `{}` has {size} bytes, and its first one had {room}",
                reported.picture, reported.camera
            ));
        }
        // It has the number that it had then.
        writer.skip(reported.picture.saturating_sub(writer.last().sequence + 1));
        crate::vision_master::write(writer, image.data.len(), reported.taken, |own| copy(image, own));
        self.picture = reported.picture;
        Ok(())
    }
}
