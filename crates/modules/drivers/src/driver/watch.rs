//! Whether a device measures as often as it should.

use std::time::Duration;

use super::conversation::DeviceFault;

/// Least time over which a rate is measured, and least number of measurements that should come in it.
const WINDOW: (Duration, f64) = (Duration::from_secs(1), 5.0);
/// Part of the nominal rate below which a device is late.
const ENOUGH: f64 = 0.7;

/// Counts what comes from a device.
#[derive(Clone, Debug, Default)]
pub(super) struct RateWatch {
    /// When the newest measurement came, or the line was opened.
    heard: Duration,
    /// Whether anything was measured on this line.
    measures: bool,
    /// When the newest byte came, if there was one on this line.
    spoke: Option<Duration>,
    /// Beginning of the window, and measurements in it.
    window: (Duration, u32),
    /// Measurements in a second; 0 before the first whole window.
    pub rate: f64,
}

impl RateWatch {
    /// The line was opened.
    pub fn begin(&mut self, now: Duration) {
        *self = Self { heard: now, window: (now, 0), ..Self::default() };
    }

    /// Something came.
    pub fn take_bytes(&mut self, now: Duration) {
        self.spoke = Some(now);
    }

    pub fn take_measurement(&mut self, now: Duration) {
        if !self.measures {
            self.window = (now, 0);
        } else {
            self.window.1 += 1;
        }
        (self.measures, self.heard) = (true, now);
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
        let passed = now.saturating_sub(self.heard);
        let Some(silence) = silence.filter(|silence| passed >= *silence) else { return Ok(()) };
        // A packet may have been cut off.
        let speaks = self.spoke.is_some_and(|time| now.saturating_sub(time) < silence / 2);
        Err(match (self.measures, self.spoke) {
            (false, None) => DeviceFault::NoAnswer,
            (false, Some(_)) => DeviceFault::Noise,
            (true, _) if speaks => DeviceFault::Drowned,
            (true, _) => DeviceFault::Silent,
        })
    }

    /// The measured rate and that part of the nominal one below which a device is late, when it is late.
    pub fn lag(&self, nominal: Option<f64>) -> Option<(f64, f64)> {
        let nominal = nominal?;
        (self.rate > 0.0 && self.rate < ENOUGH * nominal).then_some((self.rate, nominal))
    }
}
