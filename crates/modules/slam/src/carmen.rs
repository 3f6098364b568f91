//! Laser logs of CARMEN.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use slate_interfaces::Pose2;
use slate_module::math;

use crate::se2;

/// Properties that a log does not contain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogFormat {
    /// Field of view of a scan, rad; the middle beam points ahead.
    pub field_of_view: f64,
    /// True if GMapping has corrected the `ODOM` lines of the log.
    /// They are moved onto the corrected pose of each `FLASER` line: between two of these, their increments are those
    /// of the raw odometry, which is rebuilt from them.
    pub is_corrected: bool,
}

impl LogFormat {
    /// Log of the Intel Research Lab that GMapping has corrected.
    ///
    /// Of field of views of 0.97 to 1.01 half turns, 0.985 and 0.99 give matches of scans the largest information,
    /// without any reference.
    pub const INTEL: Self = Self { field_of_view: 0.99 * std::f64::consts::PI, is_corrected: true };
}

impl Default for LogFormat {
    fn default() -> Self {
        Self { field_of_view: std::f64::consts::PI, is_corrected: false }
    }
}

/// Laser log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LaserLog {
    /// Scans, in the order of the log.
    pub scans: Vec<LoggedScan>,
    /// Poses of the raw odometry, in the order of the log.
    pub odometry: Vec<LoggedPose>,
}

/// Scan of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedScan {
    /// Time of the log, s.
    /// It is that of the newest line of the odometry if the line has none.
    pub time: f64,
    /// Pose of the raw odometry.
    pub odometry: Pose2,
    /// Pose as the log has corrected it; as the odometry in a raw one.
    pub corrected: Pose2,
    /// Ranges, counter-clockwise, m.
    pub ranges: Vec<f64>,
    /// Direction of the first beam, and angle between beams, rad.
    pub angles: [f64; 2],
}

impl LoggedScan {
    /// Returns the ends of all beams in the robot's frame, m.
    pub fn points(&self) -> Vec<[f64; 2]> {
        let [_, step] = self.angles;
        let point = |(beam, range): (usize, &f64)| {
            let bearing = (beam as f64 - self.ranges.len() as f64 / 2.0) * step;
            [range * math::cos(bearing), range * math::sin(bearing)]
        };
        self.ranges.iter().enumerate().map(point).collect()
    }
}

/// Pose of the odometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoggedPose {
    /// Time of the log, s.
    pub time: f64,
    /// Raw odometry.
    pub pose: Pose2,
    /// Number of scans before it.
    pub scans: usize,
}

/// Log that can't be read.
#[derive(Debug, thiserror::Error)]
pub enum LaserLogError {
    /// Unreadable file.
    #[error("{}: can't be read: {source}", .file.display())]
    Unreadable {
        /// File.
        file: PathBuf,
        /// Cause.
        source: io::Error,
    },
    /// Invalid line for its name.
    #[error("{}:{line}: expected CARMEN's `ODOM` or `FLASER` with its columns", .file.display())]
    Line {
        /// File.
        file: PathBuf,
        /// Number of the line, from 1.
        line: usize,
    },
    /// Log without a scan or odometry.
    #[error("{}: expected lines `ODOM` and `FLASER`", .file.display())]
    Empty {
        /// File.
        file: PathBuf,
    },
}

/// Reads the `ODOM` and `FLASER` lines of a log.
///
/// # Errors
/// A file that is no such log; the error names the line.
pub fn read_log(file: &Path, format: &LogFormat) -> Result<LaserLog, LaserLogError> {
    let text =
        fs::read_to_string(file).map_err(|source| LaserLogError::Unreadable { file: file.into(), source })?;
    let mut log = LogBuilder { format: *format, log: LaserLog::default(), newest: None, time: 0.0 };
    for (number, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let read = match words.split_first() {
            Some((&"ODOM", words)) => log.odometry(words),
            Some((&"FLASER", words)) => log.scan(words),
            _ => Some(()),
        };
        read.ok_or_else(|| LaserLogError::Line { file: file.into(), line: number + 1 })?;
    }
    let LogBuilder { log, .. } = log;
    match log.scans.is_empty() || log.odometry.is_empty() {
        true => Err(LaserLogError::Empty { file: file.into() }),
        false => Ok(log),
    }
}

/// Log that is read.
struct LogBuilder {
    format: LogFormat,
    log: LaserLog,
    /// Newest pose of the log, and the raw one at the same place.
    newest: Option<(Pose2, Pose2)>,
    /// Time of the newest line of the odometry.
    time: f64,
}

impl LogBuilder {
    fn odometry(&mut self, words: &[&str]) -> Option<()> {
        let [x, y, theta, _, _, _, time] = numbers(words)?;
        let logged = Pose2 { x, y, theta };
        // Corrected logs have the pose of a scan there again, without a time.
        if self.format.is_corrected && time == 0.0 && !self.log.scans.is_empty() {
            return Some(());
        }
        let pose = self.raw(logged);
        (self.newest, self.time) = (Some((logged, pose)), time);
        self.log.odometry.push(LoggedPose { time, pose, scans: self.log.scans.len() });
        Some(())
    }

    fn scan(&mut self, words: &[&str]) -> Option<()> {
        let count = usize::from_str(words.first()?).ok()?;
        let rest = words.get(count.checked_add(1)?..)?;
        let [x, y, theta] = numbers(rest)?;
        let corrected = Pose2 { x, y, theta };
        let odometry = match (self.format.is_corrected, numbers(rest)) {
            // The last line before has the same time.
            (true, _) => self.newest.map_or(Pose2::default(), |(_, pose)| pose),
            (false, Some([_, _, _, x, y, theta])) => Pose2 { x, y, theta },
            (false, None) => return None,
        };
        self.newest = Some((corrected, odometry));
        let range = |word: &&str| word.parse().ok();
        let ranges: Vec<f64> = words[1..=count].iter().map(range).collect::<Option<_>>()?;
        let step = self.format.field_of_view / count as f64;
        let time = numbers(rest).map_or(self.time, |[_, _, _, _, _, _, time]| time);
        let angles = [-(count as f64) / 2.0 * step, step];
        self.log.scans.push(LoggedScan { time, odometry, corrected, ranges, angles });
        Some(())
    }

    /// Returns the raw odometry at a pose of the log.
    fn raw(&self, logged: Pose2) -> Pose2 {
        match self.newest.filter(|_| self.format.is_corrected) {
            Some((before, pose)) => se2::compose(pose, se2::relative(before, logged)),
            None => logged,
        }
    }
}

/// Returns the first columns.
fn numbers<const N: usize>(words: &[&str]) -> Option<[f64; N]> {
    let mut found = [0.0; N];
    for (number, word) in found.iter_mut().zip(words.get(..N)?) {
        *number = word.parse().ok().filter(|number: &f64| number.is_finite())?;
    }
    Some(found)
}
