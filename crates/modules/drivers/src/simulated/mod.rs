//! Simulated devices, to test drivers without hardware, line and clock.
//!
//! ```
//! use slate_device_line::simulated::{SimulatedDevice, SimulatedLine};
//! use slate_drivers::simulated::SimulatedHokuyo;
//!
//! let scanner = SimulatedDevice::start(SimulatedHokuyo::default(), SimulatedLine::Tcp(0))?;
//! scanner.with(|scanner| scanner.set_distances(|step| 1000 + u32::from(step)));
//! assert!(scanner.name().starts_with("tcp://127.0.0.1:"), "what the parameter `device` is set to");
//! # Ok::<(), slate_device_line::simulated::SimulationError>(())
//! ```

mod gps;
mod hokuyo;
mod imu;
mod joystick;
mod rplidar;

pub use gps::SimulatedGps;
pub use hokuyo::SimulatedHokuyo;
pub use imu::SimulatedImu;
pub use joystick::SimulatedJoystick;
pub use rplidar::SimulatedRplidar;
pub use slate_device_line::simulated::{
    DeviceFirmware, Faults, SimulatedDevice, SimulatedLine, SimulationError,
};

use std::time::Duration;

/// Times of something that a device does with a period.
#[derive(Clone, Copy, Debug, Default)]
struct PeriodClock {
    next: Duration,
}

impl PeriodClock {
    /// Returns true if a period has elapsed; missed periods are left out.
    fn due(&mut self, now: Duration, period: Duration) -> bool {
        let is_due = now >= self.next;
        if is_due {
            self.next = if now > self.next + period { now + period } else { self.next + period };
        }
        is_due
    }
}
