//! Rate monitor of a device.

use std::time::Duration;

use super::protocol::DeviceFault;

/// Minimum window of a rate measurement: time, and expected measurements.
const WINDOW: (Duration, f64) = (Duration::from_secs(1), 5.0);
/// Part of the nominal rate below which a device is late.
const MIN_RATE_FRACTION: f64 = 0.7;

/// Measured rate of a device, and its newest bytes.
#[derive(Clone, Debug, Default)]
pub(super) struct RateWatch {
    /// Arrival time of the newest measurement, initially the opening time.
    received_at: Duration,
    /// True if a measurement came on this line.
    measures: bool,
    /// Arrival time of the newest byte on this line.
    answered_at: Option<Duration>,
    /// Beginning of the window, and measurements in it.
    window: (Duration, u32),
    /// Measurements in a second; 0 before the first whole window.
    pub rate: f64,
}

impl RateWatch {
    /// Resets the monitor for a newly opened line.
    pub fn begin(&mut self, now: Duration) {
        *self = Self { received_at: now, window: (now, 0), ..Self::default() };
    }

    /// Notes the arrival of bytes.
    pub fn take_bytes(&mut self, now: Duration) {
        self.answered_at = Some(now);
    }

    pub fn take_measurement(&mut self, now: Duration) {
        if !self.measures {
            self.window = (now, 0);
        } else {
            self.window.1 += 1;
        }
        (self.measures, self.received_at) = (true, now);
    }

    pub fn measures(&self) -> bool {
        self.measures
    }

    /// Measures the rate, and finds out whether the device is silent.
    ///
    /// # Errors
    /// When nothing was measured for longer than that.
    pub fn check(
        &mut self,
        now: Duration,
        silence: Option<Duration>,
        nominal: Option<f64>,
    ) -> Result<(), DeviceFault> {
        let (since, count) = self.window;
        let passed = now.saturating_sub(since);
        let enough = passed.as_secs_f64() * nominal.unwrap_or(WINDOW.1) >= WINDOW.1;
        if self.measures && passed >= WINDOW.0 && enough {
            self.rate = f64::from(count) / passed.as_secs_f64();
            self.window = (now, 0);
        }
        let passed = now.saturating_sub(self.received_at);
        let Some(silence) = silence.filter(|silence| passed >= *silence) else { return Ok(()) };
        // A packet may have been cut off.
        let speaks = self.answered_at.is_some_and(|time| now.saturating_sub(time) < silence / 2);
        Err(match (self.measures, self.answered_at) {
            (false, None) => DeviceFault::NoAnswer,
            (false, Some(_)) => DeviceFault::Noise,
            (true, _) if speaks => DeviceFault::Drowned,
            (true, _) => DeviceFault::Silent,
        })
    }

    /// Returns the measured rate and the rate's lower limit, if it is too low.
    /// The limit is a part of the nominal rate.
    pub fn lag(&self, nominal: Option<f64>) -> Option<(f64, f64)> {
        let nominal = nominal?;
        (self.rate > 0.0 && self.rate < MIN_RATE_FRACTION * nominal).then_some((self.rate, nominal))
    }
}
