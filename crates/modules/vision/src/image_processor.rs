use serde::{Deserialize, Serialize};
use slate_interfaces::{Image, ImageFormat};
use slate_module::math;
use slate_module::prelude::*;

use crate::april_tag::{AprilTag, AprilTagDetector};
use crate::deblur::{LONGEST, MotionDeblur};
use crate::detection::{ImageDetection, ImageDetections, ImageSharpness, TerrainTexture};
use crate::sharpness::Brightness;
use crate::victim_detector::VictimDetector;

/// Maximum number of detections of an image.
const MAX_DETECTIONS: usize = 16;

/// Ports of [`ImageProcessor`].
#[ports]
pub struct ImageProcessorIo {
    /// Image of a camera.
    image: Input<Image>,
    /// Detections in the newest image.
    detections: Output<ImageDetections>,
    /// Sharpness of the newest image.
    sharpness: Output<ImageSharpness>,
    /// Texture of the floor in the newest image.
    terrain: Output<TerrainTexture>,
}

/// Parameters of [`ImageProcessor`].
#[params]
pub struct ImageProcessorParams {
    #[param(default = true, doc = "detect victims")]
    victims: Bool,
    #[param(default = true, doc = "detect QR codes")]
    qr: Bool,
    #[param(default = true, doc = "detect AprilTags of the family 16h5")]
    april_tags: Bool,
    #[param(default = 0.3, range = 0.0..=1.0, doc = "minimum confidence of a detection")]
    min_confidence: f64,
    #[param(default = 0.0, range = 0.0..=LONGEST, unit = "px", doc = "length of the motion blur along the rows that is taken out before anything is looked for; none below 1")]
    deblur_length: f64,
}

/// Image processor: victims, QR codes, AprilTags, sharpness and floor texture.
/// It reads the images of a camera.
pub struct ImageProcessor;

/// State of [`ImageProcessor`].
#[derive(Default, Serialize, Deserialize)]
pub struct ImageProcessorState {
    /// Memory, without anything of the last image.
    #[serde(skip)]
    victims: VictimDetector,
    #[serde(skip)]
    tags: AprilTagDetector,
    #[serde(skip)]
    brightness: Brightness,
    #[serde(skip)]
    deblur: MotionDeblur,
    #[serde(skip)]
    found: Vec<ImageDetection>,
}

#[module(stage = SensorProcess)]
impl Module for ImageProcessor {
    type Io = ImageProcessorIo;
    type Params = ImageProcessorParams;
    type State = ImageProcessorState;

    fn tick(
        state: &mut ImageProcessorState,
        io: &ImageProcessorIo,
        params: &ImageProcessorParams,
        _: &Tick,
    ) -> Outcome {
        let Some(image) = io.image.get().filter(|_| io.image.is_new()) else { return Outcome::Ok };
        state.brightness.take(image);
        io.sharpness.set(ImageSharpness { laplacian_variance: state.brightness.laplacian_variance() });
        io.terrain.set(TerrainTexture { contrast: state.brightness.floor_contrast() });
        state.found.clear();
        let width = image.width as usize;
        let restored = state.deblur.restore(image, params.deblur_length);
        if params.victims.get() && image.format == ImageFormat::RGB8 {
            let found = match restored {
                Some(pixels) => state.victims.detect(width, pixels.chunks_exact(3 * width)),
                None => state.victims.detect(width, (0..image.height).map(|y| image.row(y))),
            };
            state.found.extend(found.iter().map(detection));
        }
        if let Some(pixels) = restored.filter(|_| params.qr.get()) {
            state.brightness.take_pixels(pixels);
        }
        if params.qr.get() {
            read_codes(&state.brightness, &mut state.found);
        }
        if params.april_tags.get() {
            let Brightness { width, height, pixels } = &state.brightness;
            state.found.extend(state.tags.detect(*width, *height, pixels).iter().map(tag_detection));
        }
        state.found.retain(|found| found.confidence >= params.min_confidence);
        state.found.truncate(MAX_DETECTIONS);
        let time = io.image.stamp().time;
        io.detections.set(ImageDetections { time, list: Sequence::new(&state.found) });
        Outcome::Ok
    }
}

fn detection(person: &crate::VictimBox) -> ImageDetection {
    let [left, top, right, bottom] = person.corners.map(|side| side as f64);
    ImageDetection {
        x: (left + right) / 2.0,
        y: (top + bottom) / 2.0,
        width: right - left + 1.0,
        height: bottom - top + 1.0,
        confidence: person.confidence(),
        label: Text::new("victim"),
    }
}

fn tag_detection(tag: &AprilTag) -> ImageDetection {
    let of = |axis: usize| tag.corners.map(|corner| corner[axis]);
    let least = |values: [f64; 4]| values.into_iter().fold(f64::INFINITY, math::min);
    let most = |values: [f64; 4]| values.into_iter().fold(f64::NEG_INFINITY, math::max);
    let [left, right] = [least(of(0)), most(of(0))];
    let [top, bottom] = [least(of(1)), most(of(1))];
    ImageDetection {
        x: (left + right) / 2.0,
        y: (top + bottom) / 2.0,
        width: right - left,
        height: bottom - top,
        confidence: tag.confidence,
        label: Text::new(&format!("tag {}", tag.number)),
    }
}

/// Adds the QR codes of an image that can be read.
fn read_codes(brightness: &Brightness, found: &mut Vec<ImageDetection>) {
    let Brightness { width, height, pixels } = brightness;
    if pixels.is_empty() {
        return;
    }
    let mut image =
        rqrr::PreparedImage::prepare_from_greyscale(*width, *height, |x, y| pixels[y * width + x]);
    for grid in image.detect_grids() {
        let Ok((_, text)) = grid.decode() else { continue };
        let of = |part: fn(&rqrr::Point) -> i32| grid.bounds.iter().map(part);
        let (xs, ys) = (of(|corner| corner.x), of(|corner| corner.y));
        let (left, right) = (xs.clone().min().unwrap_or(0), xs.max().unwrap_or(0));
        let (top, bottom) = (ys.clone().min().unwrap_or(0), ys.max().unwrap_or(0));
        found.push(ImageDetection {
            x: f64::from(left + right) / 2.0,
            y: f64::from(top + bottom) / 2.0,
            width: f64::from(right - left),
            height: f64::from(bottom - top),
            confidence: 1.0,
            label: Text::new(&format!("qr {text}")),
        });
    }
}
