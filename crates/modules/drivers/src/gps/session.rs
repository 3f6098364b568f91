//! Fixes of a satellite receiver, which sends by itself.

use std::time::Duration;

use slate_interfaces::{FixStatus, NavSatFix};

use super::message::{GeographicPoint, GpsMessage};
use crate::driver::{DeviceFault, DeviceProtocol};
use crate::sentence::SentenceDecoder;

/// Age above which dilutions and standard deviations are outdated.
/// After it a receiver without GGA counts as one with RMC alone.
const OLD: Duration = Duration::from_secs(3);

/// Driver's options for a receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GpsOptions {
    /// Fixes in a second.
    pub rate: f64,
    /// Standard deviation of a pseudorange, meters.
    /// 0: no covariances from dilutions.
    pub range_error_stddev: f64,
}

/// Conversation with a receiver, which only listens.
#[derive(Clone, Debug)]
pub struct GpsSession {
    options: GpsOptions,
    decoder: SentenceDecoder,
    /// Standard deviations north, east and up (meters), and their time of arrival.
    stddev: Option<([f64; 3], Duration)>,
    /// Vertical dilution, and when it came.
    vertical_dilution: Option<(f64, Duration)>,
    /// Arrival time of the newest GGA.
    gga: Option<Duration>,
    device_error: Option<String>,
}

impl GpsSession {
    /// Returns a session without a fix.
    pub fn new(options: GpsOptions) -> Self {
        Self {
            options,
            decoder: SentenceDecoder::default(),
            stddev: None,
            vertical_dilution: None,
            gga: None,
            device_error: None,
        }
    }

    fn take(&mut self, message: GpsMessage, now: Duration) -> Option<NavSatFix> {
        match message {
            GpsMessage::Gst { stddev, .. } => {
                self.stddev = Some((stddev, now));
                None
            }
            GpsMessage::Gsa { vertical_dilution, .. } => {
                self.vertical_dilution = vertical_dilution.map(|dilution| (dilution, now));
                None
            }
            GpsMessage::Gga { point, status, satellites, horizontal_dilution, altitude, .. } => {
                self.gga = Some(now);
                let Some(point) = point.filter(|_| status != FixStatus::NO_FIX) else {
                    return Some(self.lose(satellites));
                };
                self.device_error = None;
                let position_covariance = self.covariance(horizontal_dilution, now);
                Some(fix(status, point, altitude.unwrap_or(f64::NAN), position_covariance))
            }
            // A receiver with GGA says this, too.
            GpsMessage::Rmc { .. } if self.gga.is_some_and(|time| now.saturating_sub(time) < OLD) => None,
            GpsMessage::Rmc { point, .. } => {
                let Some(point) = point else { return Some(self.lose(0)) };
                self.device_error = None;
                Some(fix(FixStatus::FIX, point, f64::NAN, self.covariance(None, now)))
            }
        }
    }

    fn lose(&mut self, satellites: u32) -> NavSatFix {
        if self.device_error.is_none() {
            self.device_error = Some(format!(
                "no satellite fix ({satellites} satellites in use): has the antenna a free view of the sky?"
            ));
        }
        let nowhere = GeographicPoint { latitude: f64::NAN, longitude: f64::NAN };
        fix(FixStatus::NO_FIX, nowhere, f64::NAN, [0.0; 9])
    }

    /// Returns the covariance east, north, up.
    /// It comes from standard deviations if there are some, else from dilutions.
    fn covariance(&self, horizontal_dilution: Option<f64>, now: Duration) -> [f64; 9] {
        let is_fresh = |time: Duration| now.saturating_sub(time) < OLD;
        let variances = if let Some((stddev, _)) = self.stddev.filter(|(_, time)| is_fresh(*time)) {
            let [north, east, up] = stddev.map(|stddev| stddev * stddev);
            [east, north, up]
        } else if let Some(dilution) = horizontal_dilution.filter(|_| self.options.range_error_stddev > 0.0) {
            // Without a vertical dilution, it is about twice the horizontal one.
            let vertical = self.vertical_dilution.filter(|(_, time)| is_fresh(*time));
            let vertical = vertical.map_or(2.0 * dilution, |(vertical, _)| vertical);
            let stddev = self.options.range_error_stddev;
            let [plane, sky] = [dilution, vertical].map(|dilution| dilution * dilution * stddev * stddev);
            [plane / 2.0, plane / 2.0, sky]
        } else {
            [0.0; 3]
        };
        let mut covariance = [0.0; 9];
        for (axis, variance) in variances.into_iter().enumerate() {
            covariance[4 * axis] = variance;
        }
        covariance
    }
}

fn fix(
    status: FixStatus,
    GeographicPoint { latitude, longitude }: GeographicPoint,
    altitude: f64,
    position_covariance: [f64; 9],
) -> NavSatFix {
    NavSatFix { status, latitude, longitude, altitude, position_covariance }
}

impl DeviceProtocol for GpsSession {
    type Value = NavSatFix;

    fn begin(&mut self, _: Duration, _: &mut Vec<u8>) {
        self.decoder.clear();
        (self.stddev, self.vertical_dilution, self.gga, self.device_error) = (None, None, None, None);
    }

    fn receive(&mut self, bytes: &[u8], now: Duration, _: &mut Vec<u8>, take: &mut dyn FnMut(&NavSatFix)) {
        let mut decoder = std::mem::take(&mut self.decoder);
        decoder.receive(bytes, |body| {
            if let Some(fix) = GpsMessage::parse(body).and_then(|message| self.take(message, now)) {
                take(&fix);
            }
        });
        self.decoder = decoder;
    }

    fn poll(&mut self, _: Duration, _: &mut Vec<u8>) -> Result<(), DeviceFault> {
        Ok(())
    }

    fn identity(&self) -> &str {
        "a satellite receiver"
    }

    fn damaged(&self) -> u64 {
        self.decoder.damaged()
    }

    fn device_error(&self) -> Option<&str> {
        self.device_error.as_deref()
    }

    fn allowed_silence(&self) -> Option<Duration> {
        Some(Duration::from_secs_f64(1.0 + 2.0 / self.options.rate))
    }

    fn nominal_rate(&self) -> Option<f64> {
        Some(self.options.rate)
    }
}
