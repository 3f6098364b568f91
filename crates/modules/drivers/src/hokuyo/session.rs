//! Conversation with a scanner of SCIP 2.0.

use std::time::Duration;

use slate_module::Sequence;

use super::response::{ScipDecoder, ScipResponse};
use super::scan::{ScanCommand, ScipScan};
use super::specification::ScannerSpecification;
use crate::driver::{DeviceFault, DeviceProtocol};
use crate::scan::{LaserSweep, MOST_BEAMS};

/// Timeout of an answer before a command is repeated.
const TIMEOUT: Duration = Duration::from_millis(300);
/// Attempts of a command.
const MAX_ATTEMPTS: u32 = 3;
/// Time without a scan after which the scanner is silent.
const SILENCE: Duration = Duration::from_secs(1);

/// Driver's options for a scanner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HokuyoOptions {
    /// First direction, radians.
    pub angle_min: f64,
    /// Last direction, radians.
    pub angle_max: f64,
    /// Steps that are measured as one.
    pub cluster: u8,
    /// Scans that are left out after each one.
    pub skip: u8,
}

/// Step of the conversation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum HokuyoPhase {
    /// Ends what an earlier program has begun.
    Quit,
    /// Request of the parameters.
    Parameters,
    /// Request of the serial number.
    Version,
    /// Switches the laser on.
    Laser,
    /// Request of scans.
    Request,
    /// Reception of scans.
    Scans,
}

/// Conversation with a scanner.
#[derive(Clone, Debug)]
pub struct HokuyoSession {
    options: HokuyoOptions,
    phase: HokuyoPhase,
    requested_at: Duration,
    tries: u32,
    decoder: ScipDecoder,
    specification: ScannerSpecification,
    command: ScanCommand,
    scan: ScipScan,
    identity: String,
    refused: Option<DeviceFault>,
    device_error: Option<String>,
    /// Number of scans with another number of beams than requested.
    mismatches: u64,
}

impl HokuyoSession {
    /// Returns a session that has not begun.
    pub fn new(options: HokuyoOptions) -> Self {
        Self {
            options,
            phase: HokuyoPhase::Quit,
            requested_at: Duration::ZERO,
            tries: 0,
            decoder: ScipDecoder::default(),
            specification: ScannerSpecification::default(),
            command: ScanCommand { intensities: false, first: 0, last: 0, cluster: 1, skip: 0, count: 0 },
            scan: ScipScan::default(),
            identity: "a Hokuyo scanner".into(),
            refused: None,
            device_error: None,
            mismatches: 0,
        }
    }

    fn enter(&mut self, phase: HokuyoPhase, now: Duration, outgoing: &mut Vec<u8>) {
        (self.phase, self.tries) = (phase, 0);
        self.request(now, outgoing);
    }

    fn request(&mut self, now: Duration, outgoing: &mut Vec<u8>) {
        self.requested_at = now;
        self.tries += 1;
        let command = match self.phase {
            // An old scanner starts in SCIP 1; a newer one refuses this command.
            HokuyoPhase::Quit if self.tries == 2 => "SCIP2.0\nQT".into(),
            HokuyoPhase::Quit => "QT".into(),
            HokuyoPhase::Parameters => "PP".into(),
            HokuyoPhase::Version => "VV".into(),
            HokuyoPhase::Laser => "BM".into(),
            HokuyoPhase::Request => self.command.text(),
            HokuyoPhase::Scans => return,
        };
        outgoing.extend_from_slice(command.as_bytes());
        outgoing.push(b'\n');
    }

    /// Handles a response; true for a scan, which is then in `self.scan`.
    fn take(&mut self, response: &ScipResponse<'_>, now: Duration, outgoing: &mut Vec<u8>) -> bool {
        let name = response.echo.get(..2).unwrap_or_default();
        match (self.phase, name, &response.status) {
            (HokuyoPhase::Quit, b"QT", _) => self.enter(HokuyoPhase::Parameters, now, outgoing),
            (HokuyoPhase::Parameters, b"PP", b"00") => {
                let Some(specification) = ScannerSpecification::read(response) else { return false };
                self.command = command(&self.options, &specification);
                if self.command.beams() > MOST_BEAMS {
                    let beams = self.command.beams();
                    self.refused = Some(DeviceFault::Refused(format!(
                        "a scan would have {beams} beams, more than {MOST_BEAMS}: raise `cluster`, or narrow the angles"
                    )));
                }
                self.specification = specification;
                self.enter(HokuyoPhase::Version, now, outgoing);
            }
            (HokuyoPhase::Version, b"VV", b"00") => {
                let serial = response.value("SERI").unwrap_or("without a number");
                let serial: String = serial.chars().filter(|letter| !letter.is_control()).take(32).collect();
                self.identity = format!("{} ({serial})", self.specification.model);
                self.enter(HokuyoPhase::Laser, now, outgoing);
            }
            // 02: it is on already.
            (HokuyoPhase::Laser, b"BM", b"00" | b"02") => self.enter(HokuyoPhase::Request, now, outgoing),
            (HokuyoPhase::Laser, b"BM", b"01") => {
                let text = "the scanner can't switch its laser on: switch it off and on again".into();
                self.refused = Some(DeviceFault::Refused(text));
            }
            (HokuyoPhase::Request, b"MD" | b"ME", b"00") => self.enter(HokuyoPhase::Scans, now, outgoing),
            (HokuyoPhase::Request | HokuyoPhase::Scans, b"MD" | b"ME", b"99") => {
                return self.take_scan(response);
            }
            (HokuyoPhase::Request | HokuyoPhase::Scans, b"MD" | b"ME", status) => self.take_status(*status),
            _ => {}
        }
        false
    }

    fn take_scan(&mut self, response: &ScipResponse<'_>) -> bool {
        // Scans requested by an earlier program have other steps.
        let expected = ScanCommand { count: 0, ..self.command };
        let is_own = ScanCommand::parse(response.echo)
            .is_some_and(|echo| ScanCommand { count: 0, ..echo } == expected);
        if !is_own {
            return false;
        }
        self.phase = HokuyoPhase::Scans;
        self.device_error = None;
        let is_whole = self.scan.read(&self.command, response).is_some();
        self.mismatches += u64::from(!is_whole);
        is_whole
    }

    /// Handles a status of `MD`, SCIP 2.0.
    /// 1 to 6: a wrong command; 21 to 49: a pause; 50 to 97: a defect; 98: the end of a pause.
    fn take_status(&mut self, status: [u8; 2]) {
        let text = String::from_utf8_lossy(&status).into_owned();
        match text.parse::<u32>() {
            Ok(0 | 98) => self.device_error = None,
            Ok(21..=49) => {
                self.device_error = Some(format!("the scanner pauses to check itself (status {text})"))
            }
            Ok(50..=97) => {
                let text =
                    format!("the scanner reports a defect (status {text}): switch it off and on again");
                self.refused = Some(DeviceFault::Refused(text));
            }
            _ => {
                let text = format!("the scanner refuses `{}` (status {text})", self.command.text());
                self.refused = Some(DeviceFault::Refused(text));
            }
        }
    }

    fn sweep(&self) -> LaserSweep {
        let ScannerSpecification { least, most, .. } = self.specification;
        let meters = |distance: u32| {
            // Below the minimum it is a code of an error, beyond the maximum there was no echo.
            if (least..=most).contains(&distance) {
                (f64::from(distance) / 1000.0) as f32
            } else {
                f32::INFINITY
            }
        };
        let mut ranges = [0.0; MOST_BEAMS];
        let count = self.scan.distances.len().min(MOST_BEAMS);
        for (range, distance) in ranges.iter_mut().zip(&self.scan.distances) {
            *range = meters(*distance);
        }
        let cluster = f64::from(self.command.cluster.max(1));
        let increment = self.specification.increment();
        LaserSweep {
            // The middle of the first cluster.
            angle_min: self.specification.angle(self.command.first) + (cluster - 1.0) / 2.0 * increment,
            angle_increment: increment * cluster,
            range_min: f64::from(least) / 1000.0,
            range_max: f64::from(most) / 1000.0,
            ranges: Sequence::new(&ranges[..count]),
        }
    }
}

fn command(options: &HokuyoOptions, specification: &ScannerSpecification) -> ScanCommand {
    let (first, last) = specification.steps(options.angle_min, options.angle_max);
    // Whole clusters alone.
    let rest = (last - first + 1) % u16::from(options.cluster.max(1));
    let last = last.saturating_sub(rest).max(first);
    ScanCommand { intensities: false, first, last, cluster: options.cluster, skip: options.skip, count: 0 }
}

impl DeviceProtocol for HokuyoSession {
    type Value = LaserSweep;

    fn begin(&mut self, now: Duration, outgoing: &mut Vec<u8>) {
        self.decoder.clear();
        (self.refused, self.device_error) = (None, None);
        self.enter(HokuyoPhase::Quit, now, outgoing);
    }

    fn receive(
        &mut self,
        bytes: &[u8],
        now: Duration,
        outgoing: &mut Vec<u8>,
        take: &mut dyn FnMut(&LaserSweep),
    ) {
        let mut decoder = std::mem::take(&mut self.decoder);
        decoder.receive(bytes, |response| {
            if self.take(&response, now, outgoing) {
                take(&self.sweep());
            }
        });
        self.decoder = decoder;
    }

    fn poll(&mut self, now: Duration, outgoing: &mut Vec<u8>) -> Result<(), DeviceFault> {
        if let Some(fault) = self.refused.take() {
            return Err(fault);
        }
        if self.phase == HokuyoPhase::Scans || now.saturating_sub(self.requested_at) < TIMEOUT {
            return Ok(());
        }
        if self.tries >= MAX_ATTEMPTS {
            // The silence of the line says more.
            return Ok(());
        }
        self.request(now, outgoing);
        Ok(())
    }

    fn end(&mut self, outgoing: &mut Vec<u8>) {
        outgoing.extend_from_slice(b"QT\n");
    }

    fn identity(&self) -> &str {
        &self.identity
    }

    fn damaged(&self) -> u64 {
        self.decoder.damaged() + self.mismatches
    }

    fn device_error(&self) -> Option<&str> {
        self.device_error.as_deref()
    }

    fn allowed_silence(&self) -> Option<Duration> {
        Some(match self.phase {
            HokuyoPhase::Scans if self.device_error.is_some() => SILENCE * 10,
            HokuyoPhase::Scans => SILENCE * (1 + u32::from(self.options.skip) / 4),
            // All attempts of a command.
            _ => TIMEOUT * (MAX_ATTEMPTS + 1),
        })
    }

    fn nominal_rate(&self) -> Option<f64> {
        let turns = f64::from(self.specification.speed) / 60.0;
        (turns > 0.0).then(|| turns / f64::from(self.options.skip + 1))
    }
}
