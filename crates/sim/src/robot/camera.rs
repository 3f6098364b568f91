use serde::{Deserialize, Serialize};
use slate_interfaces::CameraInfo;

use super::{is_deviation, is_rate};

/// Largest number of columns and of rows, pixels.
const LONGEST: u32 = 1920;
/// Longest exposure, s.
const LONGEST_EXPOSURE: f64 = 0.2;

/// Camera, optionally on a head.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraDescription {
    /// Pose of the camera, or of its head's axes, on the robot.
    /// x, y and z in meters, then yaw and pitch in degrees. A positive pitch looks down.
    pub mount: [f64; 5],
    /// Width of the image, pixels.
    pub width: u32,
    /// Height of the image, pixels.
    pub height: u32,
    /// Focal lengths, pixels.
    pub focal_length: [f64; 2],
    /// Principal point, pixels; the middle of the image by default.
    #[serde(default)]
    pub principal_point: Option<[f64; 2]>,
    /// Radial distortion k1 and k2 of the model `plumb_bob`.
    #[serde(default)]
    pub distortion: [f64; 2],
    /// Rate, Hz.
    pub rate: f64,
    /// Exposure time, s.
    pub exposure: f64,
    /// Gain: brightness of the image, relative to that of 10 ms.
    #[serde(default = "one")]
    pub gain: f64,
    /// Standard deviation of a dark pixel (read noise), relative to white.
    pub noise_read: f64,
    /// Additional standard deviation of a white pixel.
    /// It grows with the square root of the brightness.
    pub noise_shot: f64,
    /// Pan-tilt head that carries it.
    #[serde(default)]
    pub head: Option<HeadDescription>,
}

/// Limits of a pan-tilt head.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeadDescription {
    /// Smallest and largest pan, rad, counter-clockwise from the front.
    pub pan: [f64; 2],
    /// Smallest and largest tilt, rad; a positive one looks down.
    pub tilt: [f64; 2],
    /// Maximum rate of the pan, rad/s.
    pub maximum_pan_rate: f64,
    /// Maximum rate of the tilt, rad/s.
    pub maximum_tilt_rate: f64,
}

fn one() -> f64 {
    1.0
}

impl CameraDescription {
    /// Returns the principal point, pixels; pixel centers have integer coordinates.
    pub fn center(&self) -> [f64; 2] {
        let middle = |pixels: u32| (f64::from(pixels) - 1.0) / 2.0;
        self.principal_point.unwrap_or([middle(self.width), middle(self.height)])
    }

    /// Returns the calibration as its interface.
    pub fn info(&self) -> CameraInfo {
        let ([fx, fy], [cx, cy]) = (self.focal_length, self.center());
        CameraInfo::pinhole([self.width, self.height], [fx, fy, cx, cy], self.distortion)
    }

    /// Returns the size of an image, bytes.
    pub fn bytes(&self) -> usize {
        self.width as usize * self.height as usize * 3
    }

    /// Returns whether distortion is monotonic up to twice the corners of the image.
    fn is_distortion_usable(&self) -> bool {
        let ([k1, k2], [fx, fy], [cx, cy]) = (self.distortion, self.focal_length, self.center());
        let (x, y) = (cx.abs() + f64::from(self.width), cy.abs() + f64::from(self.height));
        let square = (x / fx) * (x / fx) + (y / fy) * (y / fy);
        let slope = |share: f64| {
            let square = square * share;
            1.0 + 3.0 * k1 * square + 5.0 * k2 * square * square
        };
        [k1, k2].iter().all(|value| value.is_finite())
            && (0..=64).all(|step| slope(f64::from(step) / 64.0) > 0.2)
    }

    /// Returns the key of an invalid value, and the expectation.
    pub(super) fn invalid_value(&self) -> Option<(&'static str, &'static str)> {
        let deviation = "expected a standard deviation, not negative";
        let [_, _, z, _, pitch] = self.mount;
        let is_side = |side: u32| (8..=LONGEST).contains(&side);
        let is_focal = |length: &f64| *length >= 4.0 && *length <= 1e5;
        let checks = [
            (
                "mount",
                self.mount.iter().all(|value| value.abs() <= 360.0) && z > 0.0 && pitch.abs() <= 90.0,
                "expected x, y and z in meters, then yaw and pitch in degrees: z above 0, a pitch up to 90",
            ),
            ("width", is_side(self.width), "expected from 8 to 1920 pixels"),
            ("height", is_side(self.height), "expected from 8 to 1920 pixels"),
            (
                "focal_length",
                self.focal_length.iter().all(is_focal),
                "expected two lengths from 4 to 100000 pixels",
            ),
            (
                "principal_point",
                self.center().iter().all(|value| value.abs() <= 2.0 * f64::from(LONGEST)),
                "expected two coordinates in pixels",
            ),
            (
                "distortion",
                self.is_distortion_usable(),
                "expected k1 and k2 that fold no part of the image over another",
            ),
            ("rate", is_rate(self.rate) && self.rate <= 1000.0, "expected a number of hertz up to 1000"),
            (
                "exposure",
                self.exposure > 0.0 && self.exposure <= LONGEST_EXPOSURE,
                "expected a time above 0, up to 0.2 s",
            ),
            ("gain", self.gain > 0.0 && self.gain <= 1000.0, "expected a factor above 0, up to 1000"),
            ("noise_read", is_deviation(self.noise_read) && self.noise_read <= 1.0, deviation),
            ("noise_shot", is_deviation(self.noise_shot) && self.noise_shot <= 1.0, deviation),
            (
                "head",
                self.head.is_none_or(|head| head.is_usable()),
                "expected limits of `pan` and `tilt` with 0 between, within half a turn and a quarter, and positive rates",
            ),
            // The image would turn about the optical axis as the head pans.
            ("mount", self.head.is_none() || pitch == 0.0, "expected a pitch of 0 for a camera on a head"),
        ];
        checks.into_iter().find(|(_, right, _)| !right).map(|(key, _, message)| (key, message))
    }
}

impl HeadDescription {
    fn is_usable(&self) -> bool {
        let half_turn = std::f64::consts::PI;
        let is_range =
            |[least, most]: [f64; 2], end: f64| least >= -end && least <= 0.0 && most >= 0.0 && most <= end;
        let is_fast = |rate: f64| rate > 0.0 && rate <= 100.0;
        is_range(self.pan, half_turn)
            && is_range(self.tilt, half_turn / 2.0)
            && is_fast(self.maximum_pan_rate)
            && is_fast(self.maximum_tilt_rate)
    }
}
