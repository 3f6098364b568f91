use std::time::Duration;

use slate_device_line::simulated::DeviceFirmware;

use super::PeriodClock;
use crate::hokuyo::encoding::{append_line, checksum};
use crate::hokuyo::scan::{ScanCommand, ScipScan};
use crate::hokuyo::specification::ScannerSpecification;

/// Simulated UTM-30LX of Hokuyo.
#[derive(Clone, Debug)]
pub struct SimulatedHokuyo {
    specification: ScannerSpecification,
    /// Distance at each step, millimeters.
    distances: Vec<u32>,
    line: Vec<u8>,
    outgoing: Vec<u8>,
    laser_is_on: bool,
    scans: Option<ScanCommand>,
    beat: PeriodClock,
    /// Part of its speed with which it turns.
    speed: f64,
    is_defective: bool,
    /// Scans that were sent.
    count: u64,
}

impl Default for SimulatedHokuyo {
    fn default() -> Self {
        let specification = ScannerSpecification {
            model: "UTM-30LX".into(),
            least: 23,
            most: 60_000,
            resolution: 1440,
            first: 0,
            last: 1080,
            front: 540,
            speed: 2400,
        };
        Self {
            distances: vec![2000; usize::from(specification.last) + 1],
            specification,
            line: Vec::new(),
            outgoing: Vec::new(),
            laser_is_on: false,
            scans: None,
            beat: PeriodClock::default(),
            speed: 1.0,
            is_defective: false,
            count: 0,
        }
    }
}

impl SimulatedHokuyo {
    /// Sets the distance at each step, millimeters.
    pub fn set_distances(&mut self, distance: impl Fn(u16) -> u32) {
        for (step, place) in (0..).zip(&mut self.distances) {
            *place = distance(step);
        }
    }

    /// Sets the part of its speed with which it turns.
    pub fn set_speed(&mut self, speed: f64) {
        self.speed = speed;
    }

    /// Sets a defect of the laser, or ends it.
    pub fn set_defective(&mut self, is_defective: bool) {
        self.is_defective = is_defective;
    }

    /// Returns true if the laser is on.
    pub fn laser_is_on(&self) -> bool {
        self.laser_is_on
    }

    /// Returns the number of scans that were sent.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Returns the angle of a step, radians.
    pub fn angle(&self, step: u16) -> f64 {
        self.specification.angle(step)
    }

    fn answer(&mut self, command: &[u8]) {
        match command {
            b"QT" => {
                self.scans = None;
                self.laser_is_on = false;
                self.status(command, b"00");
            }
            b"BM" if self.is_defective => self.status(command, b"01"),
            b"BM" => {
                let status = if self.laser_is_on { b"02" } else { b"00" };
                self.laser_is_on = true;
                self.status(command, status);
            }
            b"PP" => self.lines(command, &self.parameters()),
            b"VV" => self.lines(
                command,
                &[
                    "VEND:Hokuyo Automatic Co.,Ltd.".into(),
                    "PROD:SOKUIKI Sensor UTM-30LX".into(),
                    "FIRM:1.18.01".into(),
                    "PROT:SCIP 2.0".into(),
                    "SERI:H1234567".into(),
                ],
            ),
            b"II" => {
                let laser = if self.laser_is_on { "LASR:ON" } else { "LASR:OFF" };
                let state = if self.is_defective { "STAT:laser failure" } else { "STAT:Sensor works well." };
                self.lines(
                    command,
                    &["MODL:UTM-30LX".into(), laser.into(), "SCSP:2400".into(), state.into()],
                );
            }
            _ => match ScanCommand::parse(command).filter(|scan| self.fits(scan)) {
                Some(scan) => {
                    self.scans = Some(scan);
                    self.laser_is_on = true;
                    self.status(command, b"00");
                }
                None => self.status(command, b"0E"),
            },
        }
    }

    fn fits(&self, scan: &ScanCommand) -> bool {
        scan.first <= scan.last && scan.last <= self.specification.last
    }

    fn parameters(&self) -> [String; 8] {
        let ScannerSpecification { model, least, most, resolution, first, last, front, speed } =
            &self.specification;
        [
            format!("MODL:{model}(Hokuyo Automatic Co.,Ltd.)"),
            format!("DMIN:{least}"),
            format!("DMAX:{most}"),
            format!("ARES:{resolution}"),
            format!("AMIN:{first}"),
            format!("AMAX:{last}"),
            format!("AFRT:{front}"),
            format!("SCAN:{speed}"),
        ]
    }

    fn begin(&mut self, command: &[u8], status: &[u8; 2]) {
        self.outgoing.extend_from_slice(command);
        self.outgoing.push(b'\n');
        append_line(status, &mut self.outgoing);
    }

    fn status(&mut self, command: &[u8], status: &[u8; 2]) {
        self.begin(command, status);
        self.outgoing.push(b'\n');
    }

    fn lines(&mut self, command: &[u8], lines: &[String]) {
        self.begin(command, b"00");
        for line in lines {
            self.outgoing.extend_from_slice(line.as_bytes());
            self.outgoing.extend([b';', checksum(line.as_bytes()), b'\n']);
        }
        self.outgoing.push(b'\n');
    }

    fn scan(&self, command: &ScanCommand, now: Duration) -> ScipScan {
        let steps = &self.distances[usize::from(command.first)..=usize::from(command.last)];
        let clusters = steps.chunks(usize::from(command.cluster.max(1)));
        let distances: Vec<u32> =
            clusters.map(|cluster| cluster.iter().copied().min().unwrap_or(0)).collect();
        let intensities = if command.intensities { vec![1000; distances.len()] } else { Vec::new() };
        ScipScan { time: now.as_millis() as u32 & 0xFF_FFFF, distances, intensities }
    }
}

impl DeviceFirmware for SimulatedHokuyo {
    fn receive(&mut self, bytes: &[u8]) {
        for byte in bytes {
            match byte {
                b'\n' | b'\r' => {
                    let line = std::mem::take(&mut self.line);
                    if !line.is_empty() {
                        self.answer(&line);
                    }
                }
                _ if self.line.len() < 64 => self.line.push(*byte),
                _ => self.line.clear(),
            }
        }
    }

    fn advance(&mut self, now: Duration, outgoing: &mut Vec<u8>) {
        outgoing.append(&mut self.outgoing);
        let Some(command) = self.scans else { return };
        let turns = f64::from(self.specification.speed) / 60.0 * self.speed / f64::from(command.skip + 1);
        if self.beat.due(now, Duration::from_secs_f64(1.0 / turns)) {
            self.scan(&command, now).append(&command, outgoing);
            self.count += 1;
        }
    }
}
