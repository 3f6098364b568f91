//! Laser logs of CARMEN that GMapping has corrected.

use std::fs;
use std::path::Path;
use std::str::FromStr;

use slate_interfaces::Pose2;
use slate_module::math;
use slate_slam::se2;

use crate::DataError;

/// Angle between beams over that of beams which spread over half a turn, by which scans of the Intel Research Lab fit
/// each other best, without any reference: of 0.97 to 1.01, 0.985 and 0.99 give the largest information of matches.
const BEAM_SHARE: f64 = 0.99;

/// A laser log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LaserLog {
    /// Scans, in the order of the log.
    pub scans: Vec<LoggedScan>,
    /// Poses of the raw odometry, in the order of the log.
    pub odometry: Vec<LoggedPose>,
}

/// A scan of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedScan {
    /// Pose of the raw odometry.
    pub odometry: Pose2,
    /// Pose as GMapping has corrected it.
    pub corrected: Pose2,
    /// Ends of beams in the robot's frame, m.
    pub points: Vec<[f64; 2]>,
}

/// A pose of the odometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoggedPose {
    /// Time of the log, s.
    pub time: f64,
    /// Raw odometry.
    pub pose: Pose2,
    /// Number of scans before it.
    pub scans: usize,
}

/// Reads a log whose `ODOM` lines are moved onto the corrected pose of each `FLASER` line: between two of these, their
/// increments are those of the raw odometry, which is rebuilt from them.
///
/// # Errors
/// A file that is no such log; the error names the line.
pub fn read_log(file: &Path) -> Result<LaserLog, DataError> {
    let text = fs::read_to_string(file).map_err(|error| DataError::unreadable(file, &error))?;
    let mut log = LaserLog::default();
    // The newest corrected pose, and the raw one at the same place.
    let mut newest: Option<(Pose2, Pose2)> = None;
    for (number, line) in text.lines().enumerate() {
        let wrong = || DataError::at(file, number, "expected CARMEN's `ODOM` or `FLASER` with its columns");
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.split_first() {
            Some((&"ODOM", words)) => {
                let [x, y, theta, _, _, _, time] = numbers(words).ok_or_else(wrong)?;
                let corrected = Pose2 { x, y, theta };
                // The pose of a scan is there again, without a time.
                if time == 0.0 && !log.scans.is_empty() {
                    continue;
                }
                let pose = raw(newest, corrected);
                newest = Some((corrected, pose));
                log.odometry.push(LoggedPose { time, pose, scans: log.scans.len() });
            }
            Some((&"FLASER", words)) => {
                let ranges = words.first().and_then(|count| usize::from_str(count).ok()).ok_or_else(wrong)?;
                let rest = words.get(ranges.saturating_add(1)..).ok_or_else(wrong)?;
                let [x, y, theta] = numbers(rest).ok_or_else(wrong)?;
                // The last line before has the same time.
                let odometry = newest.map_or(Pose2::default(), |(_, pose)| pose);
                let corrected = Pose2 { x, y, theta };
                newest = Some((corrected, odometry));
                let points = points(&words[1..=ranges]).ok_or_else(wrong)?;
                log.scans.push(LoggedScan { odometry, corrected, points });
            }
            _ => {}
        }
    }
    match log.scans.is_empty() || log.odometry.is_empty() {
        true => Err(DataError::new(file, "expected lines `ODOM` and `FLASER`")),
        false => Ok(log),
    }
}

fn raw(newest: Option<(Pose2, Pose2)>, corrected: Pose2) -> Pose2 {
    match newest {
        Some((before, pose)) => se2::compose(pose, se2::relative(before, corrected)),
        None => corrected,
    }
}

/// The first columns.
fn numbers<const N: usize>(words: &[&str]) -> Option<[f64; N]> {
    let mut found = [0.0; N];
    for (number, word) in found.iter_mut().zip(words.get(..N)?) {
        *number = word.parse().ok().filter(|number: &f64| number.is_finite())?;
    }
    Some(found)
}

/// Ends of beams, of which the middle one looks ahead.
fn points(ranges: &[&str]) -> Option<Vec<[f64; 2]>> {
    let step = BEAM_SHARE * std::f64::consts::PI / ranges.len() as f64;
    let point = |(beam, range): (usize, &&str)| {
        let range: f64 = range.parse().ok()?;
        let bearing = (beam as f64 - ranges.len() as f64 / 2.0) * step;
        Some([range * math::cos(bearing), range * math::sin(bearing)])
    };
    ranges.iter().enumerate().map(point).collect()
}
