//! Conversation with a VectorNav sensor.

use std::time::Duration;

use slate_interfaces::Imu;

use super::message::{InertialSample, VectorNavMessage, error_text};
use crate::driver::{DeviceFault, DeviceProtocol};
use crate::sentence::{self, SentenceDecoder};

/// Timeout of an answer before a command is repeated.
const TIMEOUT: Duration = Duration::from_millis(250);
/// Attempts of the commands.
const MAX_ATTEMPTS: u32 = 4;
/// Register of the asynchronous message type, and the type `VNYMR`.
const KIND: (u8, u8) = (6, 14);
/// Register with their number in a second.
const RATE: u8 = 7;
/// Code of an error for a line that is too slow.
const TOO_SLOW: u8 = 12;

/// Driver's options for a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuOptions {
    /// Measurements in a second.
    pub rate: u32,
    /// Standard deviation of the orientation, rad; 0 for unknown.
    pub orientation_stddev: f64,
    /// Standard deviation of the angular velocity, rad/s; 0 for unknown.
    pub angular_velocity_stddev: f64,
    /// Standard deviation of the acceleration, m/s²; 0 for unknown.
    pub linear_acceleration_stddev: f64,
}

/// Conversation with a sensor.
#[derive(Clone, Debug)]
pub struct ImuSession {
    options: ImuOptions,
    decoder: SentenceDecoder,
    requested_at: Duration,
    tries: u32,
    /// Answers received: model, message type and rate.
    answered: [bool; 3],
    identity: String,
    device_error: Option<String>,
}

impl ImuSession {
    /// Returns a session that has not begun.
    pub fn new(options: ImuOptions) -> Self {
        Self {
            options,
            decoder: SentenceDecoder::default(),
            requested_at: Duration::ZERO,
            tries: 0,
            answered: [false; 3],
            identity: "a VectorNav sensor".into(),
            device_error: None,
        }
    }

    /// Sends the commands without an answer.
    /// They change the sensor until it is switched off.
    fn request(&mut self, now: Duration, outgoing: &mut Vec<u8>) {
        self.requested_at = now;
        self.tries += 1;
        let [has_model, has_kind, has_rate] = self.answered;
        if !has_model {
            sentence::append("VNRRG,01", outgoing);
        }
        if !has_kind {
            sentence::append(&format!("VNWRG,{:02},{}", KIND.0, KIND.1), outgoing);
        }
        if !has_rate {
            sentence::append(&format!("VNWRG,{RATE:02},{}", self.options.rate), outgoing);
        }
    }

    fn take(&mut self, message: VectorNavMessage<'_>) -> Option<Imu> {
        match message {
            VectorNavMessage::Sample(sample) => return Some(self.imu(&sample)),
            VectorNavMessage::Model(model) => {
                self.answered[0] = true;
                self.identity = model.chars().take(32).collect();
            }
            VectorNavMessage::Written(register) => {
                self.answered[1] |= register == KIND.0;
                self.answered[2] |= register == RATE;
            }
            VectorNavMessage::Error(code) => {
                let remedy =
                    if code == TOO_SLOW { ": raise the sensor's baud rate, or lower `rate`" } else { "" };
                self.device_error =
                    Some(format!("the sensor reports error {code} ({}){remedy}", error_text(code)));
            }
        }
        if self.answered == [true; 3] {
            self.device_error = None;
        }
        None
    }

    fn imu(&self, sample: &InertialSample) -> Imu {
        let diagonal = |stddev: f64| {
            let variance = stddev * stddev;
            [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance]
        };
        Imu {
            orientation: sample.orientation,
            orientation_covariance: diagonal(self.options.orientation_stddev),
            angular_velocity: sample.angular_velocity,
            angular_velocity_covariance: diagonal(self.options.angular_velocity_stddev),
            linear_acceleration: sample.acceleration,
            linear_acceleration_covariance: diagonal(self.options.linear_acceleration_stddev),
        }
    }
}

impl DeviceProtocol for ImuSession {
    type Value = Imu;

    fn begin(&mut self, now: Duration, outgoing: &mut Vec<u8>) {
        self.decoder.clear();
        (self.answered, self.tries, self.device_error) = ([false; 3], 0, None);
        self.request(now, outgoing);
    }

    fn receive(&mut self, bytes: &[u8], _: Duration, _: &mut Vec<u8>, take: &mut dyn FnMut(&Imu)) {
        let mut decoder = std::mem::take(&mut self.decoder);
        decoder.receive(bytes, |body| {
            if let Some(imu) = VectorNavMessage::parse(body).and_then(|message| self.take(message)) {
                take(&imu);
            }
        });
        self.decoder = decoder;
    }

    fn poll(&mut self, now: Duration, outgoing: &mut Vec<u8>) -> Result<(), DeviceFault> {
        let waits = self.answered != [true; 3] && self.tries < MAX_ATTEMPTS;
        if waits && now.saturating_sub(self.requested_at) >= TIMEOUT {
            self.request(now, outgoing);
        }
        Ok(())
    }

    fn identity(&self) -> &str {
        &self.identity
    }

    fn damaged(&self) -> u64 {
        self.decoder.damaged()
    }

    fn device_error(&self) -> Option<&str> {
        self.device_error.as_deref()
    }

    fn allowed_silence(&self) -> Option<Duration> {
        Some(TIMEOUT * (MAX_ATTEMPTS + 1))
    }

    fn nominal_rate(&self) -> Option<f64> {
        Some(f64::from(self.options.rate))
    }
}
