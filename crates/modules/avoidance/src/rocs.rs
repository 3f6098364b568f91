use serde::{Deserialize, Serialize};
use slate_interfaces::{SonarScan, WheelSpeeds};
use slate_module::math;

/// Weight of a near echo.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RocsVariant {
    /// As the authors ran it: the lower clamp is inverted, so every detection counts at least in full, and one nearer than
    /// 0.1 m up to half as much again.
    Rocs,
    /// As they meant it: the nearer, the more.
    RocsFixed,
}

/// The reactive control law of RoCS: every front sonar slows the wheels by its weight (Braitenberg's vehicle).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rocs {
    /// Weight of a near echo.
    pub variant: RocsVariant,
}

/// Maximum range of detection, metres.
const DETECTED: f64 = 0.3;
/// Nearer than this counts in full, metres.
const FULL: f64 = 0.1;
/// Effect of the front sonars on the left wheel, from the left one to the right one, on the right wheel reversed, and the speed
/// of both wheels to which that is added, rad/s: of the Pioneer.
const PIONEER: (&[f64], f64) = (&[-0.2, -0.4, -0.6, -0.8, -1.0, -1.2, -1.4, -1.6], 1.5);
/// And of the Summit, which has three sonars.
const SUMMIT: (&[f64], f64) = (&[-0.5, -1.0, -3.0], 0.0);
/// Smaller changes of the wheels' speeds are left to the planner, rad/s.
const THRESHOLD: f64 = 0.1;

/// Weight of an echo: 1 at the full distance, 0 where nothing counts as detected.
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
                // Their clamp keeps what is nearer, which so counts more than in full.
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
