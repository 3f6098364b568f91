use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use slate_interfaces::{Image, ImageFormat};
use slate_module::aspect::{Aspect, Provider, Stop, Threads};
use slate_module::blackboard::channel::Writer;
use slate_module::prelude::*;

use crate::camera::{CAMERAS, Camera, Cameras};
use crate::service::Vision;
use crate::source::{Files, Source};
use crate::{pattern, pgm};

/// Ports of [`VisionMaster`].
#[ports]
pub struct VisionMasterIo {
    /// The cameras.
    vision: Provider<Vision>,
    threads: Aspect<Threads>,
    /// The newest picture of the camera that was asked for first; only of up to a mebibyte.
    #[capacity(1_048_576)]
    image: Debug<Image>,
}

/// Owns the cameras, and brings the service [`Vision`].
///
/// Pictures that are computed are made in its tick, so they are the same in every run in lockstep; files are read by a
/// thread for each camera.
pub struct VisionMaster;

/// State of [`VisionMaster`]. The cameras are no part of what is saved: they are opened again when somebody asks.
#[derive(Default, Serialize, Deserialize)]
pub struct VisionMasterState {
    #[serde(skip)]
    cameras: Option<Open>,
}

/// The cameras and what gives their pictures.
struct Open {
    cameras: Arc<Cameras>,
    /// For each camera in their order, how it is driven.
    drivers: Vec<Driver>,
    /// When the picture was taken that was shown last.
    shown: Option<u64>,
}

enum Driver {
    /// A picture is drawn when it is time.
    Pattern { writer: Writer, due: u64 },
    /// A thread of that name does it.
    Thread(String),
    /// Nothing does.
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
            io.vision.provide(Vision::new(&cameras), Arc::clone(&cameras));
            Open { cameras, drivers: Vec::new(), shown: None }
        });
        let cameras = Arc::clone(&open.cameras);
        for (number, camera) in cameras.iter().enumerate() {
            if number == open.drivers.len() {
                open.drivers.push(Driver::new(number, camera));
            }
            open.drivers[number].tick(camera, io, now);
        }
        open.show(io);
        Outcome::Ok
    }
}

fn thread_name(camera: usize) -> String {
    format!("camera-{camera}")
}

impl Driver {
    fn new(number: usize, camera: &Camera) -> Self {
        match camera.source {
            Source::Pattern { width, height, .. } => {
                match camera.channel(width as usize * height as usize).writer() {
                    Ok(writer) => Self::Pattern { writer, due: 0 },
                    Err(error) => {
                        camera.fail(error.to_string());
                        Self::Off
                    }
                }
            }
            Source::Files { .. } => Self::Thread(thread_name(number)),
        }
    }

    fn tick(&mut self, camera: &Arc<Camera>, io: &VisionMasterIo, now: &Tick) {
        match (self, &camera.source) {
            (Self::Pattern { writer, due }, Source::Pattern { width, height, rate }) if now.now() >= *due => {
                *due = (now.now() / rate.period() + 1) * rate.period();
                let size = *width as usize * *height as usize;
                write(writer, size, now.now(), |image| {
                    pattern::draw(image, *width, *height, now.seconds());
                });
            }
            (Self::Thread(name), Source::Files { files, rate }) if !io.threads.is_running(name) => {
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

impl Open {
    /// Shows the picture of the first camera, if it is a new one.
    fn show(&mut self, io: &VisionMasterIo) {
        let Some(camera) = self.cameras.iter().next() else { return };
        let vision = Vision::new(&self.cameras);
        let Ok(Some(picture)) = vision.capture(camera.text()) else { return };
        if self.shown == Some(picture.stamp().sequence) {
            return;
        }
        let written = io.image.write(picture.data.len(), |image| {
            image.width = picture.width;
            image.height = picture.height;
            image.step = picture.step;
            image.format = picture.format;
            image.data.copy_from_slice(&picture.data);
        });
        if written {
            self.shown = Some(picture.stamp().sequence);
        }
    }
}

/// Writes an image with so many bytes of pixels.
fn write(writer: &mut Writer, bytes: usize, now: u64, draw: impl FnOnce(&mut Image)) {
    let mut draft = writer.draft();
    if bytes > draft.capacity() {
        return;
    }
    // SAFETY: the draft has room for that many bytes, all of them initialised, and nobody else has it.
    draw(unsafe { Image::from_raw_mut(draft.as_mut_ptr(), bytes) });
    // No reader of these pictures can hold their writer up.
    let _ = writer.publish(bytes, now);
}

/// The life of a thread that reads files.
fn read_files(stop: &Stop, camera: &Camera, files: &Files, period: Duration) {
    let mut writer: Option<Writer> = None;
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
        let result = match &bytes {
            Ok(bytes) => take(camera, &mut writer, &path, bytes, stop.now()),
            Err(error) => Err(format!("{}: {error}", path.display())),
        };
        match result {
            Ok(()) => camera.work(),
            Err(problem) => camera.fail(problem),
        }
        number += u64::from(files.are_numbered());
    }
}

/// Takes a picture out of a file.
fn take(
    camera: &Camera,
    writer: &mut Option<Writer>,
    path: &Path,
    file: &[u8],
    now: u64,
) -> Result<(), String> {
    let picture = pgm::read(file).map_err(|problem| format!("{} {problem}", path.display()))?;
    let channel = camera.channel(picture.pixels.len());
    if channel.shape().capacity < picture.pixels.len() {
        return Err(format!(
            "{} has {} pixels, and the first picture of its camera had {}",
            path.display(),
            picture.pixels.len(),
            channel.shape().capacity
        ));
    }
    let writer = match writer {
        Some(writer) => writer,
        None => {
            let new = channel.writer().map_err(|error| format!("{}: {error}", path.display()))?;
            writer.insert(new)
        }
    };
    write(writer, picture.pixels.len(), now, |image| {
        image.width = picture.width;
        image.height = picture.height;
        image.step = picture.width;
        image.format = ImageFormat::MONO8;
        image.reserved = [0; 3];
        image.data.copy_from_slice(picture.pixels);
    });
    Ok(())
}
