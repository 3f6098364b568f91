use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use slate_interfaces::{Image, ImageFormat};
use slate_module::aspect::{Aspect, Provider, Stop, Threads};
use slate_module::blackboard::channel::Writer;
use slate_module::prelude::*;

use crate::camera::{CAMERAS, Camera, Cameras};
use crate::pattern;
use crate::pgm::{self, Pgm};
use crate::report::{CameraReport, CameraState};
use crate::service::Vision;
use crate::source::{Files, ImageSource};

/// Ports of [`VisionMaster`].
#[ports]
pub struct VisionMasterIo {
    /// Cameras.
    vision: Provider<Vision>,
    threads: Aspect<Threads>,
    /// Newest picture of the first camera, up to 1 MiB.
    #[capacity(1_048_576)]
    image: Debug<Image>,
    /// Newest picture of the second camera.
    #[capacity(1_048_576)]
    image_2: Debug<Image>,
    /// Newest picture of the third camera.
    #[capacity(1_048_576)]
    image_3: Debug<Image>,
    /// Newest picture of the fourth camera.
    #[capacity(1_048_576)]
    image_4: Debug<Image>,
    /// Reports of the cameras.
    cameras: Output<CameraReport>,
}

/// Number of cameras with published pictures.
const SHOWN: usize = 4;

/// Owns the cameras, and provides the service [`Vision`].
///
/// Test patterns are drawn in its tick, so they are equal in all lockstep runs; a thread per camera reads files. Modules see a new picture
/// from its tick on, so a recording has all pictures that they saw.
pub struct VisionMaster;

/// State of [`VisionMaster`]. Cameras are not saved: the next request opens them.
#[derive(Default, Serialize, Deserialize)]
pub struct VisionMasterState {
    #[serde(skip)]
    cameras: Option<OpenCameras>,
}

/// Cameras and their drivers.
struct OpenCameras {
    cameras: Arc<Cameras>,
    /// Driver of each camera, in their order.
    drivers: Vec<Driver>,
    /// Report of each camera.
    states: Vec<CameraState>,
    /// Number of the newest published picture of each camera.
    shown: [u64; SHOWN],
}

enum Driver {
    /// Test pattern, drawn when due.
    Pattern { writer: Writer, due: u64 },
    /// Thread of this name.
    Thread(String),
    /// None.
    Off,
}

#[module(stage = SensorAcquire)]
impl Module for VisionMaster {
    type Io = VisionMasterIo;
    type Params = ();
    type State = VisionMasterState;

    fn tick(state: &mut VisionMasterState, io: &VisionMasterIo, _: &(), now: &Tick) -> Outcome {
        if !io.vision.is_provided() {
            state.cameras = None;
        }
        let open = state.cameras.get_or_insert_with(|| {
            // Threads of cameras that are forgotten end, and new ones of their names begin after that.
            (0..CAMERAS).for_each(|number| io.threads.stop(&thread_name(number)));
            let cameras = Arc::new(Cameras::default());
            // SAFETY: the owner beside it keeps the cameras.
            let vision = unsafe { Vision::new(&cameras) };
            io.vision.provide(vision, Arc::clone(&cameras));
            OpenCameras { cameras, drivers: Vec::new(), states: Vec::new(), shown: [0; SHOWN] }
        });
        let cameras = Arc::clone(&open.cameras);
        let mut has_news = false;
        for (number, camera) in cameras.iter().enumerate() {
            if number == open.drivers.len() {
                let mut state = CameraState { camera: Text::new(camera.text()), ..CameraState::default() };
                open.drivers.push(Driver::new(number, camera, &mut state));
                open.states.push(state);
                has_news = true;
            }
            let before = open.states[number];
            open.drivers[number].tick(camera, io, now, &mut open.states[number]);
            has_news |= open.states[number] != before;
        }
        if has_news {
            io.cameras.set(CameraReport { cameras: Sequence::new(&open.states) });
        }
        open.show(io);
        Outcome::Ok
    }
}

fn thread_name(camera: usize) -> String {
    format!("camera-{camera}")
}

impl Driver {
    fn new(number: usize, camera: &Camera, state: &mut CameraState) -> Self {
        match camera.source {
            ImageSource::Pattern { width, height, .. } => {
                match camera.channel(width as usize * height as usize).writer() {
                    Ok(writer) => Self::Pattern { writer, due: 0 },
                    Err(error) => {
                        fail(camera, &mut error.to_string(), state);
                        Self::Off
                    }
                }
            }
            ImageSource::Files { .. } => Self::Thread(thread_name(number)),
        }
    }

    fn tick(&mut self, camera: &Arc<Camera>, io: &VisionMasterIo, now: &Tick, state: &mut CameraState) {
        match (self, &camera.source) {
            (Self::Pattern { writer, due }, ImageSource::Pattern { width, height, rate })
                if now.now() >= *due =>
            {
                *due = (now.now() / rate.period() + 1) * rate.period();
                let size = *width as usize * *height as usize;
                write(writer, size, now.now(), |image| {
                    pattern::draw(image, *width, *height, now.seconds());
                });
                note_image(writer, now.now(), now, state);
            }
            (Self::Thread(name), ImageSource::Files { files, rate }) => {
                camera.handover.take(|content| match (&mut content.result, &mut content.writer) {
                    (Ok((items, time)), Some(writer)) => {
                        // No reader of these pictures can hold their writer up.
                        let _ = writer.publish(*items, *time);
                        camera.work();
                        state.problem = Text::default();
                        note_image(writer, *time, now, state);
                    }
                    (Err(problem), _) => fail(camera, problem, state),
                    (Ok(_), None) => {}
                });
                if io.threads.is_running(name) {
                    return;
                }
                let (camera, files, period) =
                    (Arc::clone(camera), files.clone(), Duration::from_nanos(rate.period()));
                let spawned = io.threads.spawn(name, move |stop| read_files(stop, &camera, &files, period));
                if let Err(refusal) = spawned {
                    now.error(format_args!("{refusal}"));
                }
            }
            _ => {}
        }
    }
}

/// Reports the failure of a camera, if it is new.
fn fail(camera: &Camera, problem: &mut String, state: &mut CameraState) {
    state.problem = Text::new(problem);
    camera.fail(problem);
}

/// Reports a new picture.
fn note_image(writer: &Writer, taken: u64, now: &Tick, state: &mut CameraState) {
    (state.picture, state.taken, state.came) = (writer.last().sequence, taken, now.now());
}

impl OpenCameras {
    /// Publishes new pictures of the first cameras.
    fn show(&mut self, io: &VisionMasterIo) {
        let images = [&io.image, &io.image_2, &io.image_3, &io.image_4];
        // SAFETY: the cameras stay during this call.
        let vision = unsafe { Vision::new(&self.cameras) };
        for ((camera, image), shown) in self.cameras.iter().zip(images).zip(&mut self.shown) {
            let Ok(Some(picture)) = vision.capture(camera.text()) else { continue };
            let number = picture.stamp().sequence;
            if *shown != number && image.write(picture.data.len(), |image| copy(&picture, image)) {
                *shown = number;
            }
        }
    }
}

/// Copies an image of the same size.
pub(crate) fn copy(from: &Image, to: &mut Image) {
    to.width = from.width;
    to.height = from.height;
    to.step = from.step;
    to.format = from.format;
    to.data.copy_from_slice(&from.data);
}

/// Writes an image with a number of bytes of pixels.
pub(crate) fn write(writer: &mut Writer, bytes: usize, now: u64, draw: impl FnOnce(&mut Image)) {
    fill(writer, bytes, draw);
    // No reader of these pictures can hold their writer up.
    let _ = writer.publish(bytes, now);
}

/// Draws the next image into a draft, with a number of bytes of pixels.
fn fill(writer: &mut Writer, bytes: usize, draw: impl FnOnce(&mut Image)) {
    let mut draft = writer.draft();
    assert!(bytes <= draft.capacity(), "the caller has checked the capacity");
    // SAFETY: the draft has room for that many bytes, all of them initialized, and is not shared.
    draw(unsafe { Image::from_raw_mut(draft.as_mut_ptr(), bytes) });
}

/// Runs a thread that reads files.
fn read_files(stop: &Stop, camera: &Camera, files: &Files, period: Duration) {
    let mut number = 0;
    while stop.wait(period) {
        let path = files.path(number);
        let bytes = std::fs::read(&path);
        if bytes.is_err() && files.are_numbered() && number > 1 {
            // After the last one.
            number = 0;
            continue;
        }
        if bytes.is_err() && files.are_numbered() && number == 0 && files.path(1).exists() {
            number = 1;
            continue;
        }
        let picture = match &bytes {
            Ok(bytes) => pgm::read(bytes).map_err(|problem| format!("{} {problem}", path.display())),
            Err(error) => Err(format!("{}: {error}", path.display())),
        };
        let now = stop.now();
        camera.handover.fill(|writer| Ok((take(camera, writer, &path, &picture?)?, now)));
        number += u64::from(files.are_numbered());
    }
}

/// Reads the picture of a file; returns the size of its pixels, bytes.
fn take(
    camera: &Camera,
    writer: &mut Option<Writer>,
    path: &Path,
    picture: &Pgm<'_>,
) -> Result<usize, String> {
    let size = picture.pixels.len();
    let channel = camera.channel(size);
    if channel.shape().capacity < size {
        return Err(format!(
            "{} has {size} pixels, and the first picture of its camera had {}",
            path.display(),
            channel.shape().capacity
        ));
    }
    let writer = match writer {
        Some(writer) => writer,
        none => none.insert(channel.writer().map_err(|error| format!("{}: {error}", path.display()))?),
    };
    fill(writer, size, |image| {
        image.width = picture.width;
        image.height = picture.height;
        image.step = picture.width;
        image.format = ImageFormat::MONO8;
        image.data.copy_from_slice(picture.pixels);
    });
    Ok(size)
}
