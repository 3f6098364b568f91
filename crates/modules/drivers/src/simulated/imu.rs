use std::time::Duration;

use slate_device_line::simulated::DeviceFirmware;

use super::PeriodClock;
use crate::sentence::{self, SentenceDecoder};

/// Simulated VN-100 of VectorNav.
#[derive(Clone, Debug)]
pub struct SimulatedImu {
    /// Yaw, pitch and roll, degrees; the axes are x forward, y right, z down.
    attitude: [f64; 3],
    /// Acceleration, m/s².
    acceleration: [f64; 3],
    /// Angular velocity, rad/s.
    angular_velocity: [f64; 3],
    decoder: SentenceDecoder,
    outgoing: Vec<u8>,
    /// Kind of the messages that it sends by itself.
    kind: u32,
    rate: u32,
    beat: PeriodClock,
}

impl Default for SimulatedImu {
    fn default() -> Self {
        Self {
            attitude: [0.0; 3],
            acceleration: [0.0, 0.0, -9.81],
            angular_velocity: [0.0; 3],
            decoder: SentenceDecoder::default(),
            outgoing: Vec::new(),
            // As it comes from its factory: yaw, pitch and roll.
            kind: 1,
            rate: 40,
            beat: PeriodClock::default(),
        }
    }
}

impl SimulatedImu {
    /// Sets yaw, pitch and roll, degrees.
    /// Clockwise from north, nose up, right side down.
    pub fn set_attitude(&mut self, attitude: [f64; 3]) {
        self.attitude = attitude;
    }

    /// Sets the acceleration forward, right and down, m/s².
    /// Level and at rest it is 0, 0, -9.81.
    pub fn set_acceleration(&mut self, acceleration: [f64; 3]) {
        self.acceleration = acceleration;
    }

    /// Sets the angular velocity about the axes forward, right and down, rad/s.
    pub fn set_angular_velocity(&mut self, angular_velocity: [f64; 3]) {
        self.angular_velocity = angular_velocity;
    }

    /// Returns the number of messages in a second.
    pub fn rate(&self) -> u32 {
        self.rate
    }

    fn answer(&mut self, body: &str) {
        let mut fields = body.split(',');
        let name = fields.next().unwrap_or_default();
        let register = fields.next().and_then(|field| field.parse::<u8>().ok());
        let value = fields.next().and_then(|field| field.parse::<u32>().ok());
        match (name, register, value) {
            ("VNRRG", Some(1), _) => sentence::append("VNRRG,01,VN-100S-CR", &mut self.outgoing),
            ("VNWRG", Some(6), Some(kind)) => {
                self.kind = kind;
                sentence::append(body, &mut self.outgoing);
            }
            ("VNWRG", Some(7), Some(rate)) if (1..=200).contains(&rate) => {
                self.rate = rate;
                sentence::append(body, &mut self.outgoing);
            }
            ("VNWRG", Some(7), _) => sentence::append("VNERR,07", &mut self.outgoing),
            _ => sentence::append("VNERR,04", &mut self.outgoing),
        }
    }
}

impl DeviceFirmware for SimulatedImu {
    fn receive(&mut self, bytes: &[u8]) {
        let mut decoder = std::mem::take(&mut self.decoder);
        decoder.receive(bytes, |body| self.answer(body));
        self.decoder = decoder;
    }

    fn advance(&mut self, now: Duration, outgoing: &mut Vec<u8>) {
        outgoing.append(&mut self.outgoing);
        if !self.beat.due(now, Duration::from_secs_f64(1.0 / f64::from(self.rate))) {
            return;
        }
        let [yaw, pitch, roll] = self.attitude;
        let [ax, ay, az] = self.acceleration;
        let [wx, wy, wz] = self.angular_velocity;
        match self.kind {
            1 => sentence::append(&format!("VNYPR,{yaw:+08.3},{pitch:+08.3},{roll:+08.3}"), outgoing),
            14 => sentence::append(
                &format!(
                    "VNYMR,{yaw:+08.3},{pitch:+08.3},{roll:+08.3},+00.2500,+00.0000,+00.4000,{ax:+07.3},{ay:+07.3},\
                     {az:+07.3},{wx:+010.6},{wy:+010.6},{wz:+010.6}"
                ),
                outgoing,
            ),
            _ => {}
        }
    }
}
