//! Image formation: from the radiance of a scene to the bytes of an image.
//! It models distortion, motion during the exposure, noise and encoding.

use slate_module::Random;

use crate::render::raster::Raster;
use crate::render::texture::Color;
use crate::robot::CameraDescription;
use crate::viewpoint::CameraMotion;

/// Number of equiprobable values of the normal distribution.
const DEVIATES: usize = 1024;
/// Number of brightness levels before encoding.
const STEPS: usize = 4096;
/// Longest blur of a pixel, pixels.
const LONGEST_BLUR: f32 = 64.0;
/// Shortest blur that is computed, pixels.
const SHORTEST_BLUR: f32 = 0.3;
/// Exposure at which a white surface in full light is white, s.
const USUAL_EXPOSURE: f64 = 0.01;
/// Largest ratio of the undistorted picture's width to the image's.
const WIDEST: f64 = 2.0;

/// Lens, shutter and sensor of a camera.
#[derive(Clone, Debug)]
pub(crate) struct Exposure {
    size: [usize; 2],
    focal_length: [f32; 2],
    /// Undistorted coordinates of each pixel; empty without distortion.
    places: Vec<[f32; 2]>,
    seconds: f32,
    sensitivity: f32,
    /// Variances: of a dark pixel, and the addition for a white one.
    variances: [f32; 2],
    deviates: Vec<f32>,
    encoded: Vec<u8>,
    /// Radiance of a row.
    row: Vec<Color>,
}

impl Exposure {
    /// Returns the exposure of a camera, and its raster.
    pub fn new(camera: &CameraDescription) -> (Self, Raster) {
        let size = [camera.width as usize, camera.height as usize];
        let (places, raster) = lens(camera);
        let [width, height] = raster.0;
        let raster = Raster::new([width, height], camera.focal_length, raster.1);
        let read = camera.noise_read * camera.noise_read;
        let shot = camera.noise_shot * camera.noise_shot;
        let exposure = Self {
            size,
            focal_length: camera.focal_length.map(|length| length as f32),
            places,
            seconds: camera.exposure as f32,
            sensitivity: (camera.gain * camera.exposure / USUAL_EXPOSURE) as f32,
            variances: [read as f32, shot as f32],
            deviates: (0..DEVIATES).map(deviate).collect(),
            encoded: (0..=STEPS).map(|step| encoded(step as f64 / STEPS as f64)).collect(),
            row: vec![[0.0; 3]; size[0]],
        };
        (exposure, raster)
    }

    /// Exposes an image while the camera moves, as bytes of red, green and blue.
    pub fn expose(
        &mut self,
        raster: &Raster,
        motion: &CameraMotion,
        random: &mut Random,
        bytes: &mut Vec<u8>,
    ) {
        let [width, height] = self.size;
        bytes.resize(width * height * 3, 0);
        let is_still = *motion == CameraMotion::default();
        let motion = ImageMotion::new(self, raster, motion);
        let mut row = std::mem::take(&mut self.row);
        for (y, bytes) in bytes.chunks_exact_mut(width * 3).enumerate() {
            if is_still && self.places.is_empty() {
                row.copy_from_slice(&raster.light()[y * width..(y + 1) * width]);
            } else {
                for (x, light) in row.iter_mut().enumerate() {
                    *light = self.collect(raster, &motion, x, y);
                }
            }
            self.develop(&row, random, bytes);
        }
        self.row = row;
    }

    /// Returns the mean radiance of a pixel over the exposure, along its motion path.
    #[inline]
    fn collect(&self, raster: &Raster, motion: &ImageMotion, x: usize, y: usize) -> Color {
        let [columns, rows] = raster.size();
        let [u, v] = match self.places.get(y * self.size[0] + x) {
            Some(place) => *place,
            None => [x as f32, y as f32],
        };
        let pixel = nearest(v, rows).wrapping_mul(columns).wrapping_add(nearest(u, columns));
        let way = motion.way([u, v], raster.inverse_depths()[pixel]);
        let length = (way[0] * way[0] + way[1] * way[1]).sqrt();
        if length < SHORTEST_BLUR {
            return if self.places.is_empty() { raster.light()[pixel] } else { bilinear(raster, u, v) };
        }
        let length = if length < LONGEST_BLUR { length } else { LONGEST_BLUR };
        let taps = length as i32 + 2;
        let share = 1.0 / taps as f32;
        let light = raster.light();
        let mut sum = [0.0; 3];
        for tap in 0..taps {
            let along = (tap as f32 + 0.5) * share - 0.5;
            // Neighboring taps are a pixel apart, so that what is between pixels is averaged in any case.
            let x = nearest(u + way[0] * along, columns);
            let y = nearest(v + way[1] * along, rows);
            let color = light[y.wrapping_mul(columns).wrapping_add(x)];
            sum = [sum[0] + color[0], sum[1] + color[1], sum[2] + color[2]];
        }
        [sum[0] * share, sum[1] * share, sum[2] * share]
    }

    /// Adds noise to a row and encodes it.
    fn develop(&self, row: &[Color], random: &mut Random, bytes: &mut [u8]) {
        let [read, shot] = self.variances;
        let is_exact = read == 0.0 && shot == 0.0;
        for (light, bytes) in row.iter().zip(bytes.chunks_exact_mut(3)) {
            let mut bits = if is_exact { 0 } else { random.bits() };
            for (light, byte) in light.iter().zip(bytes) {
                let signal = light * self.sensitivity;
                let mut measured = signal;
                if !is_exact {
                    measured += (read + shot * signal).sqrt() * self.deviates[bits as usize % DEVIATES];
                    bits >>= 16;
                }
                // A float beyond the range of an integer becomes its nearest one.
                let step = (measured * STEPS as f32) as i32;
                *byte = self.encoded[step.clamp(0, STEPS as i32) as usize];
            }
        }
    }
}

/// Returns the index nearest to `value`, of `count` columns or rows.
#[inline]
fn nearest(value: f32, count: usize) -> usize {
    ((value + 0.5) as i32).clamp(0, count as i32 - 1) as usize
}

/// Camera motion during an exposure, with the intrinsics of its raster.
/// Motion is in m and rad, focal lengths and principal point in pixels.
struct ImageMotion {
    linear: [f32; 3],
    angular: [f32; 3],
    focal_length: [f32; 2],
    center: [f32; 2],
}

impl ImageMotion {
    fn new(exposure: &Exposure, raster: &Raster, motion: &CameraMotion) -> Self {
        Self {
            linear: motion.linear.map(|value| value as f32 * exposure.seconds),
            angular: motion.angular.map(|value| value as f32 * exposure.seconds),
            focal_length: exposure.focal_length,
            center: raster.center(),
        }
    }

    /// Returns the optical flow of a pixel during the exposure, pixels.
    /// Longuet-Higgins and Prazdny, 1980, *The interpretation of a moving retinal image*.
    #[inline]
    fn way(&self, [u, v]: [f32; 2], inverse_depth: f32) -> [f32; 2] {
        let ([fx, fy], [cx, cy]) = (self.focal_length, self.center);
        let (x, y) = ((u - cx) / fx, (v - cy) / fy);
        let ([vx, vy, vz], [wx, wy, wz]) = (self.linear, self.angular);
        let along_x = (x * vz - vx) * inverse_depth + wx * x * y - wy * (1.0 + x * x) + wz * y;
        let along_y = (y * vz - vy) * inverse_depth + wx * (1.0 + y * y) - wy * x * y - wz * x;
        [along_x * fx, along_y * fy]
    }
}

/// Interpolates the four nearest pixels linearly.
#[inline]
fn bilinear(raster: &Raster, u: f32, v: f32) -> Color {
    let [columns, rows] = raster.size();
    let u = u.clamp(0.0, (columns - 1) as f32);
    let v = v.clamp(0.0, (rows - 1) as f32);
    let (left, top) = (u as i32 as usize, v as i32 as usize);
    let (right, below) = ((left + 1).min(columns - 1), (top + 1).min(rows - 1));
    let (aside, down) = (u - left as f32, v - top as f32);
    let light = raster.light();
    let (a, b) = (light[top * columns + left], light[top * columns + right]);
    let (c, d) = (light[below * columns + left], light[below * columns + right]);
    let weights = [(1.0 - aside) * (1.0 - down), aside * (1.0 - down), (1.0 - aside) * down, aside * down];
    // Written out, as a loop over channels is not always compiled into its steps.
    let mixed =
        |a: f32, b: f32, c: f32, d: f32| a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3];
    [mixed(a[0], b[0], c[0], d[0]), mixed(a[1], b[1], c[1], d[1]), mixed(a[2], b[2], c[2], d[2])]
}

/// Returns the undistorted coordinates of all pixels of a distorted image.
/// Size and principal point of the undistorted picture follow.
#[allow(clippy::type_complexity, reason = "used once")]
fn lens(camera: &CameraDescription) -> (Vec<[f32; 2]>, ([usize; 2], [f64; 2])) {
    let ([fx, fy], [cx, cy]) = (camera.focal_length, camera.center());
    let (width, height) = (camera.width as usize, camera.height as usize);
    if camera.distortion == [0.0; 2] {
        return (Vec::new(), ([width, height], [cx, cy]));
    }
    let undistorted = |column: f64, row: f64| {
        let [x, y] = undistort([(column - cx) / fx, (row - cy) / fy], camera.distortion);
        [x * fx + cx, y * fy + cy]
    };
    // A row or a column of the border goes farthest at its end or in its middle.
    let (right, bottom) = (width as f64 - 1.0, height as f64 - 1.0);
    let (mut least, mut most) = ([0.0; 2], [right, bottom]);
    for [column, row] in [
        [0.0, 0.0],
        [right, 0.0],
        [0.0, bottom],
        [right, bottom],
        [cx, 0.0],
        [0.0, cy],
        [cx, bottom],
        [right, cy],
    ] {
        let place = undistorted(column, row);
        for axis in 0..2 {
            least[axis] = slate_module::math::min(least[axis], place[axis]);
            most[axis] = slate_module::math::max(most[axis], place[axis]);
        }
    }
    let beyond = |axis: usize, side: f64| {
        let room = side * (WIDEST - 1.0) / 2.0;
        let limit = |value: f64| slate_module::math::clamp(value, 0.0, room).ceil();
        (limit(-least[axis]), limit(most[axis] - (side - 1.0)))
    };
    let ((left, to_right), (top, below)) = (beyond(0, width as f64), beyond(1, height as f64));
    let size = [width + (left + to_right) as usize, height + (top + below) as usize];
    let places = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    let places = places.map(|(column, row)| {
        let [x, y] = undistorted(column as f64, row as f64);
        [(x + left) as f32, (y + top) as f32]
    });
    (places.collect(), (size, [cx + left, cy + top]))
}

/// Returns the undistorted coordinates of a ray, by fixed-point iteration.
fn undistort(distorted: [f64; 2], [k1, k2]: [f64; 2]) -> [f64; 2] {
    let mut place = distorted;
    for _ in 0..30 {
        let square = place[0] * place[0] + place[1] * place[1];
        let factor = 1.0 / (1.0 + square * (k1 + square * k2));
        place = distorted.map(|coordinate| coordinate * factor);
    }
    place
}

/// Returns the normal quantile of value `number`.
fn deviate(number: usize) -> f32 {
    let share = (number as f64 + 0.5) / DEVIATES as f64;
    let below = |value: f64| 0.5 * libm::erfc(-value * std::f64::consts::FRAC_1_SQRT_2);
    let (mut low, mut high) = (-6.0, 6.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if below(middle) < share { low = middle } else { high = middle }
    }
    (0.5 * (low + high)) as f32
}

/// Encodes linear brightness as sRGB (IEC 61966-2-1).
fn encoded(linear: f64) -> u8 {
    let value =
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 };
    (value * 255.0 + 0.5) as u8
}
