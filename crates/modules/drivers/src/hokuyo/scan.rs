//! Scans of SCIP 2.0: the commands `MD` and `ME`, and their responses.

use super::encoding::{append_blocks, append_line, decode, encode};
use super::response::ScipResponse;

/// Command for continuous scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanCommand {
    /// True if intensities come with the distances (`ME`).
    pub intensities: bool,
    /// First step.
    pub first: u16,
    /// Last step.
    pub last: u16,
    /// Steps that are measured as one, of which the shortest distance counts.
    pub cluster: u8,
    /// Scans that are left out after each one, 0 to 9.
    pub skip: u8,
    /// Number of scans, 1 to 99; 0 without end. In a scan, the number of those to come.
    pub count: u8,
}

impl ScanCommand {
    /// Returns the command, or its echo, without a line feed.
    pub fn text(&self) -> String {
        let Self { first, last, cluster, skip, count, .. } = self;
        let name = if self.intensities { "ME" } else { "MD" };
        format!("{name}{first:04}{last:04}{cluster:02}{skip:01}{count:02}")
    }

    /// Reads a command, or its echo.
    pub fn parse(text: &[u8]) -> Option<Self> {
        let text = text.get(..15)?;
        let number = |from: usize, to: usize| {
            let digits = text[from..to].iter().map(|digit| char::from(*digit).to_digit(10));
            digits.into_iter().try_fold(0_u16, |number, digit| Some(number * 10 + digit? as u16))
        };
        let intensities = match &text[..2] {
            b"MD" => false,
            b"ME" => true,
            _ => return None,
        };
        Some(Self {
            intensities,
            first: number(2, 6)?,
            last: number(6, 10)?,
            cluster: number(10, 12)? as u8,
            skip: number(12, 13)? as u8,
            count: number(13, 15)? as u8,
        })
    }

    /// Returns the number of beams of a scan.
    pub fn beams(&self) -> usize {
        let steps = usize::from(self.last.saturating_sub(self.first));
        steps / usize::from(self.cluster.max(1)) + 1
    }
}

/// Characters of a distance, and of an intensity.
const WIDTH: usize = 3;
/// Characters of a time stamp.
const STAMP: usize = 4;

/// Scan of a scanner.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ScipScan {
    /// Time of the scanner's clock, milliseconds; wraps around after 24 bits.
    pub time: u32,
    /// Distances, millimeters; below the scanner's minimum they are codes of errors.
    pub distances: Vec<u32>,
    /// Intensities, if they were requested.
    pub intensities: Vec<u32>,
}

impl ScipScan {
    /// Reads the scan of a response with status `99`, replacing the old one.
    /// The number of distances is that of the command; `None` for another number.
    pub fn read(&mut self, command: &ScanCommand, response: &ScipResponse<'_>) -> Option<()> {
        let mut lines = response.lines();
        self.time = decode(lines.next().filter(|stamp| stamp.len() == STAMP)?)?;
        self.distances.clear();
        self.intensities.clear();
        let beams = command.beams();
        // A number may begin in one line and end in the next one.
        let (mut number, mut places) = (0, 0);
        let mut is_distance = true;
        for character in lines.flatten() {
            number = number << 6 | decode(&[*character])?;
            places += 1;
            if places == WIDTH {
                let list = if is_distance { &mut self.distances } else { &mut self.intensities };
                if list.len() == beams {
                    return None;
                }
                list.push(number);
                is_distance = !(command.intensities && is_distance);
                (number, places) = (0, 0);
            }
        }
        let intensities = if command.intensities { beams } else { 0 };
        let is_whole = places == 0 && self.distances.len() == beams && self.intensities.len() == intensities;
        is_whole.then_some(())
    }

    /// Appends the response with this scan, as a scanner sends it.
    pub fn append(&self, command: &ScanCommand, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(command.text().as_bytes());
        bytes.push(b'\n');
        append_line(b"99", bytes);
        let mut stamp = Vec::with_capacity(STAMP);
        encode(self.time, STAMP, &mut stamp);
        append_line(&stamp, bytes);
        let mut data = Vec::with_capacity(2 * WIDTH * self.distances.len());
        for (beam, distance) in self.distances.iter().enumerate() {
            encode(*distance, WIDTH, &mut data);
            if command.intensities {
                encode(self.intensities.get(beam).copied().unwrap_or(0), WIDTH, &mut data);
            }
        }
        append_blocks(&data, bytes);
        bytes.push(b'\n');
    }
}
