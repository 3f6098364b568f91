use serde::{Deserialize, Serialize};
use slate_interfaces::{SonarScan, WheelSpeeds};
use slate_module::math;

/// Weight of a near echo.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RocsVariant {
    /// Control law as published runs had it: the lower clamp is inverted.
    /// Every detection counts at least in full, and one nearer than 0.1 m up to half as much again.
    Rocs,
    /// Control law as intended: the weight grows as the distance falls.
    RocsFixed,
}

/// Reactive control law of RoCS (Braitenberg's vehicle).
/// Every front sonar slows the wheels by its weight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rocs {
    /// Weight of a near echo.
    pub variant: RocsVariant,
}

/// Maximum range of detection, meters.
const DETECTED: f64 = 0.3;
/// Nearer than this counts in full, meters.
const FULL: f64 = 0.1;
/// Weights of the Pioneer's front sonars on the left wheel, and base velocity.
/// Weights are from the left sonar to the right one, reversed for the right wheel; they are added to the velocity of
/// both wheels, rad/s.
const PIONEER: (&[f64], f64) = (&[-0.2, -0.4, -0.6, -0.8, -1.0, -1.2, -1.4, -1.6], 1.5);
/// Weights and base velocity of the Summit, which has three sonars.
const SUMMIT: (&[f64], f64) = (&[-0.5, -1.0, -3.0], 0.0);
/// Smaller changes of the wheels' speeds are left to the planner, rad/s.
const THRESHOLD: f64 = 0.1;

/// Returns the weight of an echo.
/// 1 at the full distance, 0 beyond the range of detection.
fn weight(range: f64) -> f64 {
    1.0 - (range - FULL) / (DETECTED - FULL)
}

impl Rocs {
    /// Returns wheel speeds; `None` without a near obstacle.
    pub fn react(&self, scan: &SonarScan) -> Option<WheelSpeeds> {
        let (weights, base) = if scan.echoes.len() == SUMMIT.0.len() { SUMMIT } else { PIONEER };
        let (mut left, mut right) = (0.0, 0.0);
        for (index, echo) in scan.echoes.iter().take(weights.len()).enumerate() {
            if !echo.heard.get() || !(0.0..DETECTED).contains(&echo.range) {
                continue;
            }
            let part = match self.variant {
                // Their clamp keeps nearer ranges, which thus count more than in full.
                RocsVariant::Rocs => weight(math::min(echo.range, FULL)),
                RocsVariant::RocsFixed => weight(math::max(echo.range, FULL)),
            };
            left += weights[index] * part;
            right += weights[weights.len() - 1 - index] * part;
        }
        let fires = left.abs() > THRESHOLD || right.abs() > THRESHOLD;
        fires.then_some(WheelSpeeds { left: base + left, right: base + right })
    }
}
