//! Conversation with an RPLIDAR.

use std::time::Duration;

use super::packet::{PacketDecoder, RplidarNode, RplidarPacket, RplidarRequest};
use super::sweep::TurnBuilder;
use crate::driver::{DeviceFault, DeviceProtocol};
use crate::scan::LaserSweep;

/// Timeout of an answer before a request is repeated.
const TIMEOUT: Duration = Duration::from_millis(500);
/// Time that the scanner needs after a stop.
const PAUSE: Duration = Duration::from_millis(50);
/// Attempts of a request.
const MAX_ATTEMPTS: u32 = 4;
/// Time without a turn after which the scanner is silent.
const SILENCE: Duration = Duration::from_secs(1);
/// Time until the motor turns.
const SPIN_UP: Duration = Duration::from_secs(3);
/// Motor speed in revolutions per second below which it is too slow.
/// The driver counts as late below a part of it.
const SLOWEST: f64 = 5.0;

/// Driver's options for a scanner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RplidarOptions {
    /// Beams of a scan.
    pub beams: usize,
    /// Minimum range, meters.
    pub range_min: f64,
    /// Maximum range, meters.
    pub range_max: f64,
    /// Speed of the motor, 0 to 1023.
    pub motor: u16,
}

/// Step of the conversation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RplidarPhase {
    /// Stop of a scan that an earlier program has begun.
    Stop,
    /// Request of the model.
    Information,
    /// Request of the state of health.
    Health,
    /// Request of a scan.
    Request,
    /// Reception of nodes.
    Scan,
}

/// Conversation with a scanner.
#[derive(Clone, Debug)]
pub struct RplidarSession {
    options: RplidarOptions,
    phase: RplidarPhase,
    requested_at: Duration,
    tries: u32,
    decoder: PacketDecoder,
    turn: TurnBuilder,
    /// True if the beginning of a revolution was seen.
    has_begun: bool,
    /// True if a whole revolution was seen.
    has_turned: bool,
    identity: String,
    refused: Option<DeviceFault>,
    device_error: Option<String>,
}

impl RplidarSession {
    /// Returns a session that has not begun.
    pub fn new(options: RplidarOptions) -> Self {
        Self {
            options,
            phase: RplidarPhase::Stop,
            requested_at: Duration::ZERO,
            tries: 0,
            decoder: PacketDecoder::default(),
            turn: TurnBuilder::new(options.beams, options.range_min, options.range_max),
            has_begun: false,
            has_turned: false,
            identity: "an RPLIDAR".into(),
            refused: None,
            device_error: None,
        }
    }

    fn enter(&mut self, phase: RplidarPhase, now: Duration, outgoing: &mut Vec<u8>) {
        (self.phase, self.tries) = (phase, 0);
        self.request(now, outgoing);
    }

    fn request(&mut self, now: Duration, outgoing: &mut Vec<u8>) {
        self.requested_at = now;
        self.tries += 1;
        match self.phase {
            RplidarPhase::Stop => RplidarRequest::Stop.append(outgoing),
            RplidarPhase::Information => RplidarRequest::Information.append(outgoing),
            RplidarPhase::Health => RplidarRequest::Health.append(outgoing),
            RplidarPhase::Request => {
                RplidarRequest::Motor(self.options.motor).append(outgoing);
                RplidarRequest::Scan.append(outgoing);
            }
            RplidarPhase::Scan => {}
        }
    }

    /// Handles a packet; returns the scan of a completed revolution.
    fn take(
        &mut self,
        packet: RplidarPacket<'_>,
        now: Duration,
        outgoing: &mut Vec<u8>,
    ) -> Option<LaserSweep> {
        match (self.phase, packet) {
            (RplidarPhase::Information, RplidarPacket::Information(data)) => {
                self.identity = identity(data);
                self.enter(RplidarPhase::Health, now, outgoing);
            }
            (RplidarPhase::Health, RplidarPacket::Health(status, code)) => {
                self.device_error =
                    (status == 1).then(|| format!("the scanner warns of itself (code {code:#06x})"));
                if status > 1 {
                    RplidarRequest::Reset.append(outgoing);
                    self.refused = Some(DeviceFault::Refused(format!(
                        "the scanner reports a defect (code {code:#06x}): is its motor free? It is restarted"
                    )));
                }
                self.enter(RplidarPhase::Request, now, outgoing);
            }
            (RplidarPhase::Request, RplidarPacket::ScanBegins) => {
                self.enter(RplidarPhase::Scan, now, outgoing);
                (self.has_begun, self.has_turned) = (false, false);
            }
            (RplidarPhase::Scan, RplidarPacket::Node(node)) => return self.take_node(&node),
            _ => {}
        }
        None
    }

    fn take_node(&mut self, node: &RplidarNode) -> Option<LaserSweep> {
        let sweep = if node.begins { self.turn.finish().filter(|_| self.has_begun) } else { None };
        self.has_begun |= node.begins;
        self.has_turned |= sweep.is_some();
        self.turn.add(node);
        sweep
    }
}

/// Returns the identity in a response: model and serial number.
/// Model 24 is an A1M8, and so on: the higher four bits are the series; the serial number has 16 bytes.
fn identity(data: &[u8]) -> String {
    let [model, minor, major, _, serial @ ..] = data else { return "an RPLIDAR".into() };
    let serial: String = serial.iter().take(4).map(|byte| format!("{byte:02X}")).collect();
    let series = match model >> 4 {
        0 | 1 => "A1",
        2 => "A2",
        3 => "A3",
        4 => "S1",
        _ => "of another series",
    };
    format!("RPLIDAR {series} (model {model}, firmware {major}.{minor:02}, {serial})")
}

impl DeviceProtocol for RplidarSession {
    type Value = LaserSweep;

    fn begin(&mut self, now: Duration, outgoing: &mut Vec<u8>) {
        self.decoder.clear();
        let _ = self.turn.finish();
        (self.refused, self.device_error) = (None, None);
        (self.has_begun, self.has_turned) = (false, false);
        self.enter(RplidarPhase::Stop, now, outgoing);
    }

    fn receive(
        &mut self,
        bytes: &[u8],
        now: Duration,
        outgoing: &mut Vec<u8>,
        take: &mut dyn FnMut(&LaserSweep),
    ) {
        // Until the pause is over, an old scan runs out.
        if self.phase == RplidarPhase::Stop {
            return;
        }
        let mut decoder = std::mem::take(&mut self.decoder);
        decoder.receive(bytes, |packet| {
            if let Some(sweep) = self.take(packet, now, outgoing) {
                take(&sweep);
            }
        });
        self.decoder = decoder;
    }

    fn poll(&mut self, now: Duration, outgoing: &mut Vec<u8>) -> Result<(), DeviceFault> {
        if let Some(fault) = self.refused.take() {
            return Err(fault);
        }
        let passed = now.saturating_sub(self.requested_at);
        match self.phase {
            RplidarPhase::Stop if passed >= PAUSE => self.enter(RplidarPhase::Information, now, outgoing),
            RplidarPhase::Stop | RplidarPhase::Scan => {}
            _ if passed >= TIMEOUT && self.tries < MAX_ATTEMPTS => self.request(now, outgoing),
            _ => {}
        }
        Ok(())
    }

    fn end(&mut self, outgoing: &mut Vec<u8>) {
        RplidarRequest::Stop.append(outgoing);
        RplidarRequest::Motor(0).append(outgoing);
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
        Some(match self.phase {
            RplidarPhase::Scan if self.has_turned => SILENCE,
            _ => TIMEOUT * MAX_ATTEMPTS + SPIN_UP,
        })
    }

    fn nominal_rate(&self) -> Option<f64> {
        Some(SLOWEST)
    }

    fn data_terminal_ready(&self) -> bool {
        // The motor of an A1 turns while DTR is off.
        false
    }
}
