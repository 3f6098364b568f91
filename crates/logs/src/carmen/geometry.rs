//! Beam directions and maximum range of a laser, which lines of the old form omit.

use std::f64::consts::{FRAC_PI_2, PI};

/// Default of CARMEN's own programs, meters.
const RANGE_MAX: f64 = 80.0;

/// Parameters of the two lasers, with the usual defaults.
///
/// A laser of 180 or 181 beams has one in each degree, one of 360 or 361 in each half, one of 400 or 401 in each
/// quarter, and its middle beam looks to the front; of an even number of beams the last is missing. Any other one
/// covers 180 degrees. The parameter `laser_front_laser_resolution`, degrees, precedes that. The maximum range is 80 m,
/// or `robot_front_laser_max`. The parameters of the laser at the back have `rear` instead of `front`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Geometry {
    front: LaserParameters,
    rear: LaserParameters,
}

#[derive(Clone, Copy, Debug, Default)]
struct LaserParameters {
    /// Radians.
    resolution: Option<f64>,
    /// Maximum range, meters.
    range_max: Option<f64>,
}

impl Geometry {
    pub fn parameter(&mut self, name: &str, value: &str) {
        let parameters = match name {
            name if name.contains("front") => &mut self.front,
            name if name.contains("rear") => &mut self.rear,
            _ => return,
        };
        let Some(number) = value.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0)
        else {
            return;
        };
        match name {
            "laser_front_laser_resolution" | "laser_rear_laser_resolution" => {
                parameters.resolution = Some(number * PI / 180.0);
            }
            "robot_front_laser_max" | "robot_rear_laser_max" => parameters.range_max = Some(number),
            _ => {}
        }
    }

    /// Returns the first beam's direction, the angle increment, and the maximum range.
    /// Angles in radians, range in meters.
    pub fn of(&self, topic: &str, beams: usize) -> (f64, f64, f64) {
        let parameters = match topic {
            "flaser" => self.front,
            "rlaser" => self.rear,
            _ => LaserParameters::default(),
        };
        let usual = match beams {
            180 | 181 => Some(PI / 180.0),
            360 | 361 => Some(PI / 360.0),
            400 | 401 => Some(PI / 720.0),
            _ => None,
        };
        // The beams of a laser that misses none, and what lies between them.
        let gaps = (beams / 2 * 2) as f64;
        let fits = |resolution: &f64| resolution * gaps <= 2.0 * PI;
        let (first, step) = match parameters.resolution.filter(fits).or(usual) {
            Some(step) => (-step * gaps / 2.0, step),
            None => (-FRAC_PI_2, PI / beams.saturating_sub(1).max(1) as f64),
        };
        (first, step, parameters.range_max.unwrap_or(RANGE_MAX))
    }
}
