use serde::{Deserialize, Serialize};
use slate_module::math::clamp;

use crate::robot::HeadDescription;

/// Pan-tilt head whose joints follow their setpoints at their maximum rates.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct PanTiltHead {
    description: HeadDescription,
    setpoints: [f64; 2],
    angles: [f64; 2],
    rates: [f64; 2],
}

impl PanTiltHead {
    /// Creates a head that looks ahead.
    pub fn new(description: HeadDescription) -> Self {
        Self { description, setpoints: [0.0; 2], angles: [0.0; 2], rates: [0.0; 2] }
    }

    /// Sets pan and tilt, rad, within the limits.
    /// A joint keeps its setpoint if the command is not a number.
    pub fn command(&mut self, angles: [f64; 2]) {
        let limits = [self.description.pan, self.description.tilt];
        for ((setpoint, angle), [least, most]) in self.setpoints.iter_mut().zip(angles).zip(limits) {
            if !angle.is_nan() {
                *setpoint = clamp(angle, least, most);
            }
        }
    }

    /// Moves the head for `seconds`.
    pub fn advance(&mut self, seconds: f64) {
        let HeadDescription { maximum_pan_rate, maximum_tilt_rate, .. } = self.description;
        for (joint, most) in [maximum_pan_rate, maximum_tilt_rate].into_iter().enumerate() {
            let way = self.setpoints[joint] - self.angles[joint];
            // It arrives at the setpoint itself, which a sum of steps would miss.
            if way.abs() <= most * seconds {
                self.rates[joint] = way / seconds;
                self.angles[joint] = self.setpoints[joint];
            } else {
                self.rates[joint] = most.copysign(way);
                self.angles[joint] += self.rates[joint] * seconds;
            }
        }
    }

    /// Returns pan and tilt, rad.
    pub fn angles(&self) -> [f64; 2] {
        self.angles
    }

    /// Returns the rates of pan and tilt, rad/s.
    pub fn rates(&self) -> [f64; 2] {
        self.rates
    }
}
