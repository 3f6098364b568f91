use serde::{Deserialize, Serialize};
use slate_interfaces::{CameraInfo, Image};
use slate_module::prelude::*;

/// Distance of the compared bytes; a sample shows a dark or repeated image.
const STRIDE: usize = 97;

/// Ports of [`CameraInterface`].
#[ports]
pub struct CameraInterfaceIo {
    /// Image of the driver.
    #[stale(after = "1s")]
    driver_image: Input<Image>,
    /// Calibration of the driver's camera.
    driver_info: Input<CameraInfo>,
    /// Image of the camera.
    #[capacity(921_600)]
    image: Output<Image>,
    /// Calibration of the camera.
    camera_info: Output<CameraInfo>,
    /// State of the images.
    status: Output<CameraStatus>,
}

/// State of the images of a camera.
#[interface]
#[derive(PartialEq)]
pub struct CameraStatus {
    /// Number of images.
    pub images: u64,
    /// True if no image has come for 1 s.
    pub has_stopped: Bool,
    /// True if the newest image equals the one before to the bit.
    pub is_frozen: Bool,
    /// True if the newest image is dark.
    pub is_dark: Bool,
}

/// Parameters of [`CameraInterface`].
#[params]
pub struct CameraInterfaceParams {
    #[param(default = 8.0, range = 0.0..=255.0, doc = "mean of the bytes of an image below which it is dark")]
    dark_below: f64,
}

/// Camera interface with the state of its images: OpenRDK's `cameraInterface`.
pub struct CameraInterface;

/// State of [`CameraInterface`].
#[derive(Default, Serialize, Deserialize)]
pub struct CameraInterfaceState {
    images: u64,
    /// Hash of a part of the newest image.
    newest: u64,
    /// Reported states: stopped, frozen, dark.
    reported: [bool; 3],
}

#[module(stage = SensorAcquire)]
impl Module for CameraInterface {
    type Io = CameraInterfaceIo;
    type Params = CameraInterfaceParams;
    type State = CameraInterfaceState;

    fn tick(
        state: &mut CameraInterfaceState,
        io: &CameraInterfaceIo,
        params: &CameraInterfaceParams,
        now: &Tick,
    ) -> Outcome {
        if let Some(info) = io.driver_info.updated() {
            io.camera_info.set(*info);
        }
        let [_, mut is_frozen, mut is_dark] = state.reported;
        let is_new = io.driver_image.is_new();
        if let Some(image) = io.driver_image.get().filter(|_| is_new) {
            let (hash, mean) = header_fields(&image.data);
            is_frozen = state.images > 0 && hash == state.newest;
            is_dark = mean < params.dark_below;
            (state.newest, state.images) = (hash, state.images + 1);
            if !io.image.copy(&io.driver_image) {
                now.error(format_args!(
                    "an image of {} x {} is too large: expected at most {} bytes",
                    image.width,
                    image.height,
                    io.image.capacity()
                ));
                return Outcome::Failed;
            }
        }
        let has_stopped = io.driver_image.get().is_some() && io.driver_image.fresh().is_none();
        let reported = [has_stopped, is_frozen, is_dark];
        if reported != state.reported {
            for (what, is) in ["has stopped", "repeats its image", "is dark"].iter().zip(reported) {
                if is {
                    now.warn(format_args!("the camera {what}"));
                }
            }
        }
        if is_new || reported != state.reported {
            io.status.set(CameraStatus {
                images: state.images,
                has_stopped: has_stopped.into(),
                is_frozen: is_frozen.into(),
                is_dark: is_dark.into(),
            });
        }
        state.reported = reported;
        if reported.contains(&true) { Outcome::Degraded } else { Outcome::Ok }
    }
}

/// Hash (FNV-1a) and mean of a part of the bytes of an image.
fn header_fields(data: &[u8]) -> (u64, f64) {
    let (mut hash, mut sum, mut count) = (0xcbf2_9ce4_8422_2325_u64, 0_u64, 0_u64);
    for byte in data.iter().step_by(STRIDE) {
        hash = (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
        (sum, count) = (sum + u64::from(*byte), count + 1);
    }
    (hash, if count == 0 { 0.0 } else { sum as f64 / count as f64 })
}
