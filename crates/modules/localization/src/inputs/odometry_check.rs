//! Check of the odometry.

use serde::{Deserialize, Serialize};
use slate_interfaces::{Odometry, Pose2};
use slate_module::math;

use super::fault::{FaultyInput, InputFault};

/// Velocities from which an odometry has jumped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityLimits {
    /// Linear velocity, m/s.
    pub linear: f64,
    /// Angular velocity, rad/s.
    pub angular: f64,
}

/// Check of successive poses of the odometry.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct OdometryCheck {
    /// Newest pose, and its time, ns.
    newest: Option<([f64; 3], u64)>,
    /// Fault of the newest pose.
    fault: Option<InputFault>,
}

impl OdometryCheck {
    /// Checks a new pose.
    pub fn check(&mut self, odometry: &Odometry, time: u64, limits: VelocityLimits) {
        self.fault = self.examine(odometry, time, limits).err();
    }

    /// Returns the fault of the newest pose.
    pub fn fault(&self) -> Result<(), InputFault> {
        self.fault.clone().map_or(Ok(()), Err)
    }

    fn examine(&mut self, odometry: &Odometry, time: u64, limits: VelocityLimits) -> Result<(), InputFault> {
        let fault = |reason: std::fmt::Arguments<'_>| Err(InputFault::with(FaultyInput::Odometry, reason));
        let Pose2 { x, y, theta } = odometry.pose;
        if !odometry.pose.is_known() {
            return fault(format_args!("is NaN: ({x}, {y}, {theta})"));
        }
        let Some(([last_x, last_y, last_theta], last)) = self.newest.replace(([x, y, theta], time)) else {
            return Ok(());
        };
        if time < last {
            return fault(format_args!("went back in time by {:.3} s", (last - time) as f64 * 1e-9));
        }
        let seconds = (time - last) as f64 * 1e-9;
        let (moved, turned) =
            (math::hypot(x - last_x, y - last_y), math::angle_between(last_theta, theta).abs());
        // A hand's breadth and some degrees are no jump, whatever the time.
        if moved > limits.linear * seconds + 0.1 || turned > limits.angular * seconds + 0.1 {
            return fault(format_args!("jumped by {moved:.2} m and {turned:.2} rad in {seconds:.3} s"));
        }
        Ok(())
    }
}
