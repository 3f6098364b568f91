use std::time::Duration;

use slate_device_line::simulated::DeviceFirmware;

use crate::rplidar::packet::{ResponseKind, RplidarNode, RplidarRequest};

/// Nodes of a turn.
const NODES: usize = 360;

/// Simulated RPLIDAR A2 of Slamtec, which measures at each degree.
#[derive(Clone, Debug)]
pub struct SimulatedRplidar {
    /// Distances at each degree clockwise from the front, quarters of a millimeter.
    /// 0 without an echo.
    distances: [u16; NODES],
    received: Vec<u8>,
    outgoing: Vec<u8>,
    /// Next node, and its time.
    scan: Option<(usize, Duration)>,
    motor: u16,
    health: (u8, u16),
    /// Turns in a second.
    speed: f64,
}

impl Default for SimulatedRplidar {
    fn default() -> Self {
        Self {
            distances: [8000; NODES],
            received: Vec::new(),
            outgoing: Vec::new(),
            scan: None,
            motor: 0,
            health: (0, 0),
            speed: 10.0,
        }
    }
}

impl SimulatedRplidar {
    /// Sets the distance at each degree clockwise from the front.
    /// Quarters of a millimeter; 0 without an echo.
    pub fn set_distances(&mut self, distance: impl Fn(u16) -> u16) {
        for (degree, place) in (0..).zip(&mut self.distances) {
            *place = distance(degree);
        }
    }

    /// Sets its state of health: 0 good, 1 a warning, 2 an error; and a code.
    pub fn set_health(&mut self, status: u8, code: u16) {
        self.health = (status, code);
    }

    /// Sets the number of turns in a second.
    pub fn set_speed(&mut self, speed: f64) {
        self.speed = speed;
    }

    /// Returns the set motor speed; 0 while it is off.
    pub fn motor(&self) -> u16 {
        self.motor
    }

    fn answer(&mut self, request: RplidarRequest) {
        match request {
            RplidarRequest::Stop => self.scan = None,
            RplidarRequest::Reset => {
                self.scan = None;
                self.health = (0, 0);
            }
            RplidarRequest::Motor(speed) => self.motor = speed,
            RplidarRequest::Information => {
                self.outgoing.extend(ResponseKind::Information.descriptor());
                self.outgoing.extend([0x28, 0x1D, 0x01, 0x05]);
                self.outgoing.extend([0xA5; 16]);
            }
            RplidarRequest::Health => {
                self.outgoing.extend(ResponseKind::Health.descriptor());
                let [low, high] = self.health.1.to_le_bytes();
                self.outgoing.extend([self.health.0, low, high]);
            }
            RplidarRequest::Scan if self.health.0 < 2 => {
                self.outgoing.extend(ResponseKind::Scan.descriptor());
                self.scan = Some((0, Duration::ZERO));
            }
            RplidarRequest::Scan => {}
        }
    }
}

impl DeviceFirmware for SimulatedRplidar {
    fn receive(&mut self, bytes: &[u8]) {
        self.received.extend_from_slice(bytes);
        while let Some(first) = self.received.first() {
            let used = match RplidarRequest::parse(&self.received) {
                Some((request, used)) => {
                    self.answer(request);
                    used
                }
                // The rest may come.
                None if *first == 0xA5 && self.received.len() < 6 => return,
                None => 1,
            };
            self.received.drain(..used);
        }
    }

    fn advance(&mut self, now: Duration, outgoing: &mut Vec<u8>) {
        outgoing.append(&mut self.outgoing);
        let Some((mut node, mut time)) = self.scan else { return };
        let step = Duration::from_secs_f64(1.0 / (self.speed * NODES as f64));
        if time == Duration::ZERO || now > time + step * NODES as u32 {
            time = now;
        }
        while time <= now {
            let angle = node as u16 * 64;
            let sent = RplidarNode { begins: node == 0, quality: 15, angle, distance: self.distances[node] };
            outgoing.extend(sent.bytes());
            node = (node + 1) % NODES;
            time += step;
        }
        self.scan = Some((node, time));
    }
}
