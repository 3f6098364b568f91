use serde::{Deserialize, Serialize};
use slate_module::math::angle_between;

/// Directions of three or four omni wheels from the middle, degrees.
/// Counter-clockwise from the front.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f64>", into = "Vec<f64>")]
pub struct WheelAngles {
    count: usize,
    degrees: [f64; 4],
}

impl WheelAngles {
    /// Returns the directions, in the order of the wheels.
    pub fn degrees(&self) -> &[f64] {
        &self.degrees[..self.count]
    }

    /// Returns the number of different directions; three determine the motion.
    pub fn directions(&self) -> usize {
        let is_same = |one: f64, other: f64| angle_between(one.to_radians(), other.to_radians()).abs() < 0.01;
        let angles = self.degrees();
        let is_first =
            |number: &usize| !angles[..*number].iter().any(|other| is_same(*other, angles[*number]));
        (0..angles.len()).filter(is_first).count()
    }
}

impl TryFrom<Vec<f64>> for WheelAngles {
    type Error = String;

    fn try_from(angles: Vec<f64>) -> Result<Self, String> {
        let count = angles.len();
        if !(3..=4).contains(&count) || angles.iter().any(|angle| !angle.is_finite()) {
            return Err(format!("expected the directions of 3 or 4 wheels in degrees, found {count}"));
        }
        let mut degrees = [0.0; 4];
        degrees[..count].copy_from_slice(&angles);
        Ok(Self { count, degrees })
    }
}

impl From<WheelAngles> for Vec<f64> {
    fn from(angles: WheelAngles) -> Self {
        angles.degrees().to_vec()
    }
}
